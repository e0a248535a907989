#include "covsplat/report/axis.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace covsplat {
namespace {

// Beyond this, differences and steps of doubles could overflow or vanish.
constexpr double kLargestDrawn = 1e15;

double NiceStep(double rough) {
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (rough <= factor * power * (1.0 + 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

}  // namespace

void Bounds::Include(double number) {
  if (!std::isfinite(number)) return;
  number = std::clamp(number, -kLargestDrawn, kLargestDrawn);
  low = empty ? number : std::min(low, number);
  high = empty ? number : std::max(high, number);
  empty = false;
}

Bounds Widen(const Bounds& bounds, double margin_share) {
  if (bounds.empty) return {0.0, 1.0, false};
  const double length = bounds.high - bounds.low;
  const double size = std::max(std::abs(bounds.low), std::abs(bounds.high));
  if (length <= 1e-9 * size || length < 1e-12) {
    const double half = size > 0.0 ? 0.5 * size : 0.5;
    return {bounds.low - half, bounds.high + half, false};
  }
  return {bounds.low - margin_share * length, bounds.high + margin_share * length, false};
}

Ticks NiceTicks(const Bounds& bounds, int wanted) {
  Ticks ticks;
  ticks.step = NiceStep((bounds.high - bounds.low) / std::max(1, wanted));
  const double first = std::ceil(bounds.low / ticks.step - 1e-9);
  const double last = std::floor(bounds.high / ticks.step + 1e-9);
  for (double i = first; i <= last; i += 1.0) ticks.at.push_back(i * ticks.step + 0.0);
  return ticks;
}

std::string Ticks::Label(double number) const {
  if (step >= 1e5 || step < 1e-5) return fmt::format("{:.6g}", number);
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  return fmt::format("{:.{}f}", std::abs(number) < 1e-9 * step ? 0.0 : number, decimals);
}

}  // namespace covsplat
