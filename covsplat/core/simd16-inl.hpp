// Packs of 16 scalars, one for each pixel of a 4x4 tile, Gaussian of a block or match of a batch,
// in as many vectors as the instruction set needs. Included once per target, as Highway's own -inl
// headers are.

// clang-format off
#if defined(COVSPLAT_CORE_SIMD16_INL_HPP_) == defined(HWY_TARGET_TOGGLE)
#ifdef COVSPLAT_CORE_SIMD16_INL_HPP_
#undef COVSPLAT_CORE_SIMD16_INL_HPP_
#else
#define COVSPLAT_CORE_SIMD16_INL_HPP_
#endif
// clang-format on

#include <cstddef>

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace covsplat::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class S>
using Tag = hn::CappedTag<S, 16>;

template <class S>
inline constexpr std::size_t kLanes = hn::MaxLanes(Tag<S>());

template <class S>
inline constexpr std::size_t kParts = 16 / kLanes<S>;

/// kCount packs side by side take the same operations: their chains of dependent instructions
/// interleave, which keeps the processor busy where one chain would make it wait.
template <class S, std::size_t kCount = 1>
struct Pack {
  hn::Vec<Tag<S>> part[kCount * kParts<S>];
};

template <class S, std::size_t kCount = 1>
struct PackMask {
  hn::Mask<Tag<S>> part[kCount * kParts<S>];
};

// Element-wise operations. Macros only because each is the same loop around one Highway call.
#define COVSPLAT_PACK_BINARY(NAME, OP)                                                  \
  template <class S, std::size_t kCount>                                                \
  HWY_INLINE Pack<S, kCount> NAME(const Pack<S, kCount>& a, const Pack<S, kCount>& b) { \
    Pack<S, kCount> r;                                                                  \
    for (std::size_t i = 0; i < kCount * kParts<S>; ++i) {                              \
      r.part[i] = hn::OP(a.part[i], b.part[i]);                                         \
    }                                                                                   \
    return r;                                                                           \
  }
COVSPLAT_PACK_BINARY(operator+, Add)
COVSPLAT_PACK_BINARY(operator-, Sub)
COVSPLAT_PACK_BINARY(operator*, Mul)
COVSPLAT_PACK_BINARY(operator/, Div)
COVSPLAT_PACK_BINARY(Min, Min)
COVSPLAT_PACK_BINARY(Max, Max)
COVSPLAT_PACK_BINARY(CopySign, CopySign)
#undef COVSPLAT_PACK_BINARY

#define COVSPLAT_PACK_UNARY(NAME, OP)                         \
  template <class S, std::size_t kCount>                      \
  HWY_INLINE Pack<S, kCount> NAME(const Pack<S, kCount>& a) { \
    Pack<S, kCount> r;                                        \
    for (std::size_t i = 0; i < kCount * kParts<S>; ++i) {    \
      r.part[i] = hn::OP(a.part[i]);                          \
    }                                                         \
    return r;                                                 \
  }
COVSPLAT_PACK_UNARY(operator-, Neg)
COVSPLAT_PACK_UNARY(Abs, Abs)
COVSPLAT_PACK_UNARY(Sqrt, Sqrt)
#undef COVSPLAT_PACK_UNARY

#define COVSPLAT_PACK_COMPARE(NAME, OP)                                                     \
  template <class S, std::size_t kCount>                                                    \
  HWY_INLINE PackMask<S, kCount> NAME(const Pack<S, kCount>& a, const Pack<S, kCount>& b) { \
    PackMask<S, kCount> r;                                                                  \
    for (std::size_t i = 0; i < kCount * kParts<S>; ++i) {                                  \
      r.part[i] = hn::OP(a.part[i], b.part[i]);                                             \
    }                                                                                       \
    return r;                                                                               \
  }
COVSPLAT_PACK_COMPARE(operator<, Lt)
COVSPLAT_PACK_COMPARE(operator<=, Le)
COVSPLAT_PACK_COMPARE(operator>, Gt)
COVSPLAT_PACK_COMPARE(operator>=, Ge)
COVSPLAT_PACK_COMPARE(Equal, Eq)
#undef COVSPLAT_PACK_COMPARE

template <std::size_t kCount = 1, class S>
HWY_INLINE Pack<S, kCount> All(S value) {
  Pack<S, kCount> r;
  for (std::size_t i = 0; i < kCount * kParts<S>; ++i) r.part[i] = hn::Set(Tag<S>(), value);
  return r;
}

/// All lanes of pack i have value(i).
template <std::size_t kCount, class S, class Value>
HWY_INLINE Pack<S, kCount> AllOfEach(Value&& value) {
  Pack<S, kCount> r;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Pack<S> all = All(value(i));
    for (std::size_t j = 0; j < kParts<S>; ++j) r.part[i * kParts<S> + j] = all.part[j];
  }
  return r;
}

template <std::size_t kCount, class S>
HWY_INLINE Pack<S, kCount> Repeat(const Pack<S>& a) {
  Pack<S, kCount> r;
  for (std::size_t i = 0; i < kCount * kParts<S>; ++i) r.part[i] = a.part[i % kParts<S>];
  return r;
}

/// Pack i of kCount.
template <class S, std::size_t kCount>
HWY_INLINE Pack<S> Nth(const Pack<S, kCount>& a, std::size_t i) {
  Pack<S> r;
  for (std::size_t j = 0; j < kParts<S>; ++j) r.part[j] = a.part[i * kParts<S> + j];
  return r;
}

template <class S>
HWY_INLINE Pack<S> LoadPack(const S* HWY_RESTRICT from) {
  Pack<S> r;
  for (std::size_t i = 0; i < kParts<S>; ++i) r.part[i] = hn::LoadU(Tag<S>(), from + i * kLanes<S>);
  return r;
}

template <class S>
HWY_INLINE void StorePack(const Pack<S>& a, S* HWY_RESTRICT to) {
  for (std::size_t i = 0; i < kParts<S>; ++i) hn::StoreU(a.part[i], Tag<S>(), to + i * kLanes<S>);
}

/// Stores the lanes of a mask only.
template <class S>
HWY_INLINE void StoreMasked(const PackMask<S>& mask, const Pack<S>& a, S* HWY_RESTRICT to) {
  for (std::size_t i = 0; i < kParts<S>; ++i) {
    hn::BlendedStore(a.part[i], mask.part[i], Tag<S>(), to + i * kLanes<S>);
  }
}

#define COVSPLAT_PACK_TERNARY(NAME)                                                   \
  template <class S, std::size_t kCount>                                              \
  HWY_INLINE Pack<S, kCount> NAME(                                                    \
      const Pack<S, kCount>& a, const Pack<S, kCount>& b, const Pack<S, kCount>& c) { \
    Pack<S, kCount> r;                                                                \
    for (std::size_t i = 0; i < kCount * kParts<S>; ++i) {                            \
      r.part[i] = hn::NAME(a.part[i], b.part[i], c.part[i]);                          \
    }                                                                                 \
    return r;                                                                         \
  }
COVSPLAT_PACK_TERNARY(MulAdd)     // a * b + c
COVSPLAT_PACK_TERNARY(MulSub)     // a * b - c
COVSPLAT_PACK_TERNARY(NegMulAdd)  // c - a * b
#undef COVSPLAT_PACK_TERNARY

template <class S, std::size_t kCount>
HWY_INLINE PackMask<S, kCount> operator&(const PackMask<S, kCount>& a,
                                         const PackMask<S, kCount>& b) {
  PackMask<S, kCount> r;
  for (std::size_t i = 0; i < kCount * kParts<S>; ++i) r.part[i] = hn::And(a.part[i], b.part[i]);
  return r;
}

template <class S, std::size_t kCount>
HWY_INLINE Pack<S, kCount> Select(const PackMask<S, kCount>& mask,
                                  const Pack<S, kCount>& yes,
                                  const Pack<S, kCount>& no) {
  Pack<S, kCount> r;
  for (std::size_t i = 0; i < kCount * kParts<S>; ++i) {
    r.part[i] = hn::IfThenElse(mask.part[i], yes.part[i], no.part[i]);
  }
  return r;
}

template <class S, std::size_t kCount>
HWY_INLINE Pack<S, kCount> SelectOrZero(const PackMask<S, kCount>& mask,
                                        const Pack<S, kCount>& yes) {
  Pack<S, kCount> r;
  for (std::size_t i = 0; i < kCount * kParts<S>; ++i) {
    r.part[i] = hn::IfThenElseZero(mask.part[i], yes.part[i]);
  }
  return r;
}

template <class S>
HWY_INLINE bool None(const PackMask<S>& mask) {
  bool none = true;
  for (std::size_t i = 0; i < kParts<S>; ++i) none = none && hn::AllFalse(Tag<S>(), mask.part[i]);
  return none;
}

template <class S>
HWY_INLINE S SumOfLanes(const Pack<S>& a) {
  hn::Vec<Tag<S>> sum = a.part[0];
  for (std::size_t i = 1; i < kParts<S>; ++i) sum = hn::Add(sum, a.part[i]);
  return hn::GetLane(hn::SumOfLanes(Tag<S>(), sum));
}

/// 1 / a; in float one Newton step from the hardware's estimate, good to 1e-7.
template <class S, std::size_t kCount>
HWY_INLINE Pack<S, kCount> Reciprocal(const Pack<S, kCount>& a) {
  if constexpr (sizeof(S) == 4) {
    Pack<S, kCount> r;
    for (std::size_t i = 0; i < kCount * kParts<S>; ++i) {
      const auto estimate = hn::ApproximateReciprocal(a.part[i]);
      r.part[i] = hn::Mul(estimate, hn::NegMulAdd(estimate, a.part[i], hn::Set(Tag<S>(), S(2))));
    }
    return r;
  } else {
    return All<kCount>(S(1)) / a;
  }
}

/// 2^a for -126 <= a <= 127; float: polynomial on the fraction of a, 2e-7 relative.
template <class S, std::size_t kCount>
HWY_INLINE Pack<S, kCount> Exp2Bounded(const Pack<S, kCount>& a) {
  Pack<S, kCount> r;
  const Tag<S> d;
  for (std::size_t i = 0; i < kCount * kParts<S>; ++i) {
    if constexpr (sizeof(S) == 4) {
      const hn::RebindToSigned<Tag<S>> di;
      // Added to this number, which leaves no bits for fractions, a becomes a whole number, in
      // two's complement in the lowest bits: faster than to round and to convert.
      const auto shift = hn::Set(d, S(12582912));  // 1.5 * 2^23
      const auto shifted = hn::Add(a.part[i], shift);
      const auto f = hn::Sub(a.part[i], hn::Sub(shifted, shift));
      // Minimax for the relative error on [-1/2, 1/2], but exact at 0; pairs of terms, which do not
      // wait for each other as those of Horner's scheme do.
      const auto ff = hn::Mul(f, f);
      const auto p01 = hn::MulAdd(f, hn::Set(d, S(6.9314697e-1)), hn::Set(d, S(1)));
      const auto p23 = hn::MulAdd(f, hn::Set(d, S(5.5507133e-2)), hn::Set(d, S(2.4022120e-1)));
      const auto p45 = hn::MulAdd(f, hn::Set(d, S(1.3276472e-3)), hn::Set(d, S(9.6755413e-3)));
      const auto p = hn::MulAdd(hn::MulAdd(p45, ff, p23), ff, p01);
      const auto exponent = hn::ShiftLeft<23>(hn::BitCast(di, shifted));
      r.part[i] = hn::BitCast(d, hn::Add(hn::BitCast(di, p), exponent));
    } else {
      r.part[i] = hn::Exp(d, hn::Mul(a.part[i], hn::Set(d, S(0.69314718055994530942))));
    }
  }
  return r;
}

/// exp(a) for -87 <= a <= 88; float: 1e-6 relative at the ends, 2e-7 near 0.
template <class S, std::size_t kCount>
HWY_INLINE Pack<S, kCount> ExpBounded(const Pack<S, kCount>& a) {
  return Exp2Bounded(a * All<kCount>(S(1.44269504088896341)));
}

template <class S>
HWY_INLINE Pack<S> Log(const Pack<S>& a) {
  Pack<S> r;
  for (std::size_t i = 0; i < kParts<S>; ++i) r.part[i] = hn::Log(Tag<S>(), a.part[i]);
  return r;
}

template <class S>
HWY_INLINE Pack<S> Atan2(const Pack<S>& y, const Pack<S>& x) {
  Pack<S> r;
  const Tag<S> d;
  const auto half_pi = hn::Set(d, S(1.57079632679489661923));
  const auto pi = hn::Set(d, S(3.14159265358979323846));
  const auto tiny = hn::Set(d, S(1e-30));
  for (std::size_t i = 0; i < kParts<S>; ++i) {
    const auto ax = hn::Abs(x.part[i]);
    const auto ay = hn::Abs(y.part[i]);
    const auto steep = hn::Gt(ay, ax);
    const auto ratio = hn::Div(hn::Min(ax, ay), hn::Max(hn::Max(ax, ay), tiny));
    auto angle = hn::Atan(d, ratio);
    angle = hn::IfThenElse(steep, hn::Sub(half_pi, angle), angle);
    angle = hn::IfThenElse(hn::Lt(x.part[i], hn::Zero(d)), hn::Sub(pi, angle), angle);
    r.part[i] = hn::CopySign(angle, y.part[i]);
  }
  return r;
}

/// table[floor(position)] interpolated linearly; `slope` is the difference of the two entries.
/// position must be within [0, table size - 1).
template <class S>
HWY_INLINE Pack<S> LookUp(const S* HWY_RESTRICT table, const Pack<S>& position, Pack<S>& slope) {
  Pack<S> r;
  const Tag<S> d;
  const hn::RebindToSigned<Tag<S>> di;
  for (std::size_t i = 0; i < kParts<S>; ++i) {
    const auto index = hn::ConvertTo(di, position.part[i]);
    const auto low = hn::GatherIndex(d, table, index);
    const auto high = hn::GatherIndex(d, table + 1, index);
    const auto fraction = hn::Sub(position.part[i], hn::ConvertTo(d, index));
    slope.part[i] = hn::Sub(high, low);
    r.part[i] = hn::MulAdd(fraction, slope.part[i], low);
  }
  return r;
}

// Blocks of 128 bits: the unit in which all instruction sets shuffle alike.
template <class S>
inline constexpr std::size_t kBlock = 16 / sizeof(S);

template <class S, class D, class V>
HWY_INLINE hn::Vec<hn::CappedTag<S, kBlock<S>>> SumOfBlocks(D d, V v) {
  if constexpr (hn::MaxLanes(D()) <= kBlock<S>) {
    (void)d;
    return v;
  } else {
    const hn::Half<D> half;
    return SumOfBlocks<S>(half, hn::Add(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
  }
}

/// Adds the sums of the lanes of packs, a multiple of 4, to what was before: out[k] = before[k] +
/// sum of terms[k], in an order that depends on nothing but the instruction set. Both may be the
/// same.
template <class S, std::size_t kCount>
HWY_INLINE void AddSumOfEach(const Pack<S> (&terms)[kCount], const S* before, S* out) {
  const Tag<S> d;
  hn::Vec<Tag<S>> v[kCount];
  for (std::size_t k = 0; k < kCount; ++k) {
    v[k] = terms[k].part[0];
    for (std::size_t i = 1; i < kParts<S>; ++i) v[k] = hn::Add(v[k], terms[k].part[i]);
  }
  const hn::CappedTag<S, kBlock<S>> block;
  if constexpr (sizeof(S) == 4) {
    const hn::Repartition<double, Tag<S>> wide;
    for (std::size_t k = 0; k < kCount; k += 4) {
      const auto p =
          hn::Add(hn::InterleaveLower(d, v[k], v[k + 1]), hn::InterleaveUpper(d, v[k], v[k + 1]));
      const auto q = hn::Add(hn::InterleaveLower(d, v[k + 2], v[k + 3]),
                             hn::InterleaveUpper(d, v[k + 2], v[k + 3]));
      const auto pw = hn::BitCast(wide, p);
      const auto qw = hn::BitCast(wide, q);
      const auto sums = hn::Add(hn::BitCast(d, hn::InterleaveLower(wide, pw, qw)),
                                hn::BitCast(d, hn::InterleaveUpper(wide, pw, qw)));
      hn::StoreU(hn::Add(hn::LoadU(block, before + k), SumOfBlocks<S>(d, sums)), block, out + k);
    }
  } else {
    for (std::size_t k = 0; k < kCount; k += 2) {
      const auto sums =
          hn::Add(hn::InterleaveLower(d, v[k], v[k + 1]), hn::InterleaveUpper(d, v[k], v[k + 1]));
      hn::StoreU(hn::Add(hn::LoadU(block, before + k), SumOfBlocks<S>(d, sums)), block, out + k);
    }
  }
}

template <std::size_t kCount, class S>
HWY_INLINE void StoreZeros(S* HWY_RESTRICT to) {
  const hn::CappedTag<S, kBlock<S>> block;
  for (std::size_t i = 0; i < kCount; i += kBlock<S>) hn::StoreU(hn::Zero(block), block, to + i);
}

/// out[j][i] = in[i][j] for 16 x 16 scalars.
template <class S>
HWY_INLINE void Transpose16(const S* HWY_RESTRICT in, S* HWY_RESTRICT out) {
  const hn::CappedTag<S, kBlock<S>> d;
  for (std::size_t i = 0; i < 16; i += kBlock<S>) {
    for (std::size_t j = 0; j < 16; j += kBlock<S>) {
      if constexpr (sizeof(S) == 4) {
        const hn::Repartition<double, decltype(d)> wide;
        const auto r0 = hn::LoadU(d, in + (i + 0) * 16 + j);
        const auto r1 = hn::LoadU(d, in + (i + 1) * 16 + j);
        const auto r2 = hn::LoadU(d, in + (i + 2) * 16 + j);
        const auto r3 = hn::LoadU(d, in + (i + 3) * 16 + j);
        const auto a = hn::BitCast(wide, hn::InterleaveLower(d, r0, r1));
        const auto b = hn::BitCast(wide, hn::InterleaveLower(d, r2, r3));
        const auto e = hn::BitCast(wide, hn::InterleaveUpper(d, r0, r1));
        const auto f = hn::BitCast(wide, hn::InterleaveUpper(d, r2, r3));
        hn::StoreU(hn::BitCast(d, hn::InterleaveLower(wide, a, b)), d, out + (j + 0) * 16 + i);
        hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(wide, a, b)), d, out + (j + 1) * 16 + i);
        hn::StoreU(hn::BitCast(d, hn::InterleaveLower(wide, e, f)), d, out + (j + 2) * 16 + i);
        hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(wide, e, f)), d, out + (j + 3) * 16 + i);
      } else {
        const auto r0 = hn::LoadU(d, in + (i + 0) * 16 + j);
        const auto r1 = hn::LoadU(d, in + (i + 1) * 16 + j);
        hn::StoreU(hn::InterleaveLower(d, r0, r1), d, out + (j + 0) * 16 + i);
        hn::StoreU(hn::InterleaveUpper(d, r0, r1), d, out + (j + 1) * 16 + i);
      }
    }
  }
}

// Three packs as the coordinates of 16 vectors.
template <class S, std::size_t kCount = 1>
struct Pack3 {
  Pack<S, kCount> x, y, z;
};

template <class S, std::size_t kCount>
HWY_INLINE Pack<S, kCount> Dot(const Pack3<S, kCount>& a, const Pack3<S, kCount>& b) {
  return MulAdd(a.x, b.x, MulAdd(a.y, b.y, a.z * b.z));
}

template <std::size_t kCount, class S>
HWY_INLINE Pack3<S, kCount> Repeat(const Pack3<S>& a) {
  return {Repeat<kCount>(a.x), Repeat<kCount>(a.y), Repeat<kCount>(a.z)};
}

/// <a, b> + c.
template <class S, std::size_t kCount>
HWY_INLINE Pack<S, kCount> DotAdd(const Pack3<S, kCount>& a,
                                  const Pack3<S, kCount>& b,
                                  const Pack<S, kCount>& c) {
  return MulAdd(a.x, b.x, MulAdd(a.y, b.y, MulAdd(a.z, b.z, c)));
}

template <class S, std::size_t kCount>
HWY_INLINE Pack3<S, kCount> Cross(const Pack3<S, kCount>& a, const Pack3<S, kCount>& b) {
  return {NegMulAdd(a.z, b.y, a.y * b.z),
          NegMulAdd(a.x, b.z, a.z * b.x),
          NegMulAdd(a.y, b.x, a.x * b.y)};
}

template <class S, std::size_t kCount>
HWY_INLINE Pack3<S, kCount> operator+(const Pack3<S, kCount>& a, const Pack3<S, kCount>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

template <class S, std::size_t kCount>
HWY_INLINE Pack3<S, kCount> operator*(const Pack<S, kCount>& s, const Pack3<S, kCount>& a) {
  return {s * a.x, s * a.y, s * a.z};
}

/// s * a + b.
template <class S, std::size_t kCount>
HWY_INLINE Pack3<S, kCount> MulAdd(const Pack<S, kCount>& s,
                                   const Pack3<S, kCount>& a,
                                   const Pack3<S, kCount>& b) {
  return {MulAdd(s, a.x, b.x), MulAdd(s, a.y, b.y), MulAdd(s, a.z, b.z)};
}

}  // namespace covsplat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // COVSPLAT_CORE_SIMD16_INL_HPP_
