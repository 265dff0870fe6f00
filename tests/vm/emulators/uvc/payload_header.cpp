// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/payload_header.h"

#include <linux/usb/video.h>

namespace hapticd::test::uvc {
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

}  // namespace hapticd::test::uvc
