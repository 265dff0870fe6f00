// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/v4l2_capture.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace hapticd::test::uvc {
namespace {

constexpr std::uint32_t kBuffers = 8;

template <typename Argument>
bool request(int file, unsigned long code, Argument& argument) {
  int result = 0;
  do {
    result = ::ioctl(file, code, &argument);
  } while (result < 0 && errno == EINTR);
  return result == 0;
}

std::uint32_t codeOf(const std::string& fourcc) {
  std::uint32_t code = 0;
  std::memcpy(&code, fourcc.data(), sizeof code);
  return code;
}

}  // namespace

std::unexpected<base::Error> V4l2Capture::failed(const std::string& what) const {
  return std::unexpected(base::Error{device_, what + ": " + std::strerror(errno), ""});
}

base::Result<std::unique_ptr<V4l2Capture>> V4l2Capture::start(const std::string& device,
                                                              const CaptureFormat& format) {
  std::unique_ptr<V4l2Capture> capture(new V4l2Capture(device));
  capture->file_ = ::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (capture->file_ < 0) return capture->failed("open");
  if (auto done = capture->setFormat(format); !done) return std::unexpected(done.error());
  if (auto done = capture->setRate(format.rate_hz); !done) return std::unexpected(done.error());
  if (auto done = capture->shareBuffers(); !done) return std::unexpected(done.error());
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (!request(capture->file_, VIDIOC_STREAMON, type)) return capture->failed("VIDIOC_STREAMON");
  return capture;
}

V4l2Capture::~V4l2Capture() {
  if (file_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request(file_, VIDIOC_STREAMOFF, type);
  for (const Buffer& buffer : buffers_) ::munmap(buffer.begin, buffer.bytes);
  ::close(file_);
}

base::Result<void> V4l2Capture::setFormat(const CaptureFormat& format) {
  v4l2_format asked{};
  asked.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  asked.fmt.pix.width = format.width_px;
  asked.fmt.pix.height = format.height_px;
  asked.fmt.pix.pixelformat = codeOf(format.fourcc);
  asked.fmt.pix.field = V4L2_FIELD_NONE;
  if (!request(file_, VIDIOC_S_FMT, asked)) return failed("VIDIOC_S_FMT");
  const v4l2_pix_format& has = asked.fmt.pix;
  if (has.pixelformat == codeOf(format.fourcc) && has.width == format.width_px &&
      has.height == format.height_px) {
    return {};
  }
  std::string code(4, ' ');
  std::memcpy(code.data(), &has.pixelformat, code.size());
  return std::unexpected(
      base::Error{device_, fmt::format("offers {} {}x{} instead", code, has.width, has.height), ""});
}

base::Result<void> V4l2Capture::setRate(std::uint32_t rate_hz) {
  v4l2_streamparm asked{};
  asked.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  asked.parm.capture.timeperframe = {1, rate_hz};
  if (!request(file_, VIDIOC_S_PARM, asked)) return failed("VIDIOC_S_PARM");
  const v4l2_fract& has = asked.parm.capture.timeperframe;
  interval_us_ = static_cast<std::uint32_t>(std::uint64_t{has.numerator} * 1'000'000 / has.denominator);
  return {};
}

base::Result<void> V4l2Capture::shareBuffers() {
  v4l2_requestbuffers asked{};
  asked.count = kBuffers;
  asked.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  asked.memory = V4L2_MEMORY_MMAP;
  if (!request(file_, VIDIOC_REQBUFS, asked)) return failed("VIDIOC_REQBUFS");
  for (std::uint32_t index = 0; index < asked.count; ++index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (!request(file_, VIDIOC_QUERYBUF, buffer)) return failed("VIDIOC_QUERYBUF");
    void* const begin =
        ::mmap(nullptr, buffer.length, PROT_READ, MAP_SHARED, file_, static_cast<off_t>(buffer.m.offset));
    if (begin == MAP_FAILED) return failed("mmap");
    buffers_.push_back({begin, buffer.length});
    if (auto done = giveBack(index); !done) return done;
  }
  return {};
}

base::Result<void> V4l2Capture::giveBack(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (!request(file_, VIDIOC_QBUF, buffer)) return failed("VIDIOC_QBUF");
  return {};
}

base::Result<std::optional<CapturedFrame>> V4l2Capture::next(std::chrono::milliseconds patience) {
  if (const auto held = std::exchange(held_, std::nullopt)) {
    if (auto done = giveBack(*held); !done) return std::unexpected(done.error());
  }
  pollfd waiting{file_, POLLIN, 0};
  if (::poll(&waiting, 1, static_cast<int>(patience.count())) == 0) return std::nullopt;
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (!request(file_, VIDIOC_DQBUF, buffer)) {
    if (errno == EAGAIN) return std::nullopt;
    return failed("VIDIOC_DQBUF");
  }
  held_ = buffer.index;
  const auto* const pixels = static_cast<const std::uint16_t*>(buffers_[buffer.index].begin);
  return CapturedFrame{.pixels = {pixels, buffer.bytesused / sizeof(std::uint16_t)},
                       .sequence = buffer.sequence,
                       .bytes = buffer.bytesused,
                       .error = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0};
}

}  // namespace hapticd::test::uvc
