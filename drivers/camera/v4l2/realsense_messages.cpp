// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/realsense_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/crc32.h"

namespace hapticd::drivers::realsense {
namespace {

constexpr std::uint16_t kMagic = 0xCDAB;
constexpr std::size_t kRequestHeaderBytes = 24;  // length, magic, command, four parameters
constexpr std::size_t kRequestLengthBytes = 4;   // length and magic, which the length does not count
constexpr std::size_t kLengthOffset = 1020;
constexpr std::size_t kReplyHeaderBytes = 4;

constexpr std::size_t kModeBytes = 20;

constexpr std::size_t kTableBytes = 576;
constexpr std::size_t kTableHeaderBytes = 16;
constexpr std::uint32_t kIeeePolynomial = 0xEDB88320;
constexpr std::size_t kBaselineOffset = 160;
constexpr std::size_t kRectifiedOffset = 256;
// Sizes of the rectified parameters, in the order of the table; 0 x 0: reserved.
constexpr std::array<FrameSize, 16> kTableSizes{{{1920, 1080},
                                                 {1280, 720},
                                                 {640, 480},
                                                 {848, 480},
                                                 {640, 360},
                                                 {424, 240},
                                                 {320, 240},
                                                 {480, 270},
                                                 {1280, 800},
                                                 {960, 540},
                                                 {0, 0},
                                                 {0, 0},
                                                 {640, 400},
                                                 {576, 576},
                                                 {720, 720},
                                                 {1152, 1152}}};

// The mode 848 x 100 shows the middle rows of 848 x 480.
constexpr FrameSize kStrip{848, 100};
constexpr FrameSize kWholeOfStrip{848, 480};
constexpr double kRowsAboveStrip = 190;

constexpr const char* kUpdate = "update the camera's firmware, or set camera.intrinsics to configured";

std::unexpected<base::Error> refuse(const char* where, std::string what, const char* remedy = kUpdate) {
  return std::unexpected(base::Error{where, std::move(what), remedy});
}

Pinhole pinholeAt(Bytes bytes, std::size_t offset) {
  const auto number = [&](std::size_t index) {
    return static_cast<double>(numberAt<float>(bytes, offset + index * sizeof(float)));
  };
  return {number(0), number(1), number(2), number(3)};
}

constexpr const char* kTableName = "RealSense table 25";

base::Result<void> checkTable(Bytes table) {
  if (table.size() < kTableBytes) {
    return refuse(kTableName, fmt::format("has {} bytes instead of {}", table.size(), kTableBytes));
  }
  if (const auto type = numberAt<std::uint16_t>(table, 2); type != kCoefficientsTable) {
    return refuse(kTableName, fmt::format("is of type {}", type));
  }
  if (const auto bytes = numberAt<std::uint32_t>(table, 4); bytes != kTableBytes - kTableHeaderBytes) {
    return refuse(kTableName, fmt::format("states {} bytes of content instead of {}", bytes,
                                          kTableBytes - kTableHeaderBytes));
  }
  const auto stated = numberAt<std::uint32_t>(table, 12);
  const std::uint32_t computed =
      crc32Of<kIeeePolynomial>(table.subspan(kTableHeaderBytes, kTableBytes - kTableHeaderBytes));
  if (stated != computed) {
    return refuse(kTableName, fmt::format("has the checksum {:08x} instead of {:08x}", computed, stated),
                  "calibrate the camera anew, or set camera.intrinsics to configured");
  }
  return {};
}

/// Returns the rectified parameters of a size, or those that it is a part of.
Pinhole rectifiedOf(Bytes table, FrameSize size) {
  const auto listed = std::ranges::find(kTableSizes, size);
  if (listed != kTableSizes.end()) {
    const auto index = static_cast<std::size_t>(listed - kTableSizes.begin());
    return pinholeAt(table, kRectifiedOffset + index * 4 * sizeof(float));
  }
  if (size == kStrip) {
    Pinhole strip = rectifiedOf(table, kWholeOfStrip);
    strip.cy_px -= kRowsAboveStrip;
    return strip;
  }
  // librealsense: the width determines the scale, and rows are cut off evenly above and below
  const FrameSize& largest = kTableSizes.front();
  const double factor = static_cast<double>(size.width_px) / largest.width_px;
  Pinhole pinhole = scaled(pinholeAt(table, kRectifiedOffset), factor);
  pinhole.cy_px -= (largest.height_px * factor - size.height_px) / 2;
  return pinhole;
}

}  // namespace

std::vector<std::byte> encoded(const Request& request) {
  std::vector<std::byte> bytes;
  bytes.reserve(kMonitorBytes);
  append(bytes, static_cast<std::uint16_t>(kRequestHeaderBytes - kRequestLengthBytes + request.data.size()));
  append(bytes, kMagic);
  append(bytes, static_cast<std::uint32_t>(request.command));
  for (const std::uint32_t parameter : request.parameters) append(bytes, parameter);
  bytes.insert(bytes.end(), request.data.begin(), request.data.end());
  bytes.resize(kMonitorBytes);
  return bytes;
}

base::Result<std::vector<std::byte>> replyData(Command command, Bytes reply) {
  constexpr const char* kWhere = "RealSense hardware monitor";
  if (reply.size() != kMonitorBytes) {
    return refuse(kWhere, fmt::format("the reply has {} bytes instead of {}", reply.size(), kMonitorBytes));
  }
  const auto code = static_cast<std::uint32_t>(command);
  if (const auto answered = numberAt<std::uint32_t>(reply, 0); answered != code) {
    const auto error = static_cast<std::int32_t>(answered);
    return refuse(
        kWhere, error < 0 ? fmt::format("the command 0x{:02x} fails with error {}", code, error)
                          : fmt::format("the reply to the command 0x{:02x} is to 0x{:02x}", code, answered));
  }
  const auto bytes = numberAt<std::uint32_t>(reply, kLengthOffset);
  if (bytes > kLengthOffset - kReplyHeaderBytes) {
    return refuse(kWhere, fmt::format("the reply to the command 0x{:02x} states {} bytes", code, bytes));
  }
  const Bytes data = reply.subspan(kReplyHeaderBytes, bytes);
  return std::vector<std::byte>(data.begin(), data.end());
}

base::Result<std::optional<Pinhole>> pinholeOfMode(Bytes modes, FrameSize size) {
  constexpr const char* kWhere = "RealSense depth modes";
  if (modes.empty() || modes.size() % kModeBytes != 0) {
    return refuse(kWhere,
                  fmt::format("{} bytes are not a list of items of {} bytes", modes.size(), kModeBytes));
  }
  for (; !modes.empty(); modes = modes.subspan(kModeBytes)) {
    if (numberAt<std::uint16_t>(modes, 0) != size.width_px) continue;
    if (numberAt<std::uint16_t>(modes, 2) != size.height_px) continue;
    const auto pinhole = plausiblePinhole(pinholeAt(modes, 4), size, kWhere);
    if (!pinhole) return std::unexpected(pinhole.error());
    return *pinhole;
  }
  return std::nullopt;
}

base::Result<double> baselineOf(Bytes table) {
  if (auto intact = checkTable(table); !intact) return std::unexpected(intact.error());
  const double baseline_m = std::abs(static_cast<double>(numberAt<float>(table, kBaselineOffset))) / 1000;
  // the cameras have 18 to 95 mm
  if (!(baseline_m >= 0.005 && baseline_m <= 0.5)) {
    return refuse(kTableName, fmt::format("has a baseline of {} m", baseline_m));
  }
  return baseline_m;
}

base::Result<Coefficients> coefficientsOf(Bytes table, FrameSize size) {
  const auto baseline_m = baselineOf(table);
  if (!baseline_m) return std::unexpected(baseline_m.error());
  const auto pinhole = plausiblePinhole(rectifiedOf(table, size), size, kTableName);
  if (!pinhole) return std::unexpected(pinhole.error());
  return Coefficients{*pinhole, *baseline_m};
}

base::Result<DepthTable> depthTableFrom(Bytes data) {
  constexpr const char* kWhere = "RealSense depth table";
  constexpr std::uint32_t kMaxUnit_um = 100'000;
  if (data.size() < 5 * sizeof(std::uint32_t)) {
    return refuse(kWhere, fmt::format("has {} bytes instead of 20", data.size()));
  }
  const DepthTable table{numberAt<std::uint32_t>(data, 0), numberAt<std::int32_t>(data, 4),
                         numberAt<std::int32_t>(data, 8), numberAt<std::int32_t>(data, 12),
                         numberAt<std::int32_t>(data, 16)};
  if (table.unit_um < 1 || table.unit_um > kMaxUnit_um) {
    return refuse(kWhere, fmt::format("has a unit of {} um", table.unit_um));
  }
  return table;
}

std::vector<std::byte> encoded(const DepthTable& table) {
  std::vector<std::byte> bytes;
  append(bytes, table.unit_um);
  append(bytes, table.clamp_min);
  append(bytes, table.clamp_max);
  append(bytes, table.disparity_mode);
  append(bytes, table.disparity_shift);
  return bytes;
}

base::Result<DeviceData> deviceDataFrom(Bytes data) {
  constexpr std::size_t kFirmwareOffset = 12;
  constexpr std::size_t kSerialOffset = 48;
  constexpr std::size_t kSerialBytes = 6;
  if (data.size() < kSerialOffset + kSerialBytes) {
    return refuse("RealSense device data", fmt::format("has only {} bytes", data.size()));
  }
  const auto part = [&](std::size_t index) {
    return std::to_integer<unsigned>(data[kFirmwareOffset + index]);
  };
  DeviceData device{fmt::format("{}.{}.{}.{}", part(3), part(2), part(1), part(0)), {}};
  for (const std::byte byte : data.subspan(kSerialOffset, kSerialBytes)) {
    device.serial += fmt::format("{:02x}", std::to_integer<unsigned>(byte));
  }
  return device;
}

std::optional<double> temperatureFrom(Bytes control) {
  constexpr std::size_t kValidOffset = 1;
  constexpr std::size_t kDegreesOffset = 3;
  if (control.size() <= kDegreesOffset || control[kValidOffset] == std::byte{0}) return std::nullopt;
  return numberAt<std::int8_t>(control, kDegreesOffset);
}

}  // namespace hapticd::drivers::realsense

namespace hapticd::drivers {
namespace {

// uvc_meta_buf: host time, frame number of the bus, then the payload's header
constexpr std::size_t kHostBytes = 10;
constexpr std::size_t kMinimalHeader = 2;
constexpr std::size_t kPresentationBytes = 4;
constexpr std::size_t kClockBytes = 6;
constexpr std::uint8_t kHasPresentation = 1U << 2;
constexpr std::uint8_t kHasClock = 1U << 3;

constexpr std::size_t kBlockHeader = 8;  // id, size including this header
constexpr std::uint32_t kCaptureTiming = 0x80000001;
constexpr std::size_t kTimingBytes = 40;

// An exposure is never older than this when the camera sends it.
constexpr std::uint32_t kOldest_us = 500'000;

DepthMetadata timingFrom(Bytes block) {
  // id, size, version, flags and the frame counter come first
  return {numberAt<std::uint32_t>(block, 20), numberAt<std::uint32_t>(block, 28),
          numberAt<std::uint32_t>(block, 36)};
}

}  // namespace

std::optional<DepthMetadata> depthMetadataFrom(Bytes buffer) {
  if (buffer.size() < kHostBytes + kMinimalHeader) return std::nullopt;
  Bytes header = buffer.subspan(kHostBytes);
  const auto length = std::to_integer<std::size_t>(header[0]);
  if (length < kMinimalHeader || length > header.size()) return std::nullopt;
  const auto flags = std::to_integer<std::uint8_t>(header[1]);
  header = header.subspan(kMinimalHeader, length - kMinimalHeader);

  const std::size_t standard = ((flags & kHasPresentation) != 0 ? kPresentationBytes : 0) +
                               ((flags & kHasClock) != 0 ? kClockBytes : 0);
  if (header.size() < standard) return std::nullopt;
  for (Bytes blocks = header.subspan(standard); blocks.size() >= kBlockHeader;) {
    const auto bytes = numberAt<std::uint32_t>(blocks, 4);
    if (bytes < kBlockHeader || bytes > blocks.size()) return std::nullopt;
    if (numberAt<std::uint32_t>(blocks, 0) == kCaptureTiming && bytes >= kTimingBytes) {
      return timingFrom(blocks);
    }
    blocks = blocks.subspan(bytes);
  }
  return std::nullopt;
}

std::optional<std::int64_t> exposureAge_ns(const DepthMetadata& metadata) {
  if (metadata.pipe_latency_us < metadata.optical_time_us) return std::nullopt;
  const std::uint32_t age_us = metadata.pipe_latency_us - metadata.optical_time_us;
  if (age_us > kOldest_us) return std::nullopt;
  return std::int64_t{age_us} * 1000;
}

}  // namespace hapticd::drivers
