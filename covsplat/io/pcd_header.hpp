// The header of a PCD file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "covsplat/core/result.hpp"
#include "covsplat/io/point_table.hpp"

namespace covsplat {

/// One entry of FIELDS.
struct PcdField {
  std::string name;
  ScalarType type = ScalarType::kFloat32;
  std::size_t count = 1;
  bool IsPadding() const { return name == "_"; }
};

/// All sizes are consistent and small enough to multiply.
struct PcdHeader {
  std::vector<PcdField> fields;
  std::size_t points = 0;
  std::string data;         ///< ascii, binary or binary_compressed
  std::size_t offset = 0;   ///< of the body
  std::int64_t lines = 0;   ///< in the header
  std::size_t stride = 0;   ///< bytes of one point
  std::size_t numbers = 0;  ///< of one point
};

/// Reads and checks everything up to the DATA line; `file` is for messages.
Result<PcdHeader> ParsePcdHeader(std::string_view bytes, const std::string& file);

}  // namespace covsplat
