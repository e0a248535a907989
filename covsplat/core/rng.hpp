// Rng: small, seeded random numbers that are the same with every standard library.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace covsplat {

/// SplitMix64 sequence (Steele, Lea, Flood 2014). Cheap to seed: one generator per item and seed
/// gives streams that do not depend on the order of evaluation.
class Rng {
 public:
  explicit Rng(std::uint64_t seed, std::uint64_t stream = 0)
      : state_(Mix(seed + 0x9E3779B97F4A7C15ULL * (stream + 1))) {}

  std::uint64_t NextU64() { return Mix(state_ += 0x9E3779B97F4A7C15ULL); }

  /// Uniform in [0, 1).
  double Uniform() { return static_cast<double>(NextU64() >> 11) * 0x1.0p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }

  /// Uniform in {0, ..., n - 1}; n > 0.
  std::uint64_t Below(std::uint64_t n) { return NextU64() % n; }

  /// Standard normal (Box-Muller, one of the pair).
  double Normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform());
  }

 private:
  static std::uint64_t Mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

}  // namespace covsplat
