// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/depth_recorder.h"

#include <span>
#include <utility>

#include "drivers/base/start_thread.h"

namespace hapticd::daemon {

namespace {

std::size_t bytesOf(const RecordedFrame& recorded) {
  return recorded.depth.image.bytes.size() + recorded.cloud.points_m_in_optical.size() * sizeof(float);
}

}  // namespace

base::Result<std::unique_ptr<DepthRecorder>> DepthRecorder::start(const rt::DepthFrameHeader& common,
                                                                  bool cloud) {
  std::unique_ptr<DepthRecorder> recorder(new DepthRecorder(common, cloud));
  auto thread = drivers::startThread("hapticd-depth", [self = recorder.get()] { self->run(); });
  if (!thread) return std::unexpected(thread.error());
  recorder->thread_ = std::move(*thread);
  return recorder;
}

DepthRecorder::DepthRecorder(const rt::DepthFrameHeader& common, bool cloud)
    : common_(common), cloud_(cloud), frames_(kFrames) {
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

bool DepthRecorder::nextFrame(std::size_t& slot, trace::ros::ModelledBall& ball) {
  std::unique_lock lock(mutex_);
  wake_.wait(lock,
             [this] { return finishing_ || (!offered_.empty() && compressed_bytes_ < kMaxWaitingBytes); });
  if (offered_.empty()) return false;
  slot = offered_.front();
  offered_.pop_front();
  ball = ball_;
  return true;
}

void DepthRecorder::run() {
  trace::ros::ModelledBall ball;
  for (std::size_t slot = 0; nextFrame(slot, ball);) {
    RecordedFrame recorded;
    const rt::DepthFrame& frame = frames_[slot];
    const rt::DepthFrameHeader header = trace::headerOf(common_, frame);
    const auto image = std::as_bytes(frame.image());
    encoder_.encode(header, image, recorded.depth);
    recorded.depth.image.bytes.shrink_to_fit();  // the record may stay in memory for a while
    if (cloud_) {
      recorded.cloud.time_ns = header.arrival_ns;
      view_.set(header, image);
      view_.pointsInBall(ball, recorded.cloud.points_m_in_optical);
      recorded.cloud.points_m_in_optical.shrink_to_fit();
    }
    const std::lock_guard lock(mutex_);
    free_.push_back(slot);
    compressed_bytes_ += bytesOf(recorded);
    compressed_.push_back(std::move(recorded));
  }
}

void DepthRecorder::setBall(const trace::ros::ModelledBall& ball) {
  const std::lock_guard lock(mutex_);
  ball_ = ball;
}

bool DepthRecorder::take(RecordedFrame& recorded) {
  {
    const std::lock_guard lock(mutex_);
    if (compressed_.empty()) return false;
    recorded = std::move(compressed_.front());
    compressed_.pop_front();
    compressed_bytes_ -= bytesOf(recorded);
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
