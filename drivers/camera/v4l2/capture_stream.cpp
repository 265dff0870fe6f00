// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/capture_stream.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace hapticd::drivers {
namespace {

constexpr std::uint32_t kVideo = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr std::uint32_t kBuffers = 4;
constexpr std::size_t kBytesPerPixel = 2;
constexpr std::uint32_t kMaxEntries = 64;  // of a list that a device may never end
constexpr double kMaxRate_hz = 1000;       // the kernel makes 10 MHz of an interval that is not stated

base::Error failure(std::string what, std::string remedy) {
  return {"v4l2", std::move(what), std::move(remedy)};
}

std::string offeredSizes(const OpenDevice& device, std::uint32_t pixels) {
  std::vector<std::string> sizes;
  for (std::uint32_t index = 0; index < kMaxEntries; ++index) {
    v4l2_frmsizeenum size{};
    size.index = index;
    size.pixel_format = pixels;
    if (device.ioctl(VIDIOC_ENUM_FRAMESIZES, &size) < 0 || size.type != V4L2_FRMSIZE_TYPE_DISCRETE) break;
    if (size.discrete.width == 0 || size.discrete.height == 0) continue;
    sizes.push_back(fmt::format("{} x {}", size.discrete.width, size.discrete.height));
  }
  return sizes.empty() ? "not listed" : fmt::format("{}", fmt::join(sizes, ", "));
}

std::string offeredRates(const OpenDevice& device, std::uint32_t pixels, FrameSize size) {
  std::vector<std::string> rates;
  for (std::uint32_t index = 0; index < kMaxEntries; ++index) {
    v4l2_frmivalenum interval{};
    interval.index = index;
    interval.pixel_format = pixels;
    interval.width = static_cast<std::uint32_t>(size.width_px);
    interval.height = static_cast<std::uint32_t>(size.height_px);
    if (device.ioctl(VIDIOC_ENUM_FRAMEINTERVALS, &interval) < 0) break;
    if (interval.type != V4L2_FRMIVAL_TYPE_DISCRETE || interval.discrete.numerator == 0) break;
    const double rate_hz = static_cast<double>(interval.discrete.denominator) / interval.discrete.numerator;
    if (rate_hz <= kMaxRate_hz) rates.push_back(fmt::format("{:.4g}", rate_hz));
  }
  return rates.empty() ? "not listed" : fmt::format("{}", fmt::join(rates, ", "));
}

base::Result<void> setRate(const OpenDevice& device, std::uint32_t pixels, FrameSize size, int rate_hz) {
  v4l2_streamparm parameters{};
  parameters.type = kVideo;
  parameters.parm.capture.timeperframe = {1, static_cast<std::uint32_t>(rate_hz)};
  const int result = device.ioctl(VIDIOC_S_PARM, &parameters);
  if (result == -ENOTTY) return {};  // a device without a choice of rates
  if (result < 0) return std::unexpected(callFailure("VIDIOC_S_PARM", result));
  const v4l2_fract& period = parameters.parm.capture.timeperframe;
  if (period.numerator > 0 &&
      std::abs(static_cast<double>(period.denominator) / period.numerator / rate_hz - 1) < 0.02) {
    return {};
  }
  return std::unexpected(failure(
      fmt::format("the camera does not send {} x {} at {} Hz", size.width_px, size.height_px, rate_hz),
      fmt::format("set camera.rate_hz to one of: {}", offeredRates(device, pixels, size))));
}

}  // namespace

std::string fourccText(std::uint32_t code) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) {
    const char letter = static_cast<char>((code >> shift) & 0x7F);
    text += letter > ' ' && letter <= '~' ? std::string(1, letter) : "";
  }
  return text;
}

base::Error callFailure(const char* call, int result) {
  if (result == -ENODEV) return failure("the camera is gone", "check its USB cable");
  if (result == -EBUSY) {
    return failure("another program uses the camera", "end it; fuser -v /dev/video* shows which one");
  }
  if (result == -EACCES || result == -EPERM) {
    return failure("the camera cannot be opened: " + std::string(std::strerror(-result)),
                   "install hapticd's udev rules, or add the user to the group video");
  }
  return failure(fmt::format("{} fails: {}", call, std::strerror(-result)),
                 "unplug the camera, wait a moment and plug it in again");
}

base::Result<Capability> capabilityOf(const OpenDevice& device) {
  v4l2_capability answer{};
  if (const int result = device.ioctl(VIDIOC_QUERYCAP, &answer); result < 0) {
    return std::unexpected(callFailure("VIDIOC_QUERYCAP", result));
  }
  const std::uint32_t flags =
      (answer.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? answer.device_caps : answer.capabilities;
  Capability capability;
  capability.is_capture = (flags & V4L2_CAP_VIDEO_CAPTURE) != 0 && (flags & V4L2_CAP_STREAMING) != 0;
  capability.is_metadata = (flags & V4L2_CAP_META_CAPTURE) != 0;
  const auto* const bus = reinterpret_cast<const char*>(answer.bus_info);
  capability.bus.assign(bus, strnlen(bus, sizeof answer.bus_info));
  for (std::uint32_t index = 0; capability.is_capture && index < kMaxEntries; ++index) {
    v4l2_fmtdesc format{};
    format.index = index;
    format.type = kVideo;
    if (device.ioctl(VIDIOC_ENUM_FMT, &format) < 0) break;
    if (format.pixelformat == V4L2_PIX_FMT_Z16) capability.depth_format = V4L2_PIX_FMT_Z16;
    if (format.pixelformat == V4L2_PIX_FMT_Y16 && capability.depth_format == 0) {
      capability.depth_format = V4L2_PIX_FMT_Y16;
    }
  }
  return capability;
}

base::Result<StreamFormat> negotiateDepth(const OpenDevice& device, std::uint32_t pixels, FrameSize size,
                                          int rate_hz) {
  v4l2_format format{};
  format.type = kVideo;
  format.fmt.pix.width = static_cast<std::uint32_t>(size.width_px);
  format.fmt.pix.height = static_cast<std::uint32_t>(size.height_px);
  format.fmt.pix.pixelformat = pixels;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int result = device.ioctl(VIDIOC_S_FMT, &format); result < 0) {
    if (result == -EIO || result == -ETIMEDOUT) {  // uvcvideo has asked the camera itself
      return std::unexpected(failure("the camera does not answer when it is asked for a mode",
                                     "unplug the camera, wait a moment and plug it in again"));
    }
    return std::unexpected(callFailure("VIDIOC_S_FMT", result));
  }
  const v4l2_pix_format& answer = format.fmt.pix;
  if (answer.pixelformat != pixels) {
    return std::unexpected(failure(fmt::format("the camera answers with the format {} instead of {}",
                                               fourccText(answer.pixelformat), fourccText(pixels)),
                                   "set camera.device to the node with the camera's depth"));
  }
  if (answer.width != static_cast<std::uint32_t>(size.width_px) ||
      answer.height != static_cast<std::uint32_t>(size.height_px)) {
    return std::unexpected(failure(
        fmt::format("the camera answers with {} x {} instead of {} x {}", answer.width, answer.height,
                    size.width_px, size.height_px),
        fmt::format("set camera.width_px and camera.height_px to one of: {}", offeredSizes(device, pixels))));
  }
  const std::size_t row_bytes = static_cast<std::size_t>(size.width_px) * kBytesPerPixel;
  const std::size_t line_bytes = answer.bytesperline == 0 ? row_bytes : answer.bytesperline;
  const std::size_t needed = line_bytes * (static_cast<std::size_t>(size.height_px) - 1) + row_bytes;
  if (line_bytes < row_bytes || answer.sizeimage < needed) {
    return std::unexpected(
        failure(fmt::format("the camera announces {} bytes with lines of {} bytes for {} x {} pixels",
                            answer.sizeimage, line_bytes, size.width_px, size.height_px),
                "update the camera's firmware"));
  }
  if (auto rate = setRate(device, pixels, size, rate_hz); !rate) return std::unexpected(rate.error());
  return StreamFormat{pixels, size, line_bytes, needed};
}

base::Result<StreamFormat> negotiateMetadata(const OpenDevice& device) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_META_CAPTURE;
  format.fmt.meta.dataformat = V4L2_META_FMT_D4XX;
  if (const int result = device.ioctl(VIDIOC_S_FMT, &format); result < 0) {
    return std::unexpected(callFailure("VIDIOC_S_FMT", result));
  }
  if (format.fmt.meta.dataformat != V4L2_META_FMT_D4XX) {
    return std::unexpected(failure("the node has no metadata in the format D4XX", ""));
  }
  return StreamFormat{V4L2_META_FMT_D4XX, {}, 0, format.fmt.meta.buffersize};
}

CaptureStream::CaptureStream(const OpenDevice& device, std::uint32_t buffer_type)
    : device_(device), type_(buffer_type) {}

CaptureStream::~CaptureStream() {
  std::uint32_t type = type_;
  if (started_) device_.ioctl(VIDIOC_STREAMOFF, &type);
  for (const Bytes buffer : buffers_) device_.calls().unmap(buffer.data(), buffer.size());
  if (buffers_.empty()) return;
  v4l2_requestbuffers request{};
  request.type = type_;
  request.memory = V4L2_MEMORY_MMAP;
  device_.ioctl(VIDIOC_REQBUFS, &request);
}

base::Result<void> CaptureStream::start() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = type_;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int result = device_.ioctl(VIDIOC_REQBUFS, &request); result < 0) {
    return std::unexpected(callFailure("VIDIOC_REQBUFS", result));
  }
  if (request.count < 2) {
    return std::unexpected(
        failure(fmt::format("the driver has {} buffers instead of {}", request.count, kBuffers),
                "free memory, then start hapticd again"));
  }
  for (std::uint32_t index = 0; index < request.count; ++index) {
    if (auto mapped = mapBuffer(index); !mapped) return mapped;
    if (auto queued = queue(index); !queued) return queued;
  }
  std::uint32_t type = type_;
  if (const int result = device_.ioctl(VIDIOC_STREAMON, &type); result < 0) {
    if (result == -ENOSPC) {
      return std::unexpected(failure("the USB bus has no bandwidth left for this mode",
                                     "plug the camera into a port of another controller, or lower "
                                     "camera.width_px, camera.height_px or camera.rate_hz"));
    }
    return std::unexpected(callFailure("VIDIOC_STREAMON", result));
  }
  started_ = true;
  return {};
}

base::Result<void> CaptureStream::mapBuffer(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = type_;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  if (const int result = device_.ioctl(VIDIOC_QUERYBUF, &buffer); result < 0) {
    return std::unexpected(callFailure("VIDIOC_QUERYBUF", result));
  }
  const std::byte* const address = device_.calls().map(device_.descriptor(), buffer.length, buffer.m.offset);
  if (address == nullptr) {
    return std::unexpected(failure("a buffer of the camera cannot be mapped",
                                   "raise the limit of locked memory (LimitMEMLOCK= of the unit)"));
  }
  buffers_.emplace_back(address, buffer.length);
  return {};
}

base::Result<void> CaptureStream::queue(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = type_;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  const int result = device_.ioctl(VIDIOC_QBUF, &buffer);
  if (result < 0) return std::unexpected(callFailure("VIDIOC_QBUF", result));
  return {};
}

base::Result<std::optional<FilledBuffer>> CaptureStream::take() {
  v4l2_buffer buffer{};
  buffer.type = type_;
  buffer.memory = V4L2_MEMORY_MMAP;
  const int result = device_.ioctl(VIDIOC_DQBUF, &buffer);
  if (result == -EAGAIN) return std::nullopt;
  if (result < 0) return std::unexpected(callFailure("VIDIOC_DQBUF", result));
  if (buffer.index >= buffers_.size()) {
    return std::unexpected(
        failure(fmt::format("the driver returns buffer {} of {}", buffer.index, buffers_.size()),
                "start hapticd again"));
  }
  FilledBuffer filled;
  const Bytes whole = buffers_[buffer.index];
  filled.bytes = whole.first(std::min<std::size_t>(buffer.bytesused, whole.size()));
  filled.index = buffer.index;
  filled.sequence = buffer.sequence;
  filled.is_damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
    filled.time_ns = std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 + buffer.timestamp.tv_usec * 1000;
  }
  return filled;
}

base::Result<void> CaptureStream::giveBack(const FilledBuffer& buffer) {
  return queue(buffer.index);
}

}  // namespace hapticd::drivers
