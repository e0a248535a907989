// ThreadPool and the loops over it. Chunk bounds depend only on the problem size and partial sums
// are added in chunk order, so results are bit-identical for any number of threads.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace covsplat {

/// A fixed set of workers that sleep, not spin, between loops. The calling thread works too, so a
/// pool of one thread has no workers at all. Loops of one pool must not be nested or started from
/// two threads at once.
class ThreadPool {
 public:
  /// `threads` <= 0 takes all hardware threads.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int Threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls task(i) once for every i in [0, count), on any thread; returns when all are done.
  void Run(std::size_t count, const std::function<void(std::size_t)>& task);

 private:
  void WorkerLoop();
  void WorkOn(const std::function<void(std::size_t)>& task, std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;
  std::condition_variable start_;
  std::condition_variable done_;
  // All guarded by mutex_.
  const std::function<void(std::size_t)>* task_ = nullptr;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  std::size_t unfinished_ = 0;
  bool stop_ = false;

  std::vector<std::jthread> workers_;  // last: joins before the rest goes
};

/// Calls body(begin, end) for consecutive chunks of [0, n) with at most `grain` items each.
template <class Body>
void ParallelFor(ThreadPool& pool, std::size_t n, std::size_t grain, Body&& body) {
  const std::size_t chunks = (n + grain - 1) / grain;
  const auto run_chunk = [&](std::size_t chunk) {
    body(chunk * grain, std::min(n, (chunk + 1) * grain));
  };
  if (chunks <= 1 || pool.Threads() == 1) {
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) run_chunk(chunk);
    return;
  }
  pool.Run(chunks, run_chunk);
}

/// Sum over chunks of body(begin, end), added in chunk order starting from `zero`.
template <class T, class Body>
T ParallelSum(ThreadPool& pool, std::size_t n, std::size_t grain, const T& zero, Body&& body) {
  std::vector<T> partial((n + grain - 1) / grain, zero);
  ParallelFor(pool, n, grain, [&](std::size_t begin, std::size_t end) {
    partial[begin / grain] = body(begin, end);
  });
  T sum = zero;
  for (const T& part : partial) sum += part;
  return sum;
}

}  // namespace covsplat
