#include "covsplat/registration/step_stretch.hpp"

#include <algorithm>

namespace covsplat {
namespace {

constexpr double kStraight = 0.95;  // cosine between steps in one direction
constexpr double kGrowth = 2.0;
constexpr double kLongest = 8.0;

// Metres that points at a usual distance move.
Vector18d InMetres(const Vector18d& step) {
  constexpr double kLever_m = 4.0;
  Vector18d moved = step;
  for (int block = 0; block < 18; block += 6) moved.segment<3>(block) *= kLever_m;
  return moved;
}

}  // namespace

double StepStretch::Of(const Vector18d& step) {
  const Vector18d now = InMetres(step);
  const double along = now.dot(last_);
  if (along <= kStraight * now.norm() * last_.norm()) {
    stretch_ = 1.0;
  } else {
    const double remains = along / last_.squaredNorm();
    const double most = std::min(kGrowth * stretch_, kLongest);
    stretch_ = remains < 1.0 ? std::clamp(stretch_ / (1.0 - remains), 1.0, most) : most;
  }
  last_ = now;
  return stretch_;
}

void StepStretch::Forget() { *this = {}; }

}  // namespace covsplat
