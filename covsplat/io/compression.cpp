#include "covsplat/io/compression.hpp"

#include <algorithm>
#include <limits>

#include <zlib.h>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

// zlib's windowBits: 15 for the largest window, 16 more for gzip's header and trailer.
constexpr int kZlibWindow = 15;
constexpr int kGzipWindow = 15 + 16;
constexpr std::size_t kMaxDeflateRatio = 1032;  // no deflate stream holds more per byte

/// zlib counts what it is given in 32 bits; more is handed over piece by piece.
uInt PieceOf(std::size_t size) {
  return static_cast<uInt>(std::min<std::size_t>(size, std::numeric_limits<uInt>::max()));
}

Bytef* BytesOf(std::string& text) { return reinterpret_cast<Bytef*>(text.data()); }

/// zlib's interface is not const, but it does not write here.
Bytef* BytesOf(std::string_view text) {
  return const_cast<Bytef*>(reinterpret_cast<const Bytef*>(text.data()));
}

std::string Compress(std::string_view bytes, int window) {
  z_stream stream = {};
  constexpr int kMemoryLevel = 9;
  COVSPLAT_CHECK(
      deflateInit2(
          &stream, Z_BEST_COMPRESSION, Z_DEFLATED, window, kMemoryLevel, Z_DEFAULT_STRATEGY) ==
      Z_OK);
  std::string out(deflateBound(&stream, bytes.size()), '\0');
  std::size_t read = 0;
  std::size_t written = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END) {
    stream.next_in = BytesOf(bytes) + read;
    stream.avail_in = PieceOf(bytes.size() - read);
    stream.next_out = BytesOf(out) + written;
    stream.avail_out = PieceOf(out.size() - written);
    const bool is_last = stream.avail_in == bytes.size() - read;
    state = deflate(&stream, is_last ? Z_FINISH : Z_NO_FLUSH);
    COVSPLAT_CHECK(state == Z_OK || state == Z_STREAM_END);  // out is large enough for all
    read = static_cast<std::size_t>(stream.next_in - BytesOf(bytes));
    written = static_cast<std::size_t>(stream.next_out - BytesOf(out));
  }
  deflateEnd(&stream);
  out.resize(written);
  return out;
}

struct Decompressed {
  std::string bytes;
  bool is_whole = false;  ///< the stream ended, with a right checksum, where its bytes did
};

/// At most `max_size` bytes of what a stream holds.
Decompressed Decompress(std::string_view stream_bytes, int window, std::size_t max_size) {
  z_stream stream = {};
  COVSPLAT_CHECK(inflateInit2(&stream, window) == Z_OK);
  constexpr std::size_t kFirst = std::size_t{1} << 16;
  Decompressed out;
  std::size_t read = 0;
  std::size_t written = 0;
  int state = Z_OK;
  while (state == Z_OK) {
    // One byte more than allowed: a stream that fills it is too long.
    out.bytes.resize(std::min(std::max(kFirst, 2 * written), max_size + 1));
    stream.next_in = BytesOf(stream_bytes) + read;
    stream.avail_in = PieceOf(stream_bytes.size() - read);
    stream.next_out = BytesOf(out.bytes) + written;
    stream.avail_out = PieceOf(out.bytes.size() - written);
    state = inflate(&stream, Z_NO_FLUSH);  // Z_BUF_ERROR if there is nothing to read or no room
    read = static_cast<std::size_t>(stream.next_in - BytesOf(stream_bytes));
    written = static_cast<std::size_t>(stream.next_out - BytesOf(out.bytes));
  }
  inflateEnd(&stream);
  out.is_whole = state == Z_STREAM_END && read == stream_bytes.size() && written <= max_size;
  out.bytes.resize(std::min(written, max_size));
  return out;
}

}  // namespace

std::uint32_t Crc32(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(crc32_z(before, BytesOf(bytes), bytes.size()));
}

std::string Deflate(std::string_view bytes) { return Compress(bytes, kZlibWindow); }

std::optional<std::string> Inflate(std::string_view stream, std::size_t size) {
  if (size / kMaxDeflateRatio > stream.size()) return std::nullopt;
  Decompressed out = Decompress(stream, kZlibWindow, size);
  if (!out.is_whole || out.bytes.size() != size) return std::nullopt;
  return std::move(out.bytes);
}

std::string Gzip(std::string_view bytes) { return Compress(bytes, kGzipWindow); }

std::optional<std::string> Gunzip(std::string_view file, std::size_t max_size) {
  Decompressed out = Decompress(file, kGzipWindow, max_size);
  if (!out.is_whole) return std::nullopt;
  return std::move(out.bytes);
}

std::string GunzipStart(std::string_view file, std::size_t size) {
  return Decompress(file, kGzipWindow, size).bytes;
}

}  // namespace covsplat
