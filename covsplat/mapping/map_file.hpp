// Map files of every format: one door to read them, one to write them.
#pragma once

#include <filesystem>
#include <string>

#include "covsplat/core/result.hpp"
#include "covsplat/mapping/saved_map.hpp"

namespace covsplat {

enum class MapFormat {
  kPly,      ///< 3D Gaussians with our signals (map_ply.hpp)
  kSpz,      ///< what viewers need, small (map_spz.hpp)
  kCompact,  ///< .csmap: everything, small (compact_map.hpp)
};

/// By the end of the name; the error says which there are.
Result<MapFormat> MapFormatOf(const std::filesystem::path& path);

struct MapFile {
  std::string format;  ///< with its version, for people
  SavedMap map;
};

/// Tells the format by the file's first bytes, whatever its name.
Result<MapFile> ReadMapFile(const std::filesystem::path& path);

/// Writes the file at once.
Result<void> WriteMapFile(const std::filesystem::path& path, MapFormat format, const SavedMap& map);

}  // namespace covsplat
