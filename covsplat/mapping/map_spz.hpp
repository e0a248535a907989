// Maps as SPZ files, Niantic's compressed format of 3D Gaussians, which splat viewers open. It has
// positions, shapes, opacities and colours only, so our signals do not survive it.
#pragma once

#include <string>
#include <string_view>

#include "covsplat/core/result.hpp"
#include "covsplat/mapping/saved_map.hpp"

namespace covsplat {

/// The bytes of a file of version 3. Colour is the normal's, as in map.ply; x y z of the map
/// (forward, left, up) become SPZ's right, up and back. Left out are Gaussians that are not finite.
/// Error: a map that reaches beyond the 8000 km that fit.
Result<std::string> PackSpz(const SavedMap& map, const std::string& file);

struct SpzFile {
  int version = 0;
  SavedMap map;
};

/// Reads versions 2 and 3. The thinnest axis becomes the normal, colours are passed over, signals
/// are as where they are unknown. `file` is for messages.
Result<SpzFile> ParseSpz(std::string_view bytes, const std::string& file);

}  // namespace covsplat
