// Images as PNG, in memory.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "covsplat/core/image.hpp"
#include "covsplat/core/result.hpp"

namespace covsplat {

/// One 8-bit sRGB pixel.
struct Rgb {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  bool operator==(const Rgb&) const = default;
};

/// The bytes of a PNG file; an empty image is an error.
Result<std::vector<std::uint8_t>> EncodePng(const Image<Rgb>& image);
Result<std::vector<std::uint8_t>> EncodePng(const Image<std::uint8_t>& gray);
/// 16 bits as they are, for measurements.
Result<std::vector<std::uint8_t>> EncodePng(const Image<std::uint16_t>& gray);

/// RFC 4648, with padding, without line breaks.
std::string Base64(std::span<const std::uint8_t> bytes);

}  // namespace covsplat
