#include "covsplat/splat/cpu/project.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "covsplat/splat/cpu/project.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "covsplat/core/simd16-inl.hpp"

#ifndef COVSPLAT_SPLAT_CPU_PROJECT_ONCE
#define COVSPLAT_SPLAT_CPU_PROJECT_ONCE
namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kRecordFields = 16;

/// Half the extent of a Gaussian's footprint around its centre, before it becomes tiles.
template <class S>
struct Footprints {
  alignas(64) S half_columns[16];
  alignas(64) S top_row[16];
  alignas(64) S bottom_row[16];
  alignas(64) S radius_m[16];   ///< bounding sphere, for Gaussians above or around the sensor
  alignas(64) S nearest_m[16];  ///< least horizontal distance; not positive: use the sphere
  alignas(64) S elevation[16];
};

int FloorDivide(int value, int divisor) {
  return value >= 0 ? value / divisor : -((divisor - 1 - value) / divisor);
}

/// Extends a footprint that contains or nearly contains the vertical axis by its bounding sphere.
template <class S>
void BoundBySphere(const ViewGeometry<S>& view, S range, Footprints<S>& f, int lane) {
  f.half_columns[lane] = static_cast<S>(view.columns);
  const S sine = f.radius_m[lane] / range;
  if (sine >= S(1)) {
    f.top_row[lane] = S(0);
    f.bottom_row[lane] = static_cast<S>(view.rows);
    return;
  }
  const auto row_of = [&](double elevation) {
    const double position = (elevation - static_cast<double>(view.row_table_origin_rad)) *
                            static_cast<double>(view.row_table_samples_per_rad);
    const double last = static_cast<double>(view.row_table.size() - 1);
    return view.row_table[static_cast<std::size_t>(std::clamp(position, 0.0, last))];
  };
  const double half = std::asin(static_cast<double>(sine));
  f.top_row[lane] = std::min(f.top_row[lane], row_of(f.elevation[lane] + half) - S(1));
  f.bottom_row[lane] = std::max(f.bottom_row[lane], row_of(f.elevation[lane] - half) + S(1));
}

template <class S>
TileBox BoxOf(const ViewGeometry<S>& view,
              const SurfelRecord<S>& record,
              const Footprints<S>& f,
              int lane) {
  constexpr S kPadding = S(kFootprintPaddingPx);
  const S half = f.half_columns[lane] + kPadding;
  const S row0 = f.top_row[lane] - kPadding;
  const S row1 = f.bottom_row[lane] + kPadding;
  if (!(row1 > S(0)) || !(row0 < static_cast<S>(view.rows))) return {};
  const int y0 = std::max(0, static_cast<int>(std::ceil(std::max(row0, S(0)) - S(0.5))));
  const int y1 =
      std::min(view.rows - 1,
               static_cast<int>(std::floor(std::min(row1, static_cast<S>(view.rows)) - S(0.5))));
  TileBox box;
  if (S(2) * half >= static_cast<S>(view.columns - 2 * kTileSide)) {
    box.x0 = 0;
    box.x1 = static_cast<std::int16_t>(view.tile_columns - 1);
  } else {
    const int x0 = static_cast<int>(std::ceil(record.column - half - S(0.5)));
    const int x1 = static_cast<int>(std::floor(record.column + half - S(0.5)));
    if (x1 < x0) return {};
    box.x0 = static_cast<std::int16_t>(FloorDivide(x0, kTileSide));
    box.x1 = static_cast<std::int16_t>(FloorDivide(x1, kTileSide));
  }
  if (y1 < y0) return {};
  box.y0 = static_cast<std::int16_t>(y0 / kTileSide);
  box.y1 = static_cast<std::int16_t>(y1 / kTileSide);
  return box;
}

}  // namespace
}  // namespace covsplat
#endif  // COVSPLAT_SPLAT_CPU_PROJECT_ONCE

HWY_BEFORE_NAMESPACE();
namespace covsplat::HWY_NAMESPACE {
namespace {

template <class S>
HWY_INLINE Pack3<S> Rotate(const S* rotation, const Pack3<S>& a) {
  const Pack3<S> row0{All(rotation[0]), All(rotation[1]), All(rotation[2])};
  const Pack3<S> row1{All(rotation[3]), All(rotation[4]), All(rotation[5])};
  const Pack3<S> row2{All(rotation[6]), All(rotation[7]), All(rotation[8])};
  return {Dot(row0, a), Dot(row1, a), Dot(row2, a)};
}

/// 16 Gaussians in the sensor frame.
template <class S>
struct Surfels {
  Pack3<S> centre, axis_u, axis_v, normal;
  Pack<S> scale_u, scale_v, opacity;
};

template <class S>
HWY_INLINE Surfels<S> LoadSurfels(const ProjectJob<S>& job, const GaussianBlock& block) {
  const auto column = [&](Parameter p) { return job.gaussians->Column(p) + block.begin; };
  const AnchorTransform<S>& transform = job.transforms[block.transform];
  Pack<S> w = LoadPack(column(kQuatW));
  Pack<S> x = LoadPack(column(kQuatX));
  Pack<S> y = LoadPack(column(kQuatY));
  Pack<S> z = LoadPack(column(kQuatZ));
  const Pack<S> one = All(S(1));
  const Pack<S> two = All(S(2));
  const Pack<S> norm = MulAdd(w, w, MulAdd(x, x, MulAdd(y, y, z * z)));
  const Pack<S> inverse = one / Sqrt(Max(norm, All(S(1e-20))));
  w = w * inverse;
  x = x * inverse;
  y = y * inverse;
  z = z * inverse;
  Surfels<S> s;
  s.axis_u =
      Rotate(transform.rotation,
             Pack3<S>{one - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)});
  s.axis_v =
      Rotate(transform.rotation,
             Pack3<S>{two * (x * y - w * z), one - two * (x * x + z * z), two * (y * z + w * x)});
  s.normal = Cross(s.axis_u, s.axis_v);
  const Pack3<S> mean{LoadPack(column(kMeanX)), LoadPack(column(kMeanY)), LoadPack(column(kMeanZ))};
  s.centre = Rotate(transform.rotation, mean) + Pack3<S>{All(transform.translation[0]),
                                                         All(transform.translation[1]),
                                                         All(transform.translation[2])};
  s.scale_u = ExpBounded(LoadPack(column(kLogScaleU)));
  s.scale_v = ExpBounded(LoadPack(column(kLogScaleV)));
  s.opacity = one / (one + ExpBounded(-LoadPack(column(kOpacityLogit))));
  return s;
}

template <class S>
HWY_INLINE Pack<S> RowOf(const ViewGeometry<S>& view, const Pack<S>& elevation) {
  Pack<S> slope;
  const Pack<S> position =
      (elevation - All(view.row_table_origin_rad)) * All(view.row_table_samples_per_rad);
  const S last = static_cast<S>(view.row_table.size() - 1) * S(0.9999999);
  return LookUp(view.row_table.data(), Max(Min(position, All(last)), All(S(0))), slope);
}

/// Bound of {c + a s_u r_u + b s_v r_v : a^2 + b^2 <= reach^2} by its support function along the
/// horizontal, tangential and vertical directions at the centre, united with the disc of the
/// screen-space filter.
template <class S>
HWY_INLINE void FindFootprints(const ViewGeometry<S>& view,
                               const Surfels<S>& s,
                               const Pack<S>& row,
                               Footprints<S>& out) {
  const Pack<S> zero = All(S(0));
  const Pack<S> horizontal = Sqrt(s.centre.x * s.centre.x + s.centre.y * s.centre.y);
  const Pack<S> inverse = All(S(1)) / Max(horizontal, All(S(1e-12)));
  const Pack<S> ratio = Max(s.opacity / All(view.alpha_min), All(S(1)));
  const Pack<S> reach = Sqrt(All(S(2)) * Log(ratio));
  const Pack<S> cos_az = s.centre.x * inverse;
  const Pack<S> sin_az = s.centre.y * inverse;
  const Pack<S> u_h = s.scale_u * (cos_az * s.axis_u.x + sin_az * s.axis_u.y);
  const Pack<S> v_h = s.scale_v * (cos_az * s.axis_v.x + sin_az * s.axis_v.y);
  const Pack<S> u_a = s.scale_u * (cos_az * s.axis_u.y - sin_az * s.axis_u.x);
  const Pack<S> v_a = s.scale_v * (cos_az * s.axis_v.y - sin_az * s.axis_v.x);
  const Pack<S> u_z = s.scale_u * s.axis_u.z;
  const Pack<S> v_z = s.scale_v * s.axis_v.z;
  const Pack<S> support_h = reach * Sqrt(u_h * u_h + v_h * v_h);
  const Pack<S> support_a = reach * Sqrt(u_a * u_a + v_a * v_a);
  const Pack<S> support_z = reach * Sqrt(u_z * u_z + v_z * v_z);
  const Pack<S> h_low = horizontal - support_h;
  const Pack<S> far_h = horizontal + support_h;
  const Pack<S> h_high = Sqrt(far_h * far_h + support_a * support_a);
  const Pack<S> z_high = s.centre.z + support_z;
  const Pack<S> z_low = s.centre.z - support_z;
  const Pack<S> near_h = Max(h_low, All(S(1e-6)));
  const Pack<S> half_azimuth = Atan2(support_a, near_h);
  const Pack<S> el_high = Atan2(z_high, Select(z_high > zero, near_h, h_high));
  const Pack<S> el_low = Atan2(z_low, Select(z_low < zero, near_h, h_high));
  const Pack<S> filter = reach / Sqrt(All(view.lowpass));
  const S columns_per_rad = static_cast<S>(view.columns / (2.0 * kPi));
  StorePack(Max(half_azimuth * All(columns_per_rad), filter), out.half_columns);
  StorePack(Min(RowOf(view, el_high), row - filter), out.top_row);
  StorePack(Max(RowOf(view, el_low), row + filter), out.bottom_row);
  StorePack(reach * Max(s.scale_u, s.scale_v), out.radius_m);
  StorePack(h_low, out.nearest_m);
  StorePack(Atan2(s.centre.z, horizontal), out.elevation);
}

template <class S>
HWY_INLINE void StoreRecords(const Pack<S> (&fields)[16], SurfelRecord<S>* records) {
  alignas(64) S by_field[16 * kRecordFields];
  for (std::size_t k = 0; k < 16; ++k) StorePack(fields[k], by_field + 16 * k);
  Transpose16(by_field, records->u);
}

template <class S>
HWY_INLINE void ProjectBlock(const ProjectJob<S>& job, std::uint32_t number) {
  const GaussianBlock& block = job.blocks[number];
  const ViewGeometry<S>& view = *job.view;
  Surfels<S> s = LoadSurfels(job, block);
  const Pack<S> zero = All(S(0));
  Pack<S> plane = Dot(s.normal, s.centre);
  const Pack<S> range = Sqrt(Dot(s.centre, s.centre));
  auto visible = (range > All(view.near_m)) & (range < All(view.far_m)) &
                 (s.opacity > All(view.alpha_min)) & (Abs(plane) > All(S(1e-6)));
  if (view.two_sided) {
    const Pack<S> sign = Select(plane > zero, All(S(-1)), All(S(1)));
    s.normal = sign * s.normal;
    plane = sign * plane;
  } else {
    visible = visible & (plane < zero);
  }
  const Pack<S> horizontal = Sqrt(s.centre.x * s.centre.x + s.centre.y * s.centre.y);
  const Pack<S> azimuth = Atan2(s.centre.y, s.centre.x);
  const Pack<S> half_turn = All(static_cast<S>(0.5 * view.columns));
  const Pack<S> column =
      NegMulAdd(azimuth, All(static_cast<S>(view.columns / (2.0 * kPi))), half_turn);
  const Pack<S> row = RowOf(view, Atan2(s.centre.z, horizontal));
  const Pack3<S> u = (All(S(1)) / s.scale_u) * s.axis_u;
  const Pack3<S> v = (All(S(1)) / s.scale_v) * s.axis_v;
  // What a ray may add with weight zero must be finite, whatever the parameters are.
  const Pack<S> fields[16] = {u.x,
                              u.y,
                              u.z,
                              v.x,
                              v.y,
                              v.z,
                              SelectOrZero(visible, s.normal.x),
                              SelectOrZero(visible, s.normal.y),
                              SelectOrZero(visible, s.normal.z),
                              plane,
                              Dot(u, s.centre),
                              Dot(v, s.centre),
                              SelectOrZero(visible, s.opacity),
                              column,
                              row,
                              SelectOrZero(visible, range)};
  SurfelRecord<S>* records = job.records + 16 * number;
  StoreRecords(fields, records);
  if (job.boxes == nullptr) return;
  Footprints<S> footprints;
  FindFootprints(view, s, row, footprints);
  TileBox* boxes = job.boxes + 16 * number;
  for (int lane = 0; lane < 16; ++lane) {
    boxes[lane] = {};
    if (lane >= block.count || !(records[lane].opacity > S(0))) continue;
    if (!(footprints.nearest_m[lane] > S(1e-6))) {
      BoundBySphere(view, records[lane].range, footprints, lane);
    }
    boxes[lane] = BoxOf(view, records[lane], footprints, lane);
  }
}

void ProjectFloat(const ProjectJob<float>& job, std::span<const std::uint32_t> numbers) {
  for (const std::uint32_t number : numbers) ProjectBlock(job, number);
}

void ProjectDouble(const ProjectJob<double>& job, std::span<const std::uint32_t> numbers) {
  for (const std::uint32_t number : numbers) ProjectBlock(job, number);
}

}  // namespace
}  // namespace covsplat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace covsplat {

HWY_EXPORT(ProjectFloat);
HWY_EXPORT(ProjectDouble);

template <>
void ProjectBlocks<float>(const ProjectJob<float>& job, std::span<const std::uint32_t> numbers) {
  HWY_DYNAMIC_DISPATCH(ProjectFloat)(job, numbers);
}

template <>
void ProjectBlocks<double>(const ProjectJob<double>& job, std::span<const std::uint32_t> numbers) {
  HWY_DYNAMIC_DISPATCH(ProjectDouble)(job, numbers);
}

}  // namespace covsplat
#endif  // HWY_ONCE
