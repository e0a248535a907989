// Names of the columns in which Gaussians and the optimiser's memory are stored.
#pragma once

#include <cstddef>

namespace covsplat {

/// Optimised parameters of a Gaussian. Its in-plane axes and normal are the columns of the rotation
/// matrix of the unit quaternion; the standard deviations along the axes are exp(log scale) metres;
/// its opacity is the logistic function of the logit. Mean and orientation are in the frame of the
/// Gaussian's anchor (its keyframe).
enum Parameter : int {
  kMeanX,
  kMeanY,
  kMeanZ,
  kQuatW,
  kQuatX,
  kQuatY,
  kQuatZ,
  kLogScaleU,
  kLogScaleV,
  kOpacityLogit,
  kParameterCount
};

/// Directions in which a Gaussian is optimised: mean in its anchor's frame, rotation vector in its
/// own frame (q <- q * exp(delta)), log scales, opacity logit.
enum Tangent : int {
  kTangentMean = 0,
  kTangentRotation = 3,
  kTangentLogScaleU = 6,
  kTangentLogScaleV = 7,
  kTangentOpacityLogit = 8,
  kTangentCount = 9
};

/// Adam's memory: first moments of the tangent, one second moment per vector, and the powers of
/// beta1 and beta2 that undo the start from zero (each Gaussian counts its own steps). Beside it,
/// how far the log scales are from where they started.
enum MomentColumn : int {
  kFirstMoment = 0,
  kSecondMean = kTangentCount,
  kSecondRotation,
  kSecondLogScaleU,
  kSecondLogScaleV,
  kSecondOpacity,
  kBeta1Power,
  kBeta2Power,
  kGrowthU,
  kGrowthV,
  kMomentCount
};

/// Value of a column before the first step.
constexpr float FreshMoment(int column) {
  return column == kBeta1Power || column == kBeta2Power ? 1.0f : 0.0f;
}

/// The rasteriser works on blocks of this many consecutive Gaussians and reads whole blocks.
inline constexpr std::size_t kBlockSize = 16;

}  // namespace covsplat
