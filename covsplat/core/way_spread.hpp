// Which of many places along a way can best be done without.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace covsplat {

/// The place whose neighbours are nearest to each other along the way; where they are about equally
/// near, the oldest. So the way stays covered when places are given up one by one, ever more
/// sparsely the longer it is. `way_m`: from the start to each place, ascending. The first and the
/// last `newest` are not to be given up; nothing if there are no others.
std::optional<std::size_t> LeastMissed(std::span<const double> way_m, std::size_t newest);

}  // namespace covsplat
