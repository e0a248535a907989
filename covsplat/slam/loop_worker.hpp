// LoopWorker: loops are closed beside mapping, in a thread of their own or in turns.
#pragma once

#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "covsplat/core/sync.hpp"
#include "covsplat/loops/loop_closer.hpp"

namespace covsplat {

/// Everything but the constructor is called by the mapper's thread, until Finish has returned.
class LoopWorker {
 public:
  /// Without a thread, Post does the work.
  LoopWorker(const LoopConfig& config, bool threaded);
  ~LoopWorker();

  /// Keyframes in their order, none left out.
  void Post(LoopKeyframe keyframe);
  /// Where the first keyframes are by all loops so far, if that has changed since the last call.
  std::optional<std::vector<SE3>> TakeCorrection();
  /// Waits for what was posted; nothing can be posted afterwards.
  void Finish();

  /// After Finish.
  const LoopCloser& Closer() const { return closer_; }

 private:
  void Add(LoopKeyframe keyframe);

  ThreadPool pool_;
  LoopCloser closer_;
  BoundedQueue<LoopKeyframe> keyframes_;
  Latest<std::vector<SE3>> correction_;
  std::shared_ptr<const std::vector<SE3>> taken_;
  std::jthread thread_;  // last: joins before the rest goes
};

}  // namespace covsplat
