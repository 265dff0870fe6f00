// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/v4l2_camera.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "drivers/base/start_thread.h"
#include "drivers/base/stop_signal.h"
#include "drivers/camera/v4l2/camera_report.h"
#include "drivers/camera/v4l2/capture_stream.h"
#include "drivers/camera/v4l2/realsense_messages.h"
#include "drivers/camera/v4l2/video_devices.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kPeriod{5};

/// Asks a camera for its temperature once in a while. In a thread of its own, because the kernel waits up to
/// 5 s for a control that a camera does not answer, and frames must not wait for it.
class TemperatureReader {
 public:
  using Report = std::function<void(std::optional<double> temperature_c)>;

  /// `device`: outlives the reader. `report`: is called in the reader's thread, only for cameras that state
  /// their temperature.
  TemperatureReader(const OpenDevice& device, std::uint16_t vendor, Report report) {
    if (vendor != kRealSenseVendor) return;
    auto thread = startThread("temperature", [this, &device, vendor, report = std::move(report)] {
      do {
        report(temperatureOf(device, vendor));
      } while (!stop_signal_.waitUntil(Clock::now() + kPeriod));
    });
    if (thread) thread_ = std::move(*thread);
  }

  /// Waits for the control that is being asked.
  ~TemperatureReader() {
    stop_signal_.raise();
    if (thread_.joinable()) thread_.join();
  }

  TemperatureReader(const TemperatureReader&) = delete;
  TemperatureReader& operator=(const TemperatureReader&) = delete;

 private:
  StopSignal stop_signal_;
  std::thread thread_;  // not joinable: there is nothing to ask, or no thread
};

using std::chrono::milliseconds;

constexpr milliseconds kFirstFrameLimit{3000};  // a camera that was just opened adjusts its exposure first
constexpr milliseconds kFrameLimit{1000};
constexpr milliseconds kPollLimit{100};   // how long a stop may go unnoticed
constexpr std::uint32_t kMaxLost = 1000;  // a larger gap is a counter that started anew

base::Error failure(std::string what, std::string remedy) {
  return {"v4l2", std::move(what), std::move(remedy)};
}

std::string identityOf(const VideoDevice& video, const std::string& serial) {
  const std::string& shown = video.serial.empty() ? serial : video.serial;
  return shown.empty() ? "v4l2 " + video.node : "v4l2 " + shown;
}

/// The metadata node of a camera that has one, and its newest buffers.
struct Metadata {
  explicit Metadata(std::unique_ptr<OpenDevice> opened)
      : device(std::move(opened)), stream(*device, V4L2_BUF_TYPE_META_CAPTURE) {}

  /// Returns the age of the exposure of a frame at the start of its transmission, if its metadata has come.
  std::optional<std::int64_t> ageOf(std::uint32_t sequence) {
    for (;;) {
      const auto taken = stream.take();
      if (!taken || !*taken) break;
      const auto metadata = depthMetadataFrom((*taken)->bytes);
      newest_sequence = (*taken)->sequence;
      newest_age_ns = metadata ? exposureAge_ns(*metadata) : std::nullopt;
      if (!stream.giveBack(**taken) || newest_sequence == sequence) break;
    }
    return newest_sequence == sequence ? newest_age_ns : std::nullopt;
  }

  std::unique_ptr<OpenDevice> device;
  CaptureStream stream;
  std::optional<std::uint32_t> newest_sequence;
  std::optional<std::int64_t> newest_age_ns;
};

/// Searches for the camera, delivers its frames, and starts again when it is lost. The driver does not wait
/// for the up to 5 s that the kernel takes for a control that a camera does not answer.
class V4l2Worker final : public CameraWorker {
 public:
  V4l2Worker(config::CameraSettings settings, std::shared_ptr<SystemCalls> calls, std::filesystem::path root,
             FrameSink& sink)
      : CameraWorker("v4l2"),
        settings_(std::move(settings)),
        calls_(std::move(calls)),
        root_(std::move(root)),
        sink_(sink) {}

  void requestStop() override {
    stop_signal_.raise();
    const std::lock_guard lock(mutex_);
    stop_requested_ = true;
  }

 private:
  /// A camera's node with depth.
  struct Chosen {
    VideoDevice video;
    std::unique_ptr<OpenDevice> device;
    Capability capability;
  };

  base::Result<void> useCamera() override {
    auto camera = chosenDevice();
    if (!camera) return std::unexpected(camera.error());
    // first, because it fails while another program streams, whose camera must not be set anew
    const rt::DepthModelParameters wanted = settings_.effectiveDepthModel();
    const auto format =
        negotiateDepth(*camera->device, camera->capability.depth_format, {wanted.width_px, wanted.height_px},
                       settings_.of<V4l2Settings>().rate_hz);
    if (!format) return std::unexpected(format.error());
    const auto report = prepareCamera(*camera->device, camera->video.vendor, settings_);
    if (!report) return std::unexpected(report.error());
    if (stop_signal_.raised()) return {};
    board_.setIdentity(identityOf(camera->video, report->serial));
    const auto completed = completedModel(settings_, *report, camera->video.vendor);
    if (!completed) return std::unexpected(completed.error());
    board_.update([&](CameraStatus& status) {
      status.details = {camera->video.node,
                        report->serial,
                        report->firmware,
                        fourccText(format->pixels),
                        format->size.width_px,
                        format->size.height_px,
                        static_cast<double>(settings_.of<V4l2Settings>().rate_hz),
                        std::nullopt};
    });
    return deliver(*camera, *format, completed->model, completed->advice);
  }

  base::Result<Chosen> chosenDevice() {
    const auto candidates = candidatesOf(settings_, videoDevices(root_));
    if (!candidates) return std::unexpected(candidates.error());
    std::optional<base::Error> problem;
    for (const VideoDevice& video : *candidates) {
      auto device = std::make_unique<OpenDevice>(*calls_, calls_->open(video.node));
      if (device->descriptor() < 0) {
        problem = callFailure("open", device->descriptor());
        continue;
      }
      const auto capability = capabilityOf(*device);
      if (!capability) problem = capability.error();
      if (!capability || capability->depth_format == 0) continue;
      return Chosen{video, std::move(device), *capability};
    }
    if (problem) return std::unexpected(*problem);
    return std::unexpected(failure(
        "none of the video devices delivers depth (formats Z16, Y16)",
        "connect a depth camera; hapticctl doctor names the cameras that need their vendor's software"));
  }

  std::unique_ptr<Metadata> startedMetadata(const Chosen& camera) {
    if (camera.video.usb_interface.empty()) return nullptr;
    for (const VideoDevice& video : videoDevices(root_)) {
      if (video.usb_interface != camera.video.usb_interface || video.index != camera.video.index + 1)
        continue;
      auto device = std::make_unique<OpenDevice>(*calls_, calls_->open(video.node));
      if (device->descriptor() < 0) continue;
      const auto capability = capabilityOf(*device);
      if (!capability || !capability->is_metadata || !negotiateMetadata(*device)) continue;
      auto metadata = std::make_unique<Metadata>(std::move(device));
      if (metadata->stream.start()) return metadata;
    }
    return nullptr;
  }

  base::Result<void> deliver(const Chosen& camera, const StreamFormat& format,
                             const rt::DepthModelParameters& model, std::string advice) {
    const std::unique_ptr<Metadata> metadata = startedMetadata(camera);
    CaptureStream stream(*camera.device, V4L2_BUF_TYPE_VIDEO_CAPTURE);
    if (auto started = stream.start(); !started) return started;
    board_.setAdvice(std::move(advice));
    const TemperatureReader temperature(*camera.device, camera.video.vendor, [this](auto temperature_c) {
      board_.update([&](CameraStatus& status) { status.details.temperature_c = temperature_c; });
    });
    auto ended = takeUntilLost(*camera.device, stream, format, model, metadata.get());
    show(ended);  // at once: the reader of the temperature may have to wait for a camera that does not answer
    return ended;
  }

  base::Result<void> takeUntilLost(const OpenDevice& device, CaptureStream& stream,
                                   const StreamFormat& format, const rt::DepthModelParameters& model,
                                   Metadata* metadata) {
    last_sequence_.reset();
    last_frame_ = Clock::now() + (kFirstFrameLimit - kFrameLimit);
    while (!stop_signal_.raised()) {
      const int events = calls_->poll(device.descriptor(), kPollLimit);
      if (events < 0) return std::unexpected(callFailure("poll", events));
      if (events != 0) {
        // an error event says nothing of its cause; taking a frame then does
        if (auto taken = takeFrames(stream, format, model, metadata); !taken) return taken;
      }
      if ((events & (POLLERR | POLLHUP | POLLNVAL)) != 0) return std::unexpected(callFailure("poll", -EIO));
      if (Clock::now() - last_frame_ > kFrameLimit) {
        return std::unexpected(
            failure("the camera has stopped sending frames", "check its USB cable and port"));
      }
    }
    return {};
  }

  base::Result<void> takeFrames(CaptureStream& stream, const StreamFormat& format,
                                const rt::DepthModelParameters& model, Metadata* metadata) {
    const auto taken = stream.take();
    if (!taken) return std::unexpected(taken.error());
    if (!*taken) return {};
    const FilledBuffer& buffer = **taken;
    last_frame_ = Clock::now();
    countLostBefore(buffer.sequence);
    if (buffer.is_damaged) {
      board_.countDamagedFrame("the kernel has flagged it as damaged");
    } else if (buffer.bytes.size() < format.bytes) {
      board_.countDamagedFrame(fmt::format("{} of {} bytes arrived", buffer.bytes.size(), format.bytes));
    } else {
      publish(buffer, format, model, metadata);
    }
    return stream.giveBack(buffer);
  }

  /// The kernel numbers what the camera sends, and drops without a word what is damaged or finds no buffer.
  void countLostBefore(std::uint32_t sequence) {
    const std::uint32_t step = last_sequence_ ? sequence - *last_sequence_ : 1;
    last_sequence_ = sequence;
    if (step < 2 || step > kMaxLost) return;
    board_.countLostFrames(step - 1,
                           fmt::format("lost before frame {} of the stream: {}, damaged on the way or "
                                       "too many for this computer",
                                       sequence, step - 1));
  }

  void publish(const FilledBuffer& buffer, const StreamFormat& format, const rt::DepthModelParameters& model,
               Metadata* metadata) {
    const std::size_t row_bytes = static_cast<std::size_t>(model.width_px) * sizeof(std::uint16_t);
    const std::optional<std::int64_t> age_ns =
        metadata != nullptr ? metadata->ageOf(buffer.sequence) : std::nullopt;
    const std::lock_guard lock(mutex_);
    if (stop_requested_) return;
    rt::DepthFrame& frame = sink_.back();
    frame.camera = model;
    std::span<std::uint16_t> padded = frame.image();
    const auto stride = static_cast<std::size_t>(rt::strideOf(model.width_px));
    for (std::size_t first_byte = 0; !padded.empty(); padded = padded.subspan(stride)) {
      const Bytes line = buffer.bytes.subspan(first_byte, row_bytes);
      std::memcpy(padded.data(), line.data(), row_bytes);
      std::ranges::fill(padded.first(stride).subspan(static_cast<std::size_t>(model.width_px)),
                        model.raw_no_measurement);
      first_byte += format.bytes_per_line;
    }
    frame.sequence = ++published_;
    frame.arrival_ns = rt::monotonicNow_ns();
    frame.exposure_ns = age_ns && buffer.time_ns > 0 ? buffer.time_ns - *age_ns : 0;
    frame.device_ticks = buffer.sequence;
    seen_ = true;
    sink_.publish();
    board_.countFrame();
  }

  const config::CameraSettings settings_;
  const std::shared_ptr<SystemCalls> calls_;
  const std::filesystem::path root_;
  FrameSink& sink_;
  std::uint64_t published_ = 0;                 // run() only
  Clock::time_point last_frame_;                // run() only
  std::optional<std::uint32_t> last_sequence_;  // run() only, of this stream

  std::mutex mutex_;
  bool stop_requested_ = false;
};

}  // namespace

V4l2Camera::V4l2Camera(const config::CameraSettings& settings, std::shared_ptr<SystemCalls> calls,
                       std::filesystem::path root)
    : WorkerCamera({.name = "v4l2",
                    .identity = "v4l2",
                    .stop_limit = milliseconds(3000),
                    .make = [=](FrameSink& sink) {
                      return std::make_shared<V4l2Worker>(settings, calls, root, sink);
                    }}) {}

std::unique_ptr<Camera> makeV4l2Camera(const config::CameraSettings& settings) {
  return std::make_unique<V4l2Camera>(settings);
}

}  // namespace hapticd::drivers
