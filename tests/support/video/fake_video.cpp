// SPDX-License-Identifier: Apache-2.0
#include "tests/support/video/fake_video.h"

#include <linux/usb/video.h>
#include <linux/uvcvideo.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <thread>

#include "tests/support/video/realsense_tables.h"

namespace hapticd::test {
namespace {

constexpr int kDescriptor = 100;
constexpr int kMetadataDescriptor = 101;
constexpr const char* kNode = "/dev/video0";
constexpr const char* kMetadataNode = "/dev/video1";
constexpr std::uint32_t kMetadataOffset = 1000;  // of its buffers, for mmap
constexpr std::uint32_t kMetadataBytes = 62;
constexpr std::uint8_t kTemperatures = 9;  // selector

std::uint32_t wordAt(const std::vector<std::byte>& bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, sizeof word);
  return word;
}

}  // namespace

FakeVideo::FakeVideo() {
  camera_.format = V4L2_PIX_FMT_Z16;
  camera_.table = coefficientsTable();
  camera_.modes = depthModes();
}

std::size_t FakeVideo::frameBytes() const {
  const std::size_t line = camera_.line_bytes > 0 ? camera_.line_bytes : std::size_t{camera_.width} * 2;
  return line * camera_.height;
}

SentFrame FakeVideo::countingFrame(std::uint16_t first) {
  const std::lock_guard lock(mutex_);
  SentFrame frame;
  frame.pixels.resize(frameBytes() / 2);
  for (std::uint16_t& pixel : frame.pixels) pixel = first++;
  frame.bytes = frameBytes();
  return frame;
}

void FakeVideo::send(SentFrame frame) {
  const std::lock_guard lock(mutex_);
  sent_.push_back(std::move(frame));
}

std::map<int, std::vector<std::byte>> FakeVideo::controls() {
  const std::lock_guard lock(mutex_);
  return controls_;
}

int FakeVideo::opened() {
  const std::lock_guard lock(mutex_);
  return opened_;
}

int FakeVideo::descriptors() {
  const std::lock_guard lock(mutex_);
  return descriptors_;
}

int FakeVideo::mappings() {
  const std::lock_guard lock(mutex_);
  return mappings_;
}

int FakeVideo::open(const std::string& path) {
  const std::lock_guard lock(mutex_);
  if ((path != kNode && path != kMetadataNode) || !camera_.plugged) return -ENOENT;
  ++descriptors_;
  if (path == kMetadataNode) return kMetadataDescriptor;
  ++opened_;
  return kDescriptor;
}

void FakeVideo::close(int descriptor) {
  const std::lock_guard lock(mutex_);
  --descriptors_;
  if (descriptor != kDescriptor) return;
  streaming_ = false;
  queued_.clear();
}

const std::byte* FakeVideo::map(int descriptor, std::size_t bytes, std::size_t offset) {
  const std::lock_guard lock(mutex_);
  if (descriptor == kMetadataDescriptor) {
    ++mappings_;
    return metadata_buffers_.at(offset - kMetadataOffset).data();
  }
  if (offset >= buffers_.size() || buffers_[offset].size() != bytes) return nullptr;
  ++mappings_;
  return buffers_[offset].data();
}

void FakeVideo::unmap(const std::byte* /*address*/, std::size_t /*bytes*/) {
  const std::lock_guard lock(mutex_);
  --mappings_;
}

int FakeVideo::poll(int /*descriptor*/, std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  do {
    {
      const std::lock_guard lock(mutex_);
      if (!camera_.plugged) return POLLERR | POLLHUP;
      if (camera_.queue_fails) return POLLERR;
      if (streaming_ && !sent_.empty() && !queued_.empty()) return POLLIN;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  } while (std::chrono::steady_clock::now() < end);
  return 0;
}

int FakeVideo::ioctl(int descriptor, unsigned long request, void* argument) {
  if (request == UVCIOC_CTRL_QUERY &&
      static_cast<uvc_xu_control_query*>(argument)->selector == kTemperatures) {
    std::this_thread::sleep_for(temperatureDelay());
  }
  const std::lock_guard lock(mutex_);
  if (!camera_.plugged) return -ENODEV;
  if (descriptor == kMetadataDescriptor) return answerMetadata(request, argument);
  return request == UVCIOC_CTRL_QUERY ? query(argument) : answer(request, argument);
}

std::chrono::milliseconds FakeVideo::temperatureDelay() {
  const std::lock_guard lock(mutex_);
  return camera_.temperature_delay;
}

int FakeVideo::answer(unsigned long request, void* argument) {
  auto* const buffer = static_cast<v4l2_buffer*>(argument);
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& capability = *static_cast<v4l2_capability*>(argument);
      capability.capabilities = V4L2_CAP_DEVICE_CAPS;
      capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      auto& format = *static_cast<v4l2_fmtdesc*>(argument);
      if (format.index > 0) return -EINVAL;
      format.pixelformat = camera_.format;
      return 0;
    }
    case VIDIOC_S_FMT: {
      if (camera_.in_use) return -EBUSY;
      if (!camera_.negotiates) return -EIO;
      auto& pixels = static_cast<v4l2_format*>(argument)->fmt.pix;
      pixels.width = camera_.width;
      pixels.height = camera_.height;
      pixels.pixelformat = camera_.format;
      pixels.bytesperline = camera_.line_bytes > 0 ? camera_.line_bytes : camera_.width * 2;
      pixels.sizeimage = static_cast<std::uint32_t>(frameBytes());
      return 0;
    }
    case VIDIOC_S_PARM:
      static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {1, camera_.rate_hz};
      return 0;
    case VIDIOC_ENUM_FRAMESIZES: {
      auto& size = *static_cast<v4l2_frmsizeenum*>(argument);
      if (size.index > 0) return -EINVAL;
      size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      size.discrete = {camera_.width, camera_.height};
      return 0;
    }
    case VIDIOC_ENUM_FRAMEINTERVALS: {
      auto& interval = *static_cast<v4l2_frmivalenum*>(argument);
      if (interval.index > 0) return -EINVAL;
      interval.type = V4L2_FRMIVAL_TYPE_DISCRETE;
      interval.discrete = {1, camera_.rate_hz};
      return 0;
    }
    case VIDIOC_REQBUFS:
      buffers_.assign(static_cast<v4l2_requestbuffers*>(argument)->count,
                      std::vector<std::byte>(frameBytes()));
      return 0;
    case VIDIOC_QUERYBUF:
      buffer->length = static_cast<std::uint32_t>(frameBytes());
      buffer->m.offset = buffer->index;
      return 0;
    case VIDIOC_QBUF:
      queued_.push_back(buffer->index);
      return 0;
    case VIDIOC_STREAMON:
      streaming_ = true;
      return 0;
    case VIDIOC_STREAMOFF:
      streaming_ = false;
      queued_.clear();
      return 0;
    case VIDIOC_DQBUF: {
      if (camera_.queue_fails) return -EIO;
      if (sent_.empty() || queued_.empty()) return -EAGAIN;
      const SentFrame frame = std::move(sent_.front());
      sent_.pop_front();
      buffer->index = queued_.front();
      queued_.pop_front();
      std::vector<std::byte>& memory = buffers_.at(buffer->index);
      std::memcpy(memory.data(), frame.pixels.data(), std::min(memory.size(), frame.pixels.size() * 2));
      buffer->bytesused = static_cast<std::uint32_t>(frame.bytes);
      sequence_ += frame.lost_before;
      metadata_sent_.push_back(sequence_);
      buffer->sequence = sequence_++;
      buffer->timestamp.tv_sec = 100;
      buffer->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
      if (frame.is_damaged) buffer->flags |= V4L2_BUF_FLAG_ERROR;
      return 0;
    }
    default:
      return -ENOTTY;
  }
}

int FakeVideo::answerMetadata(unsigned long request, void* argument) {
  auto* const buffer = static_cast<v4l2_buffer*>(argument);
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& capability = *static_cast<v4l2_capability*>(argument);
      capability.capabilities = V4L2_CAP_DEVICE_CAPS;
      capability.device_caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    }
    case VIDIOC_S_FMT:
      static_cast<v4l2_format*>(argument)->fmt.meta.buffersize = kMetadataBytes;
      return 0;
    case VIDIOC_REQBUFS:
      metadata_buffers_.assign(static_cast<v4l2_requestbuffers*>(argument)->count,
                               std::vector<std::byte>(kMetadataBytes));
      return 0;
    case VIDIOC_QUERYBUF:
      buffer->length = kMetadataBytes;
      buffer->m.offset = kMetadataOffset + buffer->index;
      return 0;
    case VIDIOC_QBUF:
      metadata_queued_.push_back(buffer->index);
      return 0;
    case VIDIOC_STREAMON:
      return 0;
    case VIDIOC_STREAMOFF:
      metadata_queued_.clear();
      return 0;
    case VIDIOC_DQBUF: {
      if (metadata_sent_.empty() || metadata_queued_.empty()) return -EAGAIN;
      buffer->sequence = metadata_sent_.front();
      metadata_sent_.pop_front();
      buffer->index = metadata_queued_.front();
      metadata_queued_.pop_front();
      std::vector<std::byte>& bytes = metadata_buffers_.at(buffer->index);
      bytes[10] = std::byte{52};  // header with both time stamps, then one block
      bytes[11] = std::byte{0x0C};
      put(bytes, 22, 0x80000001U);
      put(bytes, 26, 40U);
      put(bytes, 42, 8'000U);   // optical time
      put(bytes, 58, 30'000U);  // pipe latency
      buffer->bytesused = kMetadataBytes;
      return 0;
    }
    default:
      return -ENOTTY;
  }
}

int FakeVideo::query(void* argument) {
  const auto& request = *static_cast<uvc_xu_control_query*>(argument);
  if (camera_.control_result < 0) return camera_.control_result;
  if (request.unit != 3) return -ENOENT;
  auto* const data = reinterpret_cast<std::byte*>(request.data);
  if (request.query == UVC_SET_CUR) {
    const std::vector<std::byte> bytes(data, data + request.size);
    if (request.selector == 1) {
      runCommand(bytes);
    } else {
      controls_[request.selector] = bytes;
    }
    return 0;
  }
  if (request.selector == kTemperatures && request.size == 4) {
    std::ranges::copy(std::array{std::byte{1}, std::byte{1}, std::byte{31}, std::byte{38}}, data);
    return 0;
  }
  if (request.selector != 1 || request.size != 1024) return -EINVAL;
  std::ranges::copy(reply_, data);
  return 0;
}

void FakeVideo::runCommand(const std::vector<std::byte>& request) {
  const std::uint32_t command = wordAt(request, 4);
  std::vector<std::byte> depth_table(20);
  put(depth_table, 12, camera_.disparity_mode);
  switch (command) {
    case 0x10:
      reply_ = monitorReply(command, deviceData());
      return;
    case 0x15:
      reply_ = monitorReply(command, camera_.table);
      return;
    case 0x7E:
      reply_ = monitorReply(command, camera_.modes);
      if (!camera_.has_depth_modes) put(reply_, 0, std::int32_t{-2});
      return;
    case 0x2B:
      if (!camera_.keeps_unit) camera_.unit_um = wordAt(request, 24);
      reply_ = monitorReply(command, {});
      return;
    case 0x2C:
      put(depth_table, 0, camera_.unit_um);
      reply_ = monitorReply(command, depth_table);
      return;
    default:
      reply_ = monitorReply(command, {});
  }
}

}  // namespace hapticd::test
