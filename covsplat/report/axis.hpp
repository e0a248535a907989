// The numbers along one side of a plot.
#pragma once

#include <string>
#include <vector>

namespace covsplat {

/// Interval of the numbers seen so far; not finite ones are ignored.
struct Bounds {
  double low = 0.0;
  double high = 0.0;
  bool empty = true;

  void Include(double number);
};

/// Marks at 1, 2 or 5 times a power of ten.
struct Ticks {
  std::vector<double> at;
  double step = 1.0;

  /// With as many decimals as the step needs.
  std::string Label(double number) const;
};

/// A drawable interval: never empty, never of zero length, finite.
Bounds Widen(const Bounds& bounds, double margin_share);

/// About `wanted` ticks within the bounds.
Ticks NiceTicks(const Bounds& bounds, int wanted);

}  // namespace covsplat
