// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/freenect/freenect_worker.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/camera/kinect_image.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kRetryPeriod{1000};
constexpr milliseconds kFirstFrameLimit{3000};  // a camera that was just opened warms up its projector first
constexpr milliseconds kFrameLimit{1000};
constexpr milliseconds kEventLimit{100};  // how long a stop may go unnoticed
constexpr std::int64_t kHangsAfterNs =
    3 * rt::kNsPerSecond;  // a camera that answers is opened within a second

}  // namespace

void FreenectWorker::run() {
  board_.set(CameraState::absent, kLookingForCamera);
  board_.setIdentity(serial_.empty() ? "freenect" : "freenect " + serial_);
  Clock::time_point next_try = Clock::now();
  while (!stop_signal_.waitUntil(next_try)) {
    enterLibfreenect();
    useCameraOnce();
    in_libfreenect_since_ns_ = 0;
    next_try = Clock::now() + kRetryPeriod;
  }
}

void FreenectWorker::requestStop() {
  stop_signal_.raise();
  std::unique_lock lock(mutex_);
  stop_requested_ = true;
  changed_.wait(lock, [this] { return !sink_lent_; });
}

CameraStatus FreenectWorker::status() const {
  CameraStatus status = board_.snapshot();
  const std::int64_t since_ns = in_libfreenect_since_ns_;
  if (since_ns != 0 && rt::monotonicNow_ns() - since_ns > kHangsAfterNs) {
    status.detail = "libfreenect: the camera does not respond (unplug its USB cable and its power supply)";
  }
  return status;
}

void FreenectWorker::enterLibfreenect() {
  in_libfreenect_since_ns_ = rt::monotonicNow_ns();
}

bool FreenectWorker::lendSink() {
  const std::lock_guard lock(mutex_);
  if (stop_requested_) return false;
  sink_lent_ = true;
  return true;
}

void FreenectWorker::returnSink() {
  const std::lock_guard lock(mutex_);
  sink_lent_ = false;
  changed_.notify_all();
}

void FreenectWorker::useCameraOnce() {
  auto session = FreenectSession::open(serial_);
  if (!session) return reportMissing(session.error());
  if (!(*session)->serial().empty()) board_.setIdentity("freenect " + (*session)->serial());
  board_.setAdvice(adviceOn(**session));
  if (auto started = (*session)->startDepth(); !started) return reportMissing(started.error());
  deliver(**session);
}

std::string FreenectWorker::adviceOn(const FreenectSession& session) const {
  if (!serial_.empty() || session.serialsFound().size() < 2) return {};
  return fmt::format("{} cameras found ({}), {} is used (name the right one in camera.serial)",
                     session.serialsFound().size(), fmt::join(session.serialsFound(), ", "),
                     session.serial());
}

void FreenectWorker::reportMissing(const base::Error& error) {
  board_.set(seen_ ? CameraState::lost : CameraState::absent, error.text());
}

void FreenectWorker::deliver(FreenectSession& session) {
  if (!lendSink()) return;
  in_libfreenect_since_ns_ = 0;
  session.deliverTo(sink_.back().raw, [this](const std::optional<std::string>& damage, std::uint32_t ticks) {
    return takeFrame(damage, ticks);
  });
  last_frame_ = Clock::now() + (kFirstFrameLimit - kFrameLimit);
  base::Result<void> processed;
  while (processed && !stop_signal_.raised() && Clock::now() - last_frame_ <= kFrameLimit) {
    processed = session.processEvents(kEventLimit);
  }
  session.deliverNowhere();
  returnSink();
  enterLibfreenect();  // closing may hang as well
  if (!processed) {
    reportMissing(processed.error());
  } else if (!stop_signal_.raised()) {
    reportMissing(
        {"libfreenect", "the camera has stopped sending frames", "check its USB cable and its power supply"});
  }
}

/// Called by processEvents() with the frame in sink_.back(). Returns the buffer for the next one.
std::uint16_t* FreenectWorker::takeFrame(const std::optional<std::string>& damage,
                                         std::uint32_t device_ticks) {
  last_frame_ = Clock::now();
  rt::DepthFrame& frame = sink_.back();
  if (damage) {
    board_.countDamagedFrame(*damage);
  } else if (hasDamagedPixels(frame.image())) {
    board_.countDamagedFrame(std::to_string(countDamagedPixels(frame.image())) + " pixels are above 2047");
  } else {
    frame.sequence = ++published_;
    frame.arrival_ns = rt::monotonicNow_ns();
    frame.device_ticks = device_ticks;
    seen_ = true;
    sink_.publish();
    board_.countFrame();
  }
  return sink_.back().raw;
}

}  // namespace hapticd::drivers
