#include "covsplat/core/way_spread.hpp"

namespace covsplat {

std::optional<std::size_t> LeastMissed(std::span<const double> way_m, std::size_t newest) {
  constexpr double kAboutAsNear = 1.25;
  const auto gap_m = [&](std::size_t i) { return way_m[i + 1] - way_m[i - 1]; };
  std::optional<std::size_t> least;
  for (std::size_t i = 1; i + newest < way_m.size() && i + 1 < way_m.size(); ++i) {
    if (!least || kAboutAsNear * gap_m(i) < gap_m(*least)) least = i;
  }
  return least;
}

}  // namespace covsplat
