// From the parameters of a Gaussian to what a view sees of it.
#pragma once

#include <math_constants.h>

#include "covsplat/splat/cuda/device_math.cuh"

namespace covsplat::cuda {

/// A Gaussian in the sensor frame.
struct Surfel {
  float3 centre, axis_u, axis_v, normal;
  float scale_u, scale_v, opacity;
};

__device__ inline Surfel LoadSurfel(const DeviceTable& gaussians,
                                    std::size_t row,
                                    const AnchorTransform<float>& T_sensor_anchor) {
  float w = At(gaussians, kQuatW, row);
  float x = At(gaussians, kQuatX, row);
  float y = At(gaussians, kQuatY, row);
  float z = At(gaussians, kQuatZ, row);
  const float inverse = 1.0f / sqrtf(fmaxf(w * w + x * x + y * y + z * z, 1e-20f));
  w *= inverse;
  x *= inverse;
  y *= inverse;
  z *= inverse;
  const float* rotation = T_sensor_anchor.rotation;
  Surfel s;
  s.axis_u = Rotate(
      rotation, {1.0f - 2.0f * (y * y + z * z), 2.0f * (x * y + w * z), 2.0f * (x * z - w * y)});
  s.axis_v = Rotate(
      rotation, {2.0f * (x * y - w * z), 1.0f - 2.0f * (x * x + z * z), 2.0f * (y * z + w * x)});
  s.normal = Cross(s.axis_u, s.axis_v);
  s.centre =
      Rotate(rotation,
             {At(gaussians, kMeanX, row), At(gaussians, kMeanY, row), At(gaussians, kMeanZ, row)}) +
      Vector(T_sensor_anchor.translation);
  s.scale_u = expf(At(gaussians, kLogScaleU, row));
  s.scale_v = expf(At(gaussians, kLogScaleV, row));
  s.opacity = 1.0f / (1.0f + expf(-At(gaussians, kOpacityLogit, row)));
  return s;
}

__device__ inline float RowOf(const DeviceView& view, float elevation) {
  const float last = static_cast<float>(view.row_table_size - 1) * 0.9999999f;
  const float position = fminf(
      fmaxf((elevation - view.row_table_origin_rad) * view.row_table_samples_per_rad, 0.0f), last);
  const int index = static_cast<int>(position);
  const float low = view.row_table[index];
  const float high = view.row_table[index + 1];
  return low + (position - static_cast<float>(index)) * (high - low);
}

/// The record of a surfel; opacity 0 if the view cannot see it.
__device__ inline SurfelRecord<float> RecordOf(const DeviceView& view, const Surfel& s) {
  float3 normal = s.normal;
  float plane = Dot(normal, s.centre);
  const float range = sqrtf(Dot(s.centre, s.centre));
  bool visible = range > view.near_m && range < view.far_m && s.opacity > view.alpha_min &&
                 fabsf(plane) > 1e-6f;
  if (view.two_sided) {
    const float sign = plane > 0.0f ? -1.0f : 1.0f;
    normal = sign * normal;
    plane = sign * plane;
  } else {
    visible = visible && plane < 0.0f;
  }
  const float3 u = (1.0f / s.scale_u) * s.axis_u;
  const float3 v = (1.0f / s.scale_v) * s.axis_v;
  const float horizontal = sqrtf(s.centre.x * s.centre.x + s.centre.y * s.centre.y);
  const float columns = static_cast<float>(view.columns);
  const float azimuth = atan2f(s.centre.y, s.centre.x);
  return {{u.x, u.y, u.z},
          {v.x, v.y, v.z},
          {normal.x, normal.y, normal.z},
          plane,
          Dot(u, s.centre),
          Dot(v, s.centre),
          visible ? s.opacity : 0.0f,
          0.5f * columns - azimuth * (columns / (2.0f * CUDART_PI_F)),
          RowOf(view, atan2f(s.centre.z, horizontal)),
          range};
}

}  // namespace covsplat::cuda
