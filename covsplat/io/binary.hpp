// Numbers in binary files: little-endian, whatever the machine.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

namespace covsplat {

namespace internal {
template <std::size_t kSize>
struct UnsignedOfSize;
template <>
struct UnsignedOfSize<1> {
  using Type = std::uint8_t;
};
template <>
struct UnsignedOfSize<2> {
  using Type = std::uint16_t;
};
template <>
struct UnsignedOfSize<4> {
  using Type = std::uint32_t;
};
template <>
struct UnsignedOfSize<8> {
  using Type = std::uint64_t;
};
}  // namespace internal

/// Appends an integer or a floating-point number.
template <class T>
void AppendBinary(std::string& bytes, T value) {
  static_assert(std::is_arithmetic_v<T>);
  const auto bits = std::bit_cast<typename internal::UnsignedOfSize<sizeof(T)>::Type>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    bytes.push_back(static_cast<char>(static_cast<std::uint64_t>(bits) >> (8 * i)));
  }
}

/// Reads numbers one after another. What lies beyond the end reads as 0 and makes `Failed()` true,
/// so that a caller may read a whole group and ask once.
class BinaryReader {
 public:
  explicit BinaryReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T Read() {
    static_assert(std::is_arithmetic_v<T>);
    using Bits = typename internal::UnsignedOfSize<sizeof(T)>::Type;
    const std::string_view from = Take(sizeof(T));
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(from[i])) << (8 * i);
    }
    return std::bit_cast<T>(static_cast<Bits>(bits));
  }

  /// The next bytes as they are; empty, and a failure, if there are not as many.
  std::string_view Take(std::size_t size) {
    failed_ = failed_ || size > bytes_.size() - offset_;
    if (failed_) return {};
    const std::string_view taken = bytes_.substr(offset_, size);
    offset_ += size;
    return taken;
  }

  bool Failed() const { return failed_; }
  std::size_t Offset() const { return offset_; }  ///< of what is read next
  std::size_t Left() const { return bytes_.size() - offset_; }

 private:
  std::string_view bytes_;
  std::size_t offset_ = 0;
  bool failed_ = false;
};

}  // namespace covsplat
