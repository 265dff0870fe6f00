// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/depth_stream.h"

#include <linux/usb/video.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "tests/vm/emulators/uvc/uvc_descriptors.h"

namespace hapticd::test::uvc {
namespace {

constexpr std::size_t kBytes = 34;  // of PROBE and COMMIT in UVC 1.1
constexpr std::size_t kFormatAt = 2;
constexpr std::size_t kFrameAt = 3;
constexpr std::size_t kIntervalAt = 4;
constexpr std::uint16_t kHintInterval = 1;  // bmHint: the interval is to be kept

std::uint32_t nearestInterval(const DepthMode& mode, std::uint32_t interval) {
  if (interval == 0) return intervalOf(mode.rates_hz.front());
  const auto distance = [interval](std::uint16_t rate_hz) {
    return std::llabs(std::int64_t{intervalOf(rate_hz)} - std::int64_t{interval});
  };
  return intervalOf(*std::ranges::min_element(mode.rates_hz, {}, distance));
}

}  // namespace

StreamingControl::StreamingControl(const CameraModel& model, std::size_t header_bytes)
    : model_(model), header_bytes_(header_bytes) {
  reset();
}

void StreamingControl::reset() {
  probed_ = {0, intervalOf(model_.modes.front().rates_hz.front())};
  committed_.reset();
}

std::optional<std::span<const std::uint8_t>> StreamingControl::get(std::uint8_t selector,
                                                                   std::uint8_t request) {
  if (selector != UVC_VS_PROBE_CONTROL && selector != UVC_VS_COMMIT_CONTROL) return std::nullopt;
  const StreamMode first{0, intervalOf(model_.modes.front().rates_hz.front())};
  switch (request) {
    case UVC_GET_CUR:
      answer_ = encode(selector == UVC_VS_COMMIT_CONTROL && committed_ ? *committed_ : probed_);
      return answer_;
    case UVC_GET_MIN:
    case UVC_GET_MAX:
    case UVC_GET_DEF:
      if (selector != UVC_VS_PROBE_CONTROL) return std::nullopt;
      answer_ = encode(first);
      return answer_;
    case UVC_GET_LEN:
      answer_ = {kBytes, 0};
      return answer_;
    case UVC_GET_INFO:
      answer_ = {UVC_CONTROL_CAP_GET | UVC_CONTROL_CAP_SET};
      return answer_;
    default:
      return std::nullopt;
  }
}

bool StreamingControl::set(std::uint8_t selector, std::span<const std::uint8_t> data) {
  if (data.size() != kBytes) return false;
  if (selector == UVC_VS_PROBE_CONTROL) {
    probed_ = agree(data);
    return true;
  }
  if (selector != UVC_VS_COMMIT_CONTROL) return false;
  committed_ = agree(data);
  return true;
}

StreamMode StreamingControl::agree(std::span<const std::uint8_t> proposal) const {
  const std::size_t frame = proposal[kFrameAt];
  const std::size_t index =
      proposal[kFormatAt] <= 1 && frame >= 1 && frame <= model_.modes.size() ? frame - 1 : 0;
  return {index, nearestInterval(model_.modes[index], get32(proposal, kIntervalAt))};
}

Bytes StreamingControl::encode(const StreamMode& stream) const {
  const std::uint32_t bytes = frameBytes(model_.modes[stream.mode]);
  Bytes encoded;
  ByteWriter out(encoded);
  out.u16(kHintInterval).u8(1).u8(static_cast<std::uint8_t>(stream.mode + 1)).u32(stream.interval_100ns);
  out.zeros(8).u16(0);  // key frames, compression; internal delay in milliseconds
  out.u32(lies_ ? bytes / 2 : bytes).u32(bytes + static_cast<std::uint32_t>(header_bytes_));
  out.u32(kClockHz).u8(0).u8(0).u8(0).u8(0);  // framing and versions do not matter for uncompressed frames
  return encoded;
}

namespace {

constexpr std::size_t kStandardBytes = 12;
constexpr std::uint32_t kTimingBytes = 40;
constexpr std::uint32_t kConfigurationBytes = 40;
constexpr std::uint32_t kDepthControlBytes = 60;

constexpr std::uint32_t kDepthControlId = 0x80000000;
constexpr std::uint32_t kTimingId = 0x80000001;
constexpr std::uint32_t kConfigurationId = 0x80000002;

void addTiming(ByteWriter& out, const FrameTimes& times) {
  constexpr std::uint32_t kAllValid = 0x3f;
  out.u32(kTimingId).u32(kTimingBytes).u32(1).u32(kAllValid).u32(times.number);
  out.u32(times.exposure_us / 2);  // from the beginning of the frame to its middle
  out.u32(times.interval_us / 2).u32(times.exposure_us).u32(times.interval_us);
  out.u32(times.sent_us - times.exposure_start_us);
}

void addConfiguration(ByteWriter& out, const DepthMode& mode, const FrameTimes& times) {
  constexpr std::uint32_t kValid = 0xff;
  constexpr std::uint32_t kMicrosecondsPerSecond = 1'000'000;
  out.u32(kConfigurationId).u32(kConfigurationBytes).u32(3).u32(kValid);
  out.u8(0).u8(0b1101).u32(0).u16(1).u16(mode.width_px).u16(mode.height_px);
  out.u16(static_cast<std::uint16_t>(kMicrosecondsPerSecond / times.interval_us)).u16(0);
  out.zeros(8);  // calibration count, GPIO, sub-preset, reserved
}

void addDepthControl(ByteWriter& out, const DepthMode& mode, const FrameTimes& times) {
  constexpr std::uint32_t kValid = 0xff;
  out.u32(kDepthControlId).u32(kDepthControlBytes).u32(3).u32(kValid);
  out.u32(16).u32(times.exposure_us).u32(150).u32(1).u32(0);
  out.u32(0).u32(mode.width_px - 1U).u32(0).u32(mode.height_px - 1U).u32(0).u8(1).u8(0).u16(0);
}

}  // namespace

std::size_t payloadHeaderBytes(const CameraModel& model) {
  const bool metadata = model.protocol == Protocol::realsense;
  return kStandardBytes + (metadata ? kTimingBytes + kConfigurationBytes + kDepthControlBytes : 0);
}

Bytes payloadHeader(const CameraModel& model, const DepthMode& mode, const FrameTimes& times, bool frame_id) {
  Bytes header;
  ByteWriter out(header);
  out.u8(static_cast<std::uint8_t>(payloadHeaderBytes(model)));
  out.u8(static_cast<std::uint8_t>(UVC_STREAM_EOH | UVC_STREAM_EOF | UVC_STREAM_PTS | UVC_STREAM_SCR |
                                   (frame_id ? UVC_STREAM_FID : 0)));
  out.u32(times.exposure_start_us).u32(times.sent_us);
  out.u16(static_cast<std::uint16_t>(times.sent_us / 1000 & 0x7ff));  // the bus counts its frames, 1 ms each
  if (model.protocol != Protocol::realsense) return header;
  addTiming(out, times);
  addConfiguration(out, mode, times);
  addDepthControl(out, mode, times);
  return header;
}

namespace {

constexpr std::size_t kHeaderFlagsAt = 1;

std::uint32_t microseconds(std::int64_t time_ns) {
  return static_cast<std::uint32_t>(time_ns / 1000 & 0xffffffff);
}

}  // namespace

void DepthStream::start(const StreamMode& stream, std::uint32_t unit_um) {
  stream_ = stream;
  begun_ns_.reset();
  in_progress_ = false;
  next_number_ = number_ = 0;
  sent_ = skipped_ = 0;
  scene_.emplace(mode().width_px, mode().height_px, intrinsicsOf(model_, mode().width_px, mode().height_px),
                 unit_um);
  payload_.assign(2 * (payloadHeaderBytes(model_) + frameBytes(mode())),
                  0);  // its pages are there from now on
}

std::optional<std::int64_t> DepthStream::due_ns() const {
  if (!stream_ || !begun_ns_) return std::nullopt;
  return *begun_ns_ + std::int64_t{next_number_} * stream_->interval_100ns * 100;
}

void DepthStream::work(std::int64_t now_ns, usbip::PendingUrbs& urbs) {
  if (!stream_) return;
  if (!begun_ns_) {
    if (!urbs.isPending(kStreamEndpoint)) return;
    begun_ns_ = now_ns;
  }
  send(urbs);
  while (*due_ns() <= now_ns) {
    if (in_progress_) {
      ++next_number_;
      ++skipped_;
    } else {
      beginFrame(now_ns);
      send(urbs);
    }
  }
}

void DepthStream::beginFrame(std::int64_t now_ns) {
  number_ = next_number_++;
  spoiling_ = std::exchange(once_, std::nullopt);
  if (spoiling_) ++spoilt_;
  if (hasFault(Fault::silent)) return;
  if (!hasFault(Fault::frame_id_stuck)) frame_id_ = !frame_id_;
  makePayload(now_ns);
  payload_sent_ = 0;
  in_progress_ = true;
}

void DepthStream::makePayload(std::int64_t now_ns) {
  const std::uint32_t interval_us = stream_->interval_100ns / 10;
  const FrameTimes times{.number = number_,
                         .exposure_start_us = microseconds(now_ns) - interval_us,
                         .exposure_us = interval_us / 4,
                         .sent_us = microseconds(now_ns),
                         .interval_us = interval_us};
  const Bytes header = payloadHeader(model_, mode(), times, frame_id_);
  const std::size_t bytes = frameBytes(mode());
  payload_.resize(header.size() + bytes);
  std::ranges::copy(header, payload_.begin());
  if (!hasFault(Fault::frame_repeated)) {
    // a payload header of an even number of bytes keeps the pixels aligned
    auto* const pixels = reinterpret_cast<std::uint16_t*>(payload_.data() + header.size());
    scene_->write(frozen_.value_or(number_), {pixels, bytes / 2});
  }
  spoilHeader(header.size());
  spoilSize(header.size());
}

void DepthStream::spoilHeader(std::size_t header_bytes) {
  if (hasFault(Fault::error_bit)) payload_[kHeaderFlagsAt] |= UVC_STREAM_ERR;
  if (hasFault(Fault::header_long)) payload_[0] = 0xff;
  if (hasFault(Fault::header_short)) payload_[0] = 1;
  if (hasFault(Fault::empty_payload)) payload_.resize(header_bytes);
}

void DepthStream::spoilSize(std::size_t header_bytes) {
  const std::size_t frame = payload_.size() - header_bytes;
  if (hasFault(Fault::frame_short)) payload_.resize(header_bytes + frame / 2);
  if (hasFault(Fault::frame_long)) payload_.resize(payload_.size() + 4096);
  if (hasFault(Fault::other_size)) payload_.resize(header_bytes + frame * 3 / 4);
}

/// A URB that is not full ends the payload; after one that is full an empty one does.
void DepthStream::send(usbip::PendingUrbs& urbs) {
  while (in_progress_ && urbs.isPending(kStreamEndpoint)) {
    const std::size_t room = urbs.pendingBytes(kStreamEndpoint);
    const std::size_t bytes = std::min(room, payload_.size() - payload_sent_);
    urbs.complete(kStreamEndpoint, std::span(payload_).subspan(payload_sent_, bytes));
    payload_sent_ += bytes;
    if (bytes < room) {
      in_progress_ = false;
      ++sent_;
    }
  }
}

}  // namespace hapticd::test::uvc
