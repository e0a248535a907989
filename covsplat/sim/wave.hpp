// Wave: a sinusoid in time, for what shakes and sways.
#pragma once

#include <cmath>
#include <numbers>

#include "covsplat/core/rng.hpp"

namespace covsplat {

struct Wave {
  double amplitude = 0.0;
  double frequency_hz = 0.0;
  double phase = 0.0;

  double At(double time_s) const {
    return amplitude * std::sin(2.0 * std::numbers::pi * frequency_hz * time_s + phase);
  }
};

inline Wave WaveOfAnyPhase(double amplitude, double frequency_hz, Rng& rng) {
  return {amplitude, frequency_hz, rng.Uniform(0.0, 2.0 * std::numbers::pi)};
}

}  // namespace covsplat
