// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/camera_test.h"

#include <fmt/format.h>

#include <cmath>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "config/base/value_text.h"
#include "tools/lib/depth_noise/depth_noise.h"

namespace hapticd::tools {
namespace {

using base::printable;
using Clock = std::chrono::steady_clock;

constexpr int kPictureColumns = 64;
constexpr std::chrono::milliseconds kLookPeriod{100};
constexpr double kNanosecondsPerSecond = 1e9;

/// Counts each frame in the driver's thread, and measures as many as this computer can in a thread of its
/// own: a driver that waited for the measurement would lose frames.
class MeasuringSink final : public drivers::FrameSink {
 public:
  MeasuringSink() : measuring_([this] { measure(); }) {}
  ~MeasuringSink() override { finish(); }

  rt::DepthFrame& back() override { return *frame_; }

  void publish() override {
    const std::lock_guard lock(mutex_);
    count();
    if (waiting_.size() < kMaxWaiting) {
      waiting_.push_back(std::exchange(frame_, std::make_unique<rt::DepthFrame>()));
    }
    changed_.notify_all();
  }

  bool waitForFirst(std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, limit, [this] { return count_ > 0; });
  }

  /// After the driver has stopped.
  CameraTest result() {
    finish();
    CameraTest test;
    const double span_s = static_cast<double>(last_ns_ - first_ns_) / kNanosecondsPerSecond;
    test.rate_hz = count_ > 1 && span_s > 0 ? static_cast<double>(count_ - 1) / span_s : std::nan("");
    test.frames = count_;
    test.lost_frames = lost_;
    test.noise = noise_.report();
    test.model = noise_.camera();
    test.mean_depth_m = noise_.meanDepth_m();
    return test;
  }

 private:
  static constexpr std::uint32_t kMaxLost = 1000;  // a larger step is a counter that started anew
  static constexpr std::size_t kMaxWaiting = 20;   // 40 MB of frames

  void count() {
    if (count_++ == 0) {
      first_ns_ = frame_->arrival_ns;
    } else if (const std::uint32_t step = frame_->device_ticks - last_ticks_; step > 1 && step < kMaxLost) {
      lost_ += step - 1;
    }
    last_ns_ = frame_->arrival_ns;
    last_ticks_ = frame_->device_ticks;
  }

  void measure() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return finishing_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      const std::unique_ptr<rt::DepthFrame> frame = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      noise_.add(*frame);
      lock.lock();
    }
  }

  /// Waits until what waits has been measured.
  void finish() {
    {
      const std::lock_guard lock(mutex_);
      finishing_ = true;
      changed_.notify_all();
    }
    if (measuring_.joinable()) measuring_.join();
  }

  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
  DepthNoise noise_;  // the measuring thread only, until it has ended
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::unique_ptr<rt::DepthFrame>> waiting_;
  bool finishing_ = false;
  std::uint64_t count_ = 0;
  std::uint64_t lost_ = 0;
  std::int64_t first_ns_ = 0;
  std::int64_t last_ns_ = 0;
  std::uint32_t last_ticks_ = 0;
  std::thread measuring_;  // last: it uses the others
};

/// Whether the driver has looked for the camera and knows why it cannot use it.
bool hasReason(const drivers::CameraStatus& status) {
  const bool is_absent = status.state == drivers::CameraState::absent && status.damaged_frames == 0;
  return is_absent && !status.detail.empty() && status.detail != drivers::kLookingForCamera;
}

bool waitForFirst(MeasuringSink& sink, const drivers::Camera& camera, std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  do {
    if (sink.waitForFirst(kLookPeriod)) return true;
    if (hasReason(camera.status())) break;
  } while (Clock::now() < deadline);
  return false;
}

}  // namespace

base::Result<CameraTest> testCamera(drivers::Camera& camera, std::chrono::milliseconds duration,
                                    std::chrono::milliseconds patience) {
  MeasuringSink sink;
  if (const auto started = camera.start(sink); !started) return std::unexpected(started.error());
  const bool delivers = waitForFirst(sink, camera, patience);
  if (delivers) std::this_thread::sleep_for(duration);
  const drivers::CameraStatus status = camera.status();
  camera.stop();
  if (!delivers) {
    // the driver's reason says what to do, where it has one
    return std::unexpected(base::Error{
        "",
        fmt::format("the camera delivers no frames{}{}", status.detail.empty() ? "" : ": ", status.detail),
        status.detail.empty() ? "unplug the camera and plug it in again; no other program may use it" : ""});
  }
  CameraTest test = sink.result();
  test.status = status;
  return test;
}

std::string textOf(const CameraTest& test) {
  const drivers::CameraDetails& details = test.status.details;
  std::string text =
      depthPicture(test.mean_depth_m, test.model.width_px, test.model.height_px, kPictureColumns);
  text += fmt::format("camera       {}, {} {} x {} at {:.0f} Hz\n", printable(test.status.identity),
                      printable(details.format), test.model.width_px, test.model.height_px, details.rate_hz);
  const std::string rate =
      std::isnan(test.rate_hz) ? "rate not measured" : fmt::format("{:.2f} per second", test.rate_hz);
  text += fmt::format("frames       {}, {}, {} lost, {} damaged\n", test.frames, rate, test.lost_frames,
                      test.status.damaged_frames);
  if (test.noise.frames < test.frames) {
    text +=
        fmt::format("             {} of them measured, as many as this computer can\n", test.noise.frames);
  }
  text += fmt::format("holes        {:.1f} % of the pixels\n", 100 * test.noise.share_of_holes);
  return text + textOf(test.noise, test.model.principle);
}

std::string jsonOf(const CameraTest& test) {
  using Json = nlohmann::ordered_json;
  Json document{{"identity", test.status.identity},
                {"format", test.status.details.format},
                {"widthPx", test.model.width_px},
                {"heightPx", test.model.height_px},
                {"frames", test.frames},
                {"measuredFrames", test.noise.frames},
                {"rateHz", test.rate_hz},
                {"lostFrames", test.lost_frames},
                {"damagedFrames", test.status.damaged_frames},
                {"shareOfHoles", test.noise.share_of_holes}};
  addTo(document, test.noise, test.model.principle);
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace hapticd::tools
