#include "covsplat/registration/match_sums.hpp"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "covsplat/registration/match_sums.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "covsplat/core/simd16-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace covsplat::HWY_NAMESPACE {
namespace {

/// Cosine of the angle between the normals of the two sides of a wall, and less.
constexpr float kOpposite = -0.9f;

using Floats = Pack<float>;
using Vectors = Pack3<float>;

/// Symmetric 3x3 matrices.
struct Symmetric {
  Floats xx, xy, xz, yy, yz, zz;
};

HWY_INLINE Vectors operator-(const Vectors& a, const Vectors& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

HWY_INLINE Vectors operator*(const Symmetric& m, const Vectors& v) {
  return {Dot(Vectors{m.xx, m.xy, m.xz}, v),
          Dot(Vectors{m.xy, m.yy, m.yz}, v),
          Dot(Vectors{m.xz, m.yz, m.zz}, v)};
}

/// Rows of 16 numbers as columns of 16 rows.
class Fields {
 public:
  HWY_INLINE explicit Fields(const float* rows) { Transpose16(rows, by_field_); }

  HWY_INLINE Floats At(std::size_t field) const { return LoadPack(by_field_ + 16 * field); }
  HWY_INLINE Vectors VectorAt(std::size_t field) const {
    return {At(field), At(field + 1), At(field + 2)};
  }
  HWY_INLINE Symmetric SymmetricAt(std::size_t field) const {
    return {At(field), At(field + 1), At(field + 2), At(field + 3), At(field + 4), At(field + 5)};
  }

 private:
  alignas(64) float by_field_[256];
};

/// Rotations, by columns.
struct Rotation {
  Vectors x, y, z;

  HWY_INLINE Vectors operator*(const Vectors& v) const {
    return MulAdd(v.x, x, MulAdd(v.y, y, v.z * z));
  }
};

/// a + R m R^T.
HWY_INLINE Symmetric AddRotated(const Symmetric& a, const Rotation& R, const Symmetric& m) {
  // Rows of R m.
  const auto row = [&](const Floats& x, const Floats& y, const Floats& z) HWY_ATTR {
    return m * Vectors{x, y, z};
  };
  const Vectors row0 = row(R.x.x, R.y.x, R.z.x);
  const Vectors row1 = row(R.x.y, R.y.y, R.z.y);
  const Vectors row2 = row(R.x.z, R.y.z, R.z.z);
  const Vectors r0{R.x.x, R.y.x, R.z.x};
  const Vectors r1{R.x.y, R.y.y, R.z.y};
  const Vectors r2{R.x.z, R.y.z, R.z.z};
  return {a.xx + Dot(row0, r0),
          a.xy + Dot(row0, r1),
          a.xz + Dot(row0, r2),
          a.yy + Dot(row1, r1),
          a.yz + Dot(row1, r2),
          a.zz + Dot(row2, r2)};
}

/// By cofactors.
HWY_INLINE Symmetric Inverse(const Symmetric& c) {
  const Floats xx = NegMulAdd(c.yz, c.yz, c.yy * c.zz);
  const Floats xy = NegMulAdd(c.xy, c.zz, c.xz * c.yz);
  const Floats xz = NegMulAdd(c.xz, c.yy, c.xy * c.yz);
  const Floats yy = NegMulAdd(c.xz, c.xz, c.xx * c.zz);
  const Floats yz = NegMulAdd(c.xx, c.yz, c.xy * c.xz);
  const Floats zz = NegMulAdd(c.xy, c.xy, c.xx * c.yy);
  const Floats inverse = All(1.0f) / MulAdd(c.xx, xx, MulAdd(c.xy, xy, c.xz * xz));
  return {inverse * xx, inverse * xy, inverse * xz, inverse * yy, inverse * yz, inverse * zz};
}

HWY_INLINE void AddTo(MatchSums::Lanes& sum, const Floats& more) {
  StorePack(LoadPack(sum.data()) + more, sum.data());
}

/// J^T M J (upper triangle by rows) and J^T M e for e = mean - (lever + omega x lever + v): with
/// G = Skew(lever), J = [G, -I] and J^T M J = [G^T M G, -G^T M; ., M].
HWY_INLINE void FindTerms(const Vectors& lever,
                          const Symmetric& m,
                          const Vectors& m_e,
                          Floats (&terms)[MatchSums::kTerms]) {
  // Columns of -G^T M = Skew(lever) M.
  const Vectors gm0 = Cross(lever, Vectors{m.xx, m.xy, m.xz});
  const Vectors gm1 = Cross(lever, Vectors{m.xy, m.yy, m.yz});
  const Vectors gm2 = Cross(lever, Vectors{m.xz, m.yz, m.zz});
  // Rows of G^T M G: those of Skew(lever) M crossed with the lever.
  const Vectors gmg0 = Cross(lever, Vectors{gm0.x, gm1.x, gm2.x});
  const Vectors gmg1 = Cross(lever, Vectors{gm0.y, gm1.y, gm2.y});
  const Vectors gmg2 = Cross(lever, Vectors{gm0.z, gm1.z, gm2.z});
  const Vectors torque = Cross(m_e, lever);
  const Floats all[MatchSums::kTerms] = {gmg0.x,   gmg0.y,   gmg0.z,   gm0.x,  gm1.x,  gm2.x,  //
                                         gmg1.y,   gmg1.z,   gm0.y,    gm1.y,  gm2.y,          //
                                         gmg2.z,   gm0.z,    gm1.z,    gm2.z,                  //
                                         m.xx,     m.xy,     m.xz,     m.yy,   m.yz,   m.zz,   //
                                         torque.x, torque.y, torque.z, -m_e.x, -m_e.y, -m_e.z};
  for (int k = 0; k < MatchSums::kTerms; ++k) terms[k] = all[k];
}

HWY_INLINE void AddMoments(const Floats (&terms)[MatchSums::kTerms],
                           const Floats& weight,
                           const Floats& phase,
                           MatchSums& sums) {
  Floats power = weight;
  for (auto& moment : sums.moment) {
    for (std::size_t k = 0; k < MatchSums::kTerms; ++k) {
      StorePack(MulAdd(power, terms[k], LoadPack(moment[k].data())), moment[k].data());
    }
    power = power * phase;
  }
}

HWY_INLINE void AddLever(const Vectors& lever, const Floats& weight, MatchSums& sums) {
  const Vectors l = weight * lever;
  const Floats terms[MatchSums::kLeverTerms] = {weight,
                                                l.x,
                                                l.y,
                                                l.z,
                                                l.x * lever.x,
                                                l.x * lever.y,
                                                l.x * lever.z,
                                                l.y * lever.y,
                                                l.y * lever.z,
                                                l.z * lever.z};
  for (std::size_t k = 0; k < MatchSums::kLeverTerms; ++k) AddTo(sums.lever[k], terms[k]);
}

void SumAll(const MatchBatch& batch,
            const MatchSettings& settings,
            MatchSums& sums,
            MatchSums::Lanes& mahalanobis) {
  alignas(64) static constexpr float kLane[16] = {
      0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const Floats zero = All(0.0f);
  const Floats one = All(1.0f);
  const Fields source(batch.Sources());
  const Fields surfel(batch.Surfels());
  const Fields pose(batch.Poses());
  const Rotation R{pose.VectorAt(0), pose.VectorAt(4), pose.VectorAt(8)};

  const Vectors normal = surfel.VectorAt(3);
  auto is_match = LoadPack(kLane) < All(static_cast<float>(batch.Size()));
  if (settings.same_side) {
    is_match = is_match & (Dot(R * source.VectorAt(10), normal) > All(kOpposite));
  }
  const Vectors sensor{
      All(settings.sensor.x()), All(settings.sensor.y()), All(settings.sensor.z())};
  const Vectors lever = R * source.VectorAt(0) + pose.VectorAt(12);
  const Vectors e = surfel.VectorAt(0) - (lever + sensor);
  const Symmetric m = Inverse(AddRotated(surfel.SymmetricAt(6), R, source.SymmetricAt(4)));
  const Vectors m_e = m * e;
  const Floats square = Max(Dot(e, m_e), zero);
  const Floats infinity = All(std::numeric_limits<float>::infinity());
  StorePack(Select(is_match, square, infinity), mahalanobis.data());

  const Floats kernel =
      SelectOrZero(is_match, one / MulAdd(square, All(settings.inverse_kernel_scale), one));
  const Floats weight = kernel * surfel.At(12);
  const Floats plane = Dot(normal, e);
  Floats terms[MatchSums::kTerms];
  FindTerms(lever, m, m_e, terms);
  AddMoments(terms, weight, source.At(3), sums);
  AddLever(lever, weight * (m.xx + m.yy + m.zz), sums);
  AddTo(sums.weighted_square, weight * square);
  AddTo(sums.kernel_sum, kernel);
  AddTo(sums.kernel_square_sum, kernel * kernel);
  AddTo(sums.plane_square, kernel * kernel * plane * plane);
  AddTo(sums.matches, SelectOrZero(is_match, one));
  const auto is_inlier = is_match & (Abs(plane) < All(settings.inlier_distance_m));
  AddTo(sums.inliers, SelectOrZero(is_inlier, one));
}

}  // namespace
}  // namespace covsplat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace covsplat {

HWY_EXPORT(SumAll);

void SumMatches(const MatchBatch& batch,
                const MatchSettings& settings,
                MatchSums& sums,
                MatchSums::Lanes& mahalanobis) {
  HWY_DYNAMIC_DISPATCH(SumAll)(batch, settings, sums, mahalanobis);
}

}  // namespace covsplat
#endif  // HWY_ONCE
