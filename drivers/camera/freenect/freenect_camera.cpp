// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/freenect/freenect_camera.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <libfreenect.h>
#include <sys/time.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "drivers/camera/kinect_image.h"
#include "rt/base/clock.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {
namespace {

constexpr std::string_view kDepthStream = "[Stream 70] ";

std::string_view withoutLineEnd(std::string_view line) {
  while (line.ends_with('\n') || line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

}  // namespace

void FrameIntegrity::noteLogLine(std::string_view line) {
  line = withoutLineEnd(line);
  if (line.starts_with("Got depth frame")) {
    int arrived = 0;
    int expected = 0;
    const std::string text(line);
    if (std::sscanf(text.c_str(), "Got depth frame of size %*d/%*d, %d/%d", &arrived, &expected) == 2) {
      count_ = std::to_string(arrived) + " of " + std::to_string(expected) + " packets arrived";
      count_is_complete_ = arrived == expected;
    }
    return;
  }
  if (!line.starts_with(kDepthStream)) return;
  line.remove_prefix(kDepthStream.size());
  if (line.find("esync") != std::string_view::npos) {
    loss_.clear();  // libfreenect abandons the frame in progress and restarts
  } else if (line.starts_with("Expected") || (line.starts_with("Lost") && line.ends_with("packets"))) {
    loss_ = line;
  }
}

std::optional<std::string> FrameIntegrity::takeDamage() {
  const std::string count = std::exchange(count_, {});
  const bool short_packet = loss_.starts_with("Expected");
  if (!count.empty() && !count_is_complete_) {
    if (!short_packet) loss_.clear();  // a short packet may already belong to the frame after the lost ones
    return count;
  }
  const std::string loss = std::exchange(loss_, {});
  if (loss.empty() || (!count.empty() && !short_packet)) return std::nullopt;
  return loss;
}

namespace {

// libfreenect's log callback has no user pointer, but it runs in the thread of the call that logs.
thread_local FreenectSession* logging_session = nullptr;

/// Returns the serial numbers of all cameras in the order of freenect_open_device(). The functions are looked
/// up at run time, because the player fakenect lacks them.
std::vector<std::string> serialsOfCameras(freenect_context* context) {
  using List = int (*)(freenect_context*, freenect_device_attributes**);
  using Free = void (*)(freenect_device_attributes*);
  const auto list = reinterpret_cast<List>(::dlsym(RTLD_DEFAULT, "freenect_list_device_attributes"));
  const auto free = reinterpret_cast<Free>(::dlsym(RTLD_DEFAULT, "freenect_free_device_attributes"));
  if (list == nullptr || free == nullptr) return {};
  freenect_device_attributes* first = nullptr;
  std::vector<std::string> serials;
  list(context, &first);
  for (const freenect_device_attributes* camera = first; camera != nullptr; camera = camera->next) {
    serials.emplace_back(camera->camera_serial != nullptr ? camera->camera_serial : "");
  }
  free(first);
  return serials;
}

constexpr const char* kNotFoundRemedy =
    "connect the Kinect v1 and its own power supply; lsusb must list it as 045e:02ae, or a Kinect for "
    "Windows as 045e:02bf";
constexpr const char* kCannotOpenRemedy =
    "allow the daemon's user to open the device (udev rule for 045e:02ae or 045e:02bf) and end other "
    "programs that use it";

}  // namespace

base::Result<std::unique_ptr<FreenectSession>> FreenectSession::open(const std::string& serial) {
  std::unique_ptr<FreenectSession> session(new FreenectSession);
  logging_session = session.get();
  if (auto ready = session->initialise(); !ready) return std::unexpected(ready.error());
  if (auto opened = session->openDevice(serial); !opened) return std::unexpected(opened.error());
  return session;
}

FreenectSession::~FreenectSession() {
  if (device_ != nullptr) {
    deliverNowhere();
    if (depth_started_) freenect_stop_depth(device_);
    freenect_close_device(device_);
  }
  if (context_ != nullptr) freenect_shutdown(context_);
  logging_session = nullptr;
}

base::Error FreenectSession::failure(std::string what, std::string remedy) const {
  if (!last_problem_.empty()) what += fmt::format(" (libfreenect: {})", last_problem_);
  return {"libfreenect", std::move(what), std::move(remedy)};
}

base::Result<void> FreenectSession::initialise() {
  spare_buffer_ = std::make_unique<std::uint16_t[]>(kKinectPixels);
  if (const int status = freenect_init(&context_, nullptr); status < 0) {
    context_ = nullptr;
    return std::unexpected(failure(fmt::format("USB cannot be used (status {})", status),
                                   "check that /dev/bus/usb exists and that the daemon may read it"));
  }
  freenect_set_log_callback(context_, [](freenect_context* context, freenect_loglevel level,
                                         const char* message) { onLog(context, level, message); });
  freenect_set_log_level(context_, FREENECT_LOG_SPEW);  // this level includes the packet count of each frame
  freenect_select_subdevices(context_, FREENECT_DEVICE_CAMERA);
  return {};
}

base::Result<void> FreenectSession::openDevice(const std::string& serial) {
  const int cameras = freenect_num_devices(context_);
  if (cameras < 0) {
    return std::unexpected(failure(fmt::format("the USB devices cannot be listed (status {})", cameras),
                                   "check that the daemon may read /dev/bus/usb"));
  }
  if (cameras == 0) return std::unexpected(failure("no Kinect found", kNotFoundRemedy));

  serials_ = serialsOfCameras(context_);
  const int status = serial.empty()
                         ? freenect_open_device(context_, &device_, 0)
                         : freenect_open_device_by_camera_serial(context_, &device_, serial.c_str());
  if (status < 0) {
    device_ = nullptr;
    if (serial.empty()) {
      return std::unexpected(failure("the camera cannot be opened", kCannotOpenRemedy));
    }
    if (std::ranges::find(serials_, serial) != serials_.end()) {
      return std::unexpected(
          failure(fmt::format("the camera {} cannot be opened", serial), kCannotOpenRemedy));
    }
    return std::unexpected(failure(
        fmt::format("no camera has the serial number {}; found: {}", serial, fmt::join(serials_, ", ")),
        "set camera.serial to one of these, and check that the daemon's user may open the devices"));
  }
  serial_ = !serial.empty() ? serial : serials_.empty() ? std::string() : serials_.front();
  freenect_set_user(device_, this);
  return {};
}

base::Result<void> FreenectSession::startDepth() {
  freenect_set_depth_callback(device_, [](freenect_device* device, void* depth, std::uint32_t ticks) {
    onDepth(device, depth, ticks);
  });
  const freenect_frame_mode mode = freenect_find_depth_mode(FREENECT_RESOLUTION_MEDIUM, FREENECT_DEPTH_11BIT);
  deliverNowhere();
  if (mode.is_valid == 0 || freenect_set_depth_mode(device_, mode) < 0 || freenect_start_depth(device_) < 0) {
    return std::unexpected(failure("the depth stream cannot be started",
                                   "unplug the camera, wait a moment and plug it in again"));
  }
  depth_started_ = true;
  return {};
}

void FreenectSession::deliverTo(std::uint16_t* buffer, FrameHandler handler) {
  handler_ = std::move(handler);
  freenect_set_depth_buffer(device_, buffer);
}

void FreenectSession::deliverNowhere() {
  handler_ = nullptr;
  freenect_set_depth_buffer(device_, spare_buffer_.get());
}

base::Result<void> FreenectSession::processEvents(std::chrono::microseconds limit) {
  timeval timeout{};
  timeout.tv_usec = limit.count();
  if (const int status = freenect_process_events_timeout(context_, &timeout); status < 0) {
    return std::unexpected(failure(fmt::format("the camera is gone (status {})", status),
                                   "check its USB cable and its power supply"));
  }
  return {};
}

void FreenectSession::onDepth(freenect_device* device, void* /*depth*/, std::uint32_t ticks) {
  auto& session = *static_cast<FreenectSession*>(freenect_get_user(device));
  const std::optional<std::string> damage = session.integrity_.takeDamage();
  if (session.handler_) freenect_set_depth_buffer(device, session.handler_(damage, ticks));
}

void FreenectSession::onLog(freenect_context* /*context*/, int level, const char* message) {
  if (logging_session == nullptr) return;
  logging_session->integrity_.noteLogLine(message);
  if (level > FREENECT_LOG_WARNING) return;
  std::string_view line(message);
  while (line.ends_with('\n')) line.remove_suffix(1);
  logging_session->last_problem_ = line;
}

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
