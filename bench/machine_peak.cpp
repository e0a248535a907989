#include "bench/machine_peak.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/machine_peak.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace covsplat::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// Multiply-adds in chains enough that none waits for another; returns how many were made.
double MultiplyAdd(std::size_t rounds, float* result) {
  constexpr std::size_t kChains = 12;
  const hn::ScalableTag<float> d;
  const auto factor = hn::Set(d, 0.999f);
  const auto summand = hn::Set(d, 0.001f);
  hn::Vec<decltype(d)> chain[kChains];
  for (auto& value : chain) value = summand;
  for (std::size_t i = 0; i < rounds; ++i) {
    for (auto& value : chain) value = hn::MulAdd(value, factor, summand);
  }
  for (std::size_t k = 1; k < kChains; ++k) chain[0] = hn::Add(chain[0], chain[k]);
  *result = hn::GetLane(hn::SumOfLanes(d, chain[0]));
  return static_cast<double>(kChains * rounds * hn::Lanes(d));
}

}  // namespace
}  // namespace covsplat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace covsplat {
namespace {

HWY_EXPORT(MultiplyAdd);

constexpr int kTries = 5;

/// The most of what `run` returns per second.
template <class Run>
double BestRate(Run&& run) {
  using Clock = std::chrono::steady_clock;
  double best = 0.0;
  for (int i = 0; i < kTries; ++i) {
    const auto begin = Clock::now();
    const double amount = run();
    best = std::max(best, amount / std::chrono::duration<double>(Clock::now() - begin).count());
  }
  return best;
}

double MeasureFlops(ThreadPool& pool) {
  constexpr std::size_t kRounds = 500'000;
  const auto tasks = 4 * static_cast<std::size_t>(pool.Threads());
  std::vector<float> results(tasks);
  std::vector<double> made(tasks);
  return BestRate([&] {
    ParallelFor(pool, tasks, 1, [&](std::size_t task, std::size_t /*end*/) {
      made[task] = HWY_DYNAMIC_DISPATCH(MultiplyAdd)(kRounds, &results[task]);
    });
    double sum = 0.0;
    for (const double count : made) sum += 2.0 * count;
    return sum;
  });
}

double MeasureBandwidth(ThreadPool& pool) {
  constexpr std::size_t kBytes = 128 << 20;
  constexpr std::size_t kBytesPerTask = 1 << 20;
  const std::vector<char> from(kBytes, 1);
  std::vector<char> to(kBytes);
  return BestRate([&] {
    ParallelFor(pool, kBytes, kBytesPerTask, [&](std::size_t begin, std::size_t end) {
      std::memcpy(&to[begin], &from[begin], end - begin);
    });
    return 2.0 * static_cast<double>(kBytes);
  });
}

}  // namespace

MachinePeak MeasurePeak(ThreadPool& pool) { return {MeasureFlops(pool), MeasureBandwidth(pool)}; }

}  // namespace covsplat
#endif  // HWY_ONCE
