// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/recorded_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::int64_t kUsualFramePeriodNs = 33'369'000;  // of a Kinect v1; used for a recording of one frame

}  // namespace

base::Result<void> RecordedCamera::check() const {
  const auto reader = RecordingReader::open(folder_, limits_);
  return reader ? base::Result<void>() : std::unexpected(reader.error());
}

base::Result<void> RecordedCamera::start(FrameSink& sink) {
  if (thread_.joinable()) return std::unexpected(base::Error{folder_.string(), "is already playing", ""});
  if (!(speed_ > 0) || !std::isfinite(speed_)) {
    return std::unexpected(base::Error{"camera.speed", fmt::format("{} is not above 0", speed_), ""});
  }
  auto reader = RecordingReader::open(folder_, limits_);
  if (!reader) return std::unexpected(reader.error());
  reader_.emplace(std::move(*reader));

  const std::string serial = reader_->serial().empty() ? "" : ", camera " + reader_->serial();
  board_.reset("recorded " + folder_.string() + serial);
  published_ = 0;
  stop_signal_.reset();
  auto thread = startThread("camera", [this, &sink] { play(sink); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void RecordedCamera::stop() {
  stop_signal_.raise();
  if (thread_.joinable()) thread_.join();
}

std::chrono::nanoseconds RecordedCamera::scaled(std::int64_t recorded_ns) const {
  constexpr double kMax_ns = 1e18;  // 30 years, so that times of the clock do not overflow
  return std::chrono::nanoseconds(std::llround(std::min(static_cast<double>(recorded_ns) / speed_, kMax_ns)));
}

std::chrono::nanoseconds RecordedCamera::lengthOfOnePass() const {
  const auto& frames = reader_->frames();
  const std::int64_t length_ns = frames.back().host_ns;
  const auto intervals = static_cast<std::int64_t>(frames.size()) - 1;
  const std::int64_t period_ns = length_ns > 0 ? length_ns / intervals : kUsualFramePeriodNs;
  return scaled(length_ns + period_ns);
}

void RecordedCamera::play(FrameSink& sink) {
  Clock::time_point begin = Clock::now();
  while (playOnce(sink, begin)) {
    if (published_ == 0) {
      board_.set(CameraState::lost, fmt::format("none of the {} frames of {} can be read: {}",
                                                reader_->frames().size(), folder_.string(), last_fault_));
      return;
    }
    if (!loop_) {
      board_.set(CameraState::lost, "the recording has ended");
      return;
    }
    // Behind schedule (a slow disk, a suspended machine): continue from now, without a burst to catch up.
    begin = std::max(begin + lengthOfOnePass(), Clock::now());
  }
}

/// Plays the recording once. Returns false if it was stopped.
bool RecordedCamera::playOnce(FrameSink& sink, Clock::time_point begin) {
  const auto& frames = reader_->frames();
  for (std::size_t index = 0; index < frames.size(); ++index) {
    rt::DepthFrame& frame = sink.back();
    const auto readable = reader_->read(index, frame);  // read ahead of time to hide the disk's latency
    if (stop_signal_.waitUntil(begin + scaled(frames[index].host_ns))) return false;
    if (!readable) {
      last_fault_ = readable.error().text();
      board_.countDamagedFrame(last_fault_);
      continue;
    }
    frame.sequence = ++published_;
    const std::int64_t exposed_before_ns = frame.arrival_ns - frame.exposure_ns;
    frame.arrival_ns = rt::monotonicNow_ns();
    if (frames[index].exposure_ns) frame.exposure_ns = frame.arrival_ns - exposed_before_ns;
    sink.publish();
    board_.countFrame();
  }
  if (!reader_->cutOff().empty()) board_.countDamagedFrame(reader_->cutOff());
  return true;
}

std::unique_ptr<Camera> makeRecordedCamera(const config::CameraSettings& settings) {
  const auto& own = settings.of<RecordedSettings>();
  return std::make_unique<RecordedCamera>(own.recording, own.loop, own.speed,
                                          DepthLimits{settings.near_m, settings.far_m});
}

}  // namespace hapticd::drivers
