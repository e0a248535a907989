#include "covsplat/core/beam_table.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;
constexpr std::size_t kFewestBeams = 8;
constexpr std::size_t kMostBeams = 256;
constexpr double kNearest_m = 0.05;

constexpr double kBin_rad = 0.01 * kDegree;
constexpr int kBins = 18000;
// Tried in turn, the finest first: beams that scatter more need a wider filter.
constexpr int kSmoothingRadii[] = {2, 4, 8, 16};  // bins
constexpr double kFar_m = 5.0;                    // nearer points tell less about angles
constexpr double kWeakPeak = 0.4;                 // of both neighbours: no beam but its echo
constexpr double kLowestPeak = 0.01;              // of the highest

using Histogram = std::vector<double>;

bool IsStrictlyDecreasing(const std::vector<double>& values) {
  return std::adjacent_find(values.begin(), values.end(), std::less_equal<>()) == values.end();
}

// The points of a scan, cut where the azimuth jumps by more than half a turn. Azimuths are counted
// from `seam_rad`, where a beam's turn begins and ends.
std::vector<PolarScan> SplitTurns(const PolarScan& scan, double seam_rad) {
  std::vector<PolarScan> turns;
  double previous = 0.0;
  for (const PolarPoint& point : scan) {
    const double turn = (point.azimuth_rad - seam_rad) / (2.0 * kPi);
    const double azimuth = turn - std::floor(turn);
    if (turns.empty() || std::abs(azimuth - previous) > 0.5) turns.emplace_back();
    if (turns.size() > kMostBeams) return {};
    turns.back().push_back(point);
    previous = azimuth;
  }
  return turns;
}

double MedianOfFarHalf(PolarScan points) {
  const auto middle = points.begin() + static_cast<std::ptrdiff_t>((points.size() + 1) / 2);
  std::nth_element(
      points.begin(), middle - 1, points.end(), [](const PolarPoint& a, const PolarPoint& b) {
        return a.range_m > b.range_m;
      });
  std::vector<double> elevations;
  for (auto point = points.begin(); point != middle; ++point) {
    elevations.push_back(point->elevation_rad);
  }
  return Quantile(std::move(elevations), 0.5);
}

// Beams by their place in the order, of the scans that agree on their number; empty if fewer than
// half do.
std::vector<PolarScan> PoolTurns(std::span<const PolarScan> scans, double seam_rad) {
  std::vector<std::vector<PolarScan>> split;
  std::vector<double> counts;
  for (const PolarScan& scan : scans) {
    if (scan.empty()) continue;
    split.push_back(SplitTurns(scan, seam_rad));
    counts.push_back(static_cast<double>(split.back().size()));
  }
  if (counts.empty()) return {};
  const auto usual = static_cast<std::size_t>(Quantile(counts, 0.5));
  std::vector<PolarScan> beams(usual);
  std::size_t agreeing = 0;
  for (const std::vector<PolarScan>& turns : split) {
    if (turns.size() != usual) continue;
    ++agreeing;
    for (std::size_t k = 0; k < usual; ++k) {
      beams[k].insert(beams[k].end(), turns[k].begin(), turns[k].end());
    }
  }
  if (2 * agreeing < split.size()) beams.clear();
  return beams;
}

std::vector<double> OrderedBeams(std::span<const PolarScan> scans, double seam_rad) {
  std::vector<double> elevations;
  for (const PolarScan& beam : PoolTurns(scans, seam_rad)) {
    elevations.push_back(MedianOfFarHalf(beam));
  }
  if (elevations.size() < kFewestBeams) return {};
  if (elevations.front() < elevations.back()) std::reverse(elevations.begin(), elevations.end());
  if (!IsStrictlyDecreasing(elevations)) elevations.clear();
  return elevations;
}

// Near points weigh less, as the beams do not start in the origin, but beams that only meet the
// ground nearby are seen as well.
Histogram HistogramOf(std::span<const PolarScan> scans) {
  Histogram histogram(kBins, 0.0);
  for (const PolarScan& scan : scans) {
    for (const PolarPoint& point : scan) {
      const auto bin = static_cast<int>((point.elevation_rad + 0.5 * kPi) / kBin_rad);
      const double nearness = std::min(1.0, point.range_m / kFar_m);
      histogram[static_cast<std::size_t>(std::clamp(bin, 0, kBins - 1))] += nearness * nearness;
    }
  }
  return histogram;
}

double Mass(const Histogram& histogram, double first, double last) {
  const auto begin = static_cast<std::size_t>(std::clamp(std::round(first), 0.0, 1.0 * kBins));
  const auto end = static_cast<std::size_t>(std::clamp(std::round(last) + 1.0, 0.0, 1.0 * kBins));
  double mass = 0.0;
  for (std::size_t bin = begin; bin < end; ++bin) mass += histogram[bin];
  return mass;
}

// Three running means, close to a Gaussian.
Histogram Smooth(Histogram histogram, int radius) {
  for (int pass = 0; pass < 3; ++pass) {
    Histogram smooth(histogram.size(), 0.0);
    for (int bin = radius; bin < kBins - radius; ++bin) {
      const auto begin = histogram.begin() + bin - radius;
      smooth[static_cast<std::size_t>(bin)] = std::accumulate(begin, begin + 2 * radius + 1, 0.0);
    }
    histogram = std::move(smooth);
  }
  return histogram;
}

// Maxima that stand out at least two to one from the valleys on both sides, as bins.
std::vector<double> FindPeaks(const Histogram& smooth) {
  const double floor = kLowestPeak * *std::max_element(smooth.begin(), smooth.end());
  std::vector<double> peaks;
  bool rising = true;
  double extreme = 0.0;
  std::size_t first = 0;  // bins where the extreme is reached: a plateau's middle is the peak
  std::size_t last = 0;
  for (std::size_t bin = 0; bin < smooth.size(); ++bin) {
    const double value = smooth[bin];
    if (rising && value > extreme) first = bin;
    if (rising && value >= extreme) last = bin;
    extreme = rising ? std::max(extreme, value) : std::min(extreme, value);
    if (rising && extreme > floor && value < 0.5 * extreme) {
      peaks.push_back(0.5 * static_cast<double>(first + last));
      rising = false;
      extreme = value;
    } else if (!rising && value > 2.0 * extreme + 0.5 * floor) {
      rising = true;
      extreme = value;
      first = last = bin;
    }
  }
  return peaks;
}

// Without the peaks that are weak beside both neighbours: stray returns half way between beams.
std::vector<double> StrongPeaks(const std::vector<double>& peaks, const Histogram& smooth) {
  const auto height = [&](std::size_t k) { return smooth[static_cast<std::size_t>(peaks[k])]; };
  std::vector<double> strong;
  for (std::size_t k = 0; k < peaks.size(); ++k) {
    const bool inside = k > 0 && k + 1 < peaks.size();
    const double limit = inside ? kWeakPeak * std::min(height(k - 1), height(k + 1)) : 0.0;
    if (height(k) >= limit) strong.push_back(peaks[k]);
  }
  return strong;
}

// Where the points around a peak are on average.
double Centre(const Histogram& histogram, double peak, double reach) {
  double mass = 0.0;
  double moment = 0.0;
  for (double bin = std::round(peak - reach); bin <= peak + reach; bin += 1.0) {
    const double count = Mass(histogram, bin, bin);
    mass += count;
    moment += count * bin;
  }
  return mass > 0.0 ? moment / mass : peak;
}

// True if half of the points lie in the middle quarter of the space of their peak; even points
// would have a quarter there.
bool PointsGather(const Histogram& histogram, const std::vector<double>& peaks) {
  double near = 0.0;
  for (std::size_t k = 0; k < peaks.size(); ++k) {
    const double below = k > 0 ? peaks[k] - peaks[k - 1] : peaks[1] - peaks[0];
    const double above = k + 1 < peaks.size() ? peaks[k + 1] - peaks[k] : below;
    near += Mass(histogram, peaks[k] - below / 8.0, peaks[k] + above / 8.0);
  }
  return near >= 0.5 * Mass(histogram, 0.0, kBins);
}

}  // namespace

PolarScan ToPolar(const Scan& scan) {
  PolarScan polar;
  polar.reserve(scan.points.size());
  for (const Eigen::Vector3f& point : scan.points) {
    const Eigen::Vector3d p = point.cast<double>();
    const double range = p.norm();
    if (!(range > kNearest_m) || !std::isfinite(range)) continue;
    polar.push_back({std::atan2(p.y(), p.x()), std::atan2(p.z(), std::hypot(p.x(), p.y())), range});
  }
  return polar;
}

std::vector<double> BeamsFromOrder(std::span<const PolarScan> scans) {
  std::vector<double> ahead = OrderedBeams(scans, 0.0);
  std::vector<double> behind = OrderedBeams(scans, kPi);
  // A seam in the middle of the turns makes one more of them.
  const bool take_behind = ahead.empty() || (!behind.empty() && behind.size() < ahead.size());
  return take_behind ? behind : ahead;
}

std::vector<double> BeamsFromElevations(std::span<const PolarScan> scans) {
  const Histogram histogram = HistogramOf(scans);
  for (const int radius : kSmoothingRadii) {
    const Histogram smooth = Smooth(histogram, radius);
    std::vector<double> peaks = StrongPeaks(FindPeaks(smooth), smooth);
    if (peaks.size() < kFewestBeams || peaks.size() > kMostBeams) continue;
    if (!PointsGather(histogram, peaks)) continue;
    for (double& peak : peaks) peak = Centre(histogram, peak, 2.0 * radius);
    std::reverse(peaks.begin(), peaks.end());
    for (double& peak : peaks) peak = (peak + 0.5) * kBin_rad - 0.5 * kPi;
    if (IsStrictlyDecreasing(peaks)) return peaks;
  }
  return {};
}

double Quantile(std::vector<double> values, double fraction) {
  const auto last = static_cast<double>(values.size() - 1);
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::round(fraction * last));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace covsplat
