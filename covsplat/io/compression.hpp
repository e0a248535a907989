// Compressed bytes (zlib's deflate, and gzip around it) and checksums, all in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace covsplat {

/// CRC-32 as of zlib, PNG and gzip; of more bytes after those that gave `before`.
std::uint32_t Crc32(std::string_view bytes, std::uint32_t before = 0);

/// A zlib stream, the same for the same bytes.
std::string Deflate(std::string_view bytes);

/// What a zlib stream holds, which must be exactly `size` bytes; nothing if it is not or is
/// damaged. Allocates no more than that stream could hold.
std::optional<std::string> Inflate(std::string_view stream, std::size_t size);

/// A gzip file without name or time, the same for the same bytes.
std::string Gzip(std::string_view bytes);

/// What a gzip file of one member holds; nothing if it is damaged or truncated, or holds more than
/// `max_size` bytes.
std::optional<std::string> Gunzip(std::string_view file, std::size_t max_size);

/// Up to `size` bytes from the start of what a gzip file holds, as far as it can be read.
std::string GunzipStart(std::string_view file, std::size_t size);

}  // namespace covsplat
