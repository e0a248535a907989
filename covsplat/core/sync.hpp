// The two ways in which threads meet: a bounded queue and a latest-value slot.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

namespace covsplat {

/// First in, first out; Push waits while the queue is full, Pop while it is empty. After Close,
/// Push refuses and Pop drains what is left.
template <class T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// False if the queue was closed; the value is then dropped.
  bool Push(T value) {
    std::unique_lock lock(mutex_);
    not_full_.wait(lock, [&] { return closed_ || items_.size() < capacity_; });
    if (closed_) return false;
    items_.push_back(std::move(value));
    not_empty_.notify_one();
    return true;
  }

  /// Empty only once the queue is closed and drained.
  std::optional<T> Pop() {
    std::unique_lock lock(mutex_);
    not_empty_.wait(lock, [&] { return closed_ || !items_.empty(); });
    return TakeFront();
  }

  /// Empty if nothing is waiting.
  std::optional<T> TryPop() {
    const std::scoped_lock lock(mutex_);
    return TakeFront();
  }

  /// Nothing is waiting at this moment.
  bool Empty() const {
    const std::scoped_lock lock(mutex_);
    return items_.empty();
  }

  void Close() {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
    not_empty_.notify_all();
    not_full_.notify_all();
  }

  /// Closed and drained.
  bool Closed() const {
    const std::scoped_lock lock(mutex_);
    return closed_ && items_.empty();
  }

 private:
  std::optional<T> TakeFront() {
    if (items_.empty()) return std::nullopt;
    std::optional<T> value(std::move(items_.front()));
    items_.pop_front();
    not_full_.notify_one();
    return value;
  }

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable not_full_;
  std::condition_variable not_empty_;
  std::deque<T> items_;  // guarded by mutex_
  bool closed_ = false;  // guarded by mutex_
};

/// The newest of a series of immutable values; readers never wait for writers to finish a value.
template <class T>
class Latest {
 public:
  void Publish(std::shared_ptr<const T> value) {
    {
      const std::scoped_lock lock(mutex_);
      std::swap(value_, value);
      published_.notify_all();
    }
    // The old value is freed here, outside the lock, unless a reader still holds it.
  }

  std::shared_ptr<const T> Get() const {
    const std::scoped_lock lock(mutex_);
    return value_;
  }

  /// Waits until there is a value for which good(value) holds.
  template <class Good>
  void WaitFor(Good&& good) const {
    std::unique_lock lock(mutex_);
    published_.wait(lock, [&] { return value_ != nullptr && good(*value_); });
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable published_;
  std::shared_ptr<const T> value_;  // guarded by mutex_
};

}  // namespace covsplat
