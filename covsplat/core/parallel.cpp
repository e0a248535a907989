#include "covsplat/core/parallel.hpp"

namespace covsplat {

ThreadPool::ThreadPool(int threads) {
  const int wanted = threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency());
  for (int i = 1; i < wanted; ++i) workers_.emplace_back([this] { WorkerLoop(); });
}

ThreadPool::~ThreadPool() {
  const std::scoped_lock lock(mutex_);
  stop_ = true;
  start_.notify_all();
}

void ThreadPool::Run(std::size_t count, const std::function<void(std::size_t)>& task) {
  if (count == 0) return;
  std::unique_lock lock(mutex_);
  task_ = &task;
  next_ = 0;
  count_ = count;
  unfinished_ = count;
  start_.notify_all();
  WorkOn(task, lock);
  done_.wait(lock, [&] { return unfinished_ == 0; });
  task_ = nullptr;
}

void ThreadPool::WorkOn(const std::function<void(std::size_t)>& task,
                        std::unique_lock<std::mutex>& lock) {
  while (next_ < count_) {
    const std::size_t index = next_++;
    lock.unlock();
    task(index);
    lock.lock();
    if (--unfinished_ == 0) done_.notify_one();
  }
}

void ThreadPool::WorkerLoop() {
  std::unique_lock lock(mutex_);
  while (true) {
    start_.wait(lock, [&] { return stop_ || (task_ != nullptr && next_ < count_); });
    if (stop_) return;
    WorkOn(*task_, lock);
  }
}

}  // namespace covsplat
