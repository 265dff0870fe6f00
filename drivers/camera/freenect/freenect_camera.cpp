// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/freenect/freenect_camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>

#include "drivers/camera/freenect/freenect_session.h"
#include "drivers/camera/kinect_image.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kFirstFrameLimit{3000};  // a camera that was just opened warms up its projector first
constexpr milliseconds kFrameLimit{1000};
constexpr milliseconds kEventLimit{100};  // how long a stop may go unnoticed
constexpr std::int64_t kHangsAfterNs =
    3 * rt::kNsPerSecond;  // a camera that answers is opened within a second

std::string identityOf(const std::string& serial) {
  return serial.empty() ? "freenect" : "freenect " + serial;
}

/// Searches for the camera, delivers its frames, and restarts when it is lost. A thread that hangs in
/// libfreenect outlives the driver and holds no memory of the sink: the sink is lent to libfreenect only
/// while frames are processed, where libfreenect does not hang, and never again after a stop was requested.
class FreenectWorker final : public CameraWorker {
 public:
  FreenectWorker(const std::string& serial, FrameSink& sink)
      : CameraWorker(identityOf(serial)), serial_(serial), sink_(sink) {}

  void requestStop() override {
    stop_signal_.raise();
    std::unique_lock lock(mutex_);
    stop_requested_ = true;
    changed_.wait(lock, [this] { return !sink_lent_; });
  }

  CameraStatus status() const override {
    CameraStatus status = board_.snapshot();
    const std::int64_t since_ns = in_libfreenect_since_ns_;
    if (since_ns != 0 && rt::monotonicNow_ns() - since_ns > kHangsAfterNs) {
      status.detail = "libfreenect: the camera does not respond (unplug its USB cable and its power supply)";
    }
    return status;
  }

 private:
  base::Result<void> useCamera() override {
    enterLibfreenect();
    auto used = useOpenedCamera();
    in_libfreenect_since_ns_ = 0;
    return used;
  }

  base::Result<void> useOpenedCamera() {
    auto session = FreenectSession::open(serial_);
    if (!session) return std::unexpected(session.error());
    if (!(*session)->serial().empty()) board_.setIdentity(identityOf((*session)->serial()));
    board_.setAdvice(adviceOn(**session));
    if (auto started = (*session)->startDepth(); !started) return started;
    auto ended = deliver(**session);
    show(ended);  // at once, because closing may hang
    return ended;
  }

  base::Result<void> deliver(FreenectSession& session) {
    if (!lendSink()) return {};
    in_libfreenect_since_ns_ = 0;
    session.deliverTo(sink_.back().raw, [this](const std::optional<std::string>& damage,
                                               std::uint32_t ticks) { return takeFrame(damage, ticks); });
    last_frame_ = Clock::now() + (kFirstFrameLimit - kFrameLimit);
    base::Result<void> processed;
    while (processed && !stop_signal_.raised() && Clock::now() - last_frame_ <= kFrameLimit) {
      processed = session.processEvents(kEventLimit);
    }
    session.deliverNowhere();
    returnSink();
    enterLibfreenect();  // closing may hang as well
    if (!processed || stop_signal_.raised()) return processed;
    return std::unexpected(base::Error{"libfreenect", "the camera has stopped sending frames",
                                       "check its USB cable and its power supply"});
  }

  /// Called by processEvents() with the frame in sink_.back(). Returns the buffer for the next one.
  std::uint16_t* takeFrame(const std::optional<std::string>& damage, std::uint32_t device_ticks) {
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

  std::string adviceOn(const FreenectSession& session) const {
    if (!serial_.empty() || session.serialsFound().size() < 2) return {};
    return fmt::format("{} cameras found ({}), {} is used (name the right one in camera.serial)",
                       session.serialsFound().size(), fmt::join(session.serialsFound(), ", "),
                       session.serial());
  }

  void enterLibfreenect() { in_libfreenect_since_ns_ = rt::monotonicNow_ns(); }

  bool lendSink() {
    const std::lock_guard lock(mutex_);
    if (stop_requested_) return false;
    sink_lent_ = true;
    return true;
  }

  void returnSink() {
    const std::lock_guard lock(mutex_);
    sink_lent_ = false;
    changed_.notify_all();
  }

  const std::string serial_;
  FrameSink& sink_;
  std::atomic<std::int64_t> in_libfreenect_since_ns_{0};  // 0: not in a call that may hang
  std::uint64_t published_ = 0;                           // run() only
  Clock::time_point last_frame_;                          // run() only

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stop_requested_ = false;
  bool sink_lent_ = false;
};

}  // namespace

FreenectCamera::FreenectCamera(const std::string& serial, std::chrono::milliseconds stop_limit)
    : WorkerCamera(
          {.name = "freenect",
           .identity = identityOf(serial),
           .stop_limit = stop_limit,
           .make = [serial](FrameSink& sink) { return std::make_shared<FreenectWorker>(serial, sink); }}) {}

std::unique_ptr<Camera> makeFreenectCamera(const config::CameraSettings& settings) {
  return std::make_unique<FreenectCamera>(settings.serial);
}

}  // namespace hapticd::drivers
