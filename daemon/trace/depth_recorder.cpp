// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/depth_recorder.h"

#include <span>
#include <utility>

#include "drivers/base/start_thread.h"

namespace hapticd::daemon {

config::Result<std::unique_ptr<DepthRecorder>> DepthRecorder::start(const rt::DepthFrameHeader& common) {
  std::unique_ptr<DepthRecorder> recorder(new DepthRecorder(common));
  auto thread = drivers::startThread("hapticd-depth", [self = recorder.get()] { self->run(); });
  if (!thread) return std::unexpected(thread.error());
  recorder->thread_ = std::move(*thread);
  return recorder;
}

DepthRecorder::DepthRecorder(const rt::DepthFrameHeader& common) : common_(common), frames_(kFrames) {
  for (std::size_t slot = 0; slot < kFrames; ++slot) free_.push_back(slot);
}

DepthRecorder::~DepthRecorder() {
  finish();
}

bool DepthRecorder::offer(const rt::DepthFrame& frame) {
  std::size_t slot = 0;
  {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    slot = free_.back();
    free_.pop_back();
  }
  frames_[slot] = frame;
  {
    const std::lock_guard lock(mutex_);
    offered_.push_back(slot);
  }
  wake_.notify_one();
  return true;
}

bool DepthRecorder::nextFrame(std::size_t& slot) {
  std::unique_lock lock(mutex_);
  wake_.wait(lock,
             [this] { return finishing_ || (!offered_.empty() && compressed_bytes_ < kMostWaitingBytes); });
  if (offered_.empty()) return false;
  slot = offered_.front();
  offered_.pop_front();
  return true;
}

void DepthRecorder::run() {
  for (std::size_t slot = 0; nextFrame(slot);) {
    drivers::DepthRecord record;
    const rt::DepthFrame& frame = frames_[slot];
    encoder_.encode(drivers::headerOf(common_, frame), std::as_bytes(std::span(frame.raw)), record);
    record.image.bytes.shrink_to_fit();  // the record may stay in memory for a while
    const std::lock_guard lock(mutex_);
    free_.push_back(slot);
    compressed_bytes_ += record.image.bytes.size();
    compressed_.push_back(std::move(record));
  }
}

bool DepthRecorder::take(drivers::DepthRecord& record) {
  {
    const std::lock_guard lock(mutex_);
    if (compressed_.empty()) return false;
    record = std::move(compressed_.front());
    compressed_.pop_front();
    compressed_bytes_ -= record.image.bytes.size();
  }
  wake_.notify_one();
  return true;
}

void DepthRecorder::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

}  // namespace hapticd::daemon
