#include "covsplat/slam/loop_worker.hpp"

#include <utility>

#include "covsplat/core/background.hpp"

namespace covsplat {
namespace {

/// The mapper waits when so many keyframes have not been looked at.
constexpr std::size_t kQueue = 64;

}  // namespace

LoopWorker::LoopWorker(const LoopConfig& config, bool threaded)
    : pool_(1), closer_(config, pool_), keyframes_(kQueue) {
  if (!threaded) return;
  thread_ = std::jthread([this] {
    GoToBackground();
    while (std::optional<LoopKeyframe> keyframe = keyframes_.Pop()) Add(std::move(*keyframe));
  });
}

LoopWorker::~LoopWorker() { keyframes_.Close(); }

void LoopWorker::Post(LoopKeyframe keyframe) {
  if (thread_.joinable()) {
    keyframes_.Push(std::move(keyframe));
  } else {
    Add(std::move(keyframe));
  }
}

void LoopWorker::Add(LoopKeyframe keyframe) {
  if (!closer_.Add(std::move(keyframe))) return;
  correction_.Publish(std::make_shared<const std::vector<SE3>>(closer_.Poses()));
}

std::optional<std::vector<SE3>> LoopWorker::TakeCorrection() {
  std::shared_ptr<const std::vector<SE3>> newest = correction_.Get();
  if (newest == taken_) return std::nullopt;
  taken_ = std::move(newest);
  return *taken_;
}

void LoopWorker::Finish() {
  keyframes_.Close();
  if (thread_.joinable()) thread_.join();
}

}  // namespace covsplat
