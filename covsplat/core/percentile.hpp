// Percentile: order statistics of a column of numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace covsplat {

/// The value that a share of the values does not exceed, by nearest rank. Reorders them; there must
/// be one at least.
template <class T>
T Percentile(std::vector<T>& values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace covsplat
