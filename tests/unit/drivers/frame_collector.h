// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "drivers/camera/camera.h"

namespace hapticd::test {

/// Sufficient for the slowest machine under a sanitizer; only a failing test waits this long.
inline constexpr std::chrono::seconds kPatience{60};

/// Keeps every published frame where the driver wrote it; each frame has its own address.
class FrameCollector final : public drivers::FrameSink {
 public:
  rt::DepthFrame& back() override {
    const std::lock_guard lock(mutex_);
    return *back_;
  }

  void publish() override {
    const std::lock_guard lock(mutex_);
    frames_.push_back(std::move(back_));
    back_ = std::make_unique<rt::DepthFrame>();
    changed_.notify_all();
  }

  /// Returns true if at least `count` frames were published in time.
  bool waitForFrames(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return frames_.size() >= count; });
  }

  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return frames_.size();
  }

  const rt::DepthFrame& frame(std::size_t index) {
    const std::lock_guard lock(mutex_);
    return *frames_.at(index);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<rt::DepthFrame> back_ = std::make_unique<rt::DepthFrame>();
  std::vector<std::unique_ptr<rt::DepthFrame>> frames_;
};

/// Polls until `condition` holds; returns false on timeout.
template <typename Condition>
bool eventually(Condition condition) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace hapticd::test
