// AlignedVector: a std::vector whose data starts at a cache line, for arrays that vector
// instructions walk: a load that straddles two lines costs twice.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace covsplat {

inline constexpr std::size_t kCacheLineBytes = 64;

template <class T>
struct CacheLineAllocator {
  using value_type = T;

  CacheLineAllocator() = default;
  template <class U>
  // NOLINTNEXTLINE(google-explicit-constructor): allocators convert
  CacheLineAllocator(const CacheLineAllocator<U>& /*other*/) {}

  // NOLINTBEGIN(readability-identifier-naming): the standard gives these names.
  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), std::align_val_t(kCacheLineBytes)));
  }
  void deallocate(T* data, std::size_t /*count*/) {
    ::operator delete(data, std::align_val_t(kCacheLineBytes));
  }
  // NOLINTEND(readability-identifier-naming)
  template <class U>
  bool operator==(const CacheLineAllocator<U>& /*other*/) const {
    return true;
  }
};

template <class T>
using AlignedVector = std::vector<T, CacheLineAllocator<T>>;

}  // namespace covsplat
