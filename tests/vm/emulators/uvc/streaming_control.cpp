// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/streaming_control.h"

#include <linux/usb/video.h>

#include <algorithm>
#include <cstdlib>

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

}  // namespace hapticd::test::uvc
