#include "covsplat/report/png.hpp"

#include <string_view>

#include <png.h>

namespace covsplat {
namespace {

static_assert(sizeof(Rgb) == 3, "pixels are handed to libpng as bytes");

/// libpng's simplified interface: no setjmp.
Result<std::vector<std::uint8_t>> Encode(const void* pixels,
                                         int rows,
                                         int columns,
                                         std::uint32_t format) {
  if (rows <= 0 || columns <= 0) return Fail(ErrorCode::kOutput, "cannot encode an empty image");
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(columns);
  header.height = static_cast<png_uint_32>(rows);
  header.format = format;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::vector<std::uint8_t> bytes(size);
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, pixels, 0, nullptr) == 0) {
    return Fail(ErrorCode::kOutput, "cannot encode an image as PNG: {}", header.message);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace

Result<std::vector<std::uint8_t>> EncodePng(const Image<Rgb>& image) {
  return Encode(image.Pixels().data(), image.Rows(), image.Columns(), PNG_FORMAT_RGB);
}

Result<std::vector<std::uint8_t>> EncodePng(const Image<std::uint8_t>& gray) {
  return Encode(gray.Pixels().data(), gray.Rows(), gray.Columns(), PNG_FORMAT_GRAY);
}

Result<std::vector<std::uint8_t>> EncodePng(const Image<std::uint16_t>& gray) {
  return Encode(gray.Pixels().data(), gray.Rows(), gray.Columns(), PNG_FORMAT_LINEAR_Y);
}

std::string Base64(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? kLetters[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace covsplat
