// The header of a PLY file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "covsplat/core/result.hpp"
#include "covsplat/io/point_table.hpp"

namespace covsplat {

enum class PlyFormat { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::kFloat32;  ///< of the value, or of the items of the list
  bool is_list = false;
  ScalarType length_type = ScalarType::kUint8;  ///< of the number in front of a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;

  bool HasLists() const;
  /// Bytes of a row without lists.
  std::size_t Stride() const;
};

struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;
  std::size_t offset = 0;  ///< of the body
  std::int64_t lines = 0;  ///< in the header
};

/// Reads and checks everything up to end_header; `file` is for messages.
Result<PlyHeader> ParsePlyHeader(std::string_view bytes, const std::string& file);

/// The word for a type in a header; empty for the 64-bit integers, which PLY does not have.
std::string_view PlyTypeName(ScalarType type);

}  // namespace covsplat
