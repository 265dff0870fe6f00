// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/realsense_unit.h"

#include <linux/usb/video.h>

#include <algorithm>

#include "tests/vm/emulators/uvc/calibration_tables.h"

namespace hapticd::test::uvc {
namespace {

// selectors; librealsense, src/ds/ds-private.h
constexpr std::uint8_t kMonitor = 1;
constexpr std::uint8_t kEmitter = 2;
constexpr std::uint8_t kExposure = 3;
constexpr std::uint8_t kLaserPower = 4;
constexpr std::uint8_t kPreset = 6;
constexpr std::uint8_t kErrorReport = 7;
constexpr std::uint8_t kExternalTrigger = 8;
constexpr std::uint8_t kTemperatures = 9;
constexpr std::uint8_t kAutoExposure = 0xb;

constexpr std::size_t kMonitorBytes = 1024;
constexpr std::size_t kRequestHeaderBytes = 24;
constexpr std::uint16_t kMagic = 0xcdab;
constexpr std::uint16_t kFixedBytes = 20;  // of what the request's length counts
constexpr std::size_t kReplyDataAt = 4;
constexpr std::size_t kReplyLengthAt = 1020;
constexpr std::size_t kMaxReplyData = kReplyLengthAt - kReplyDataAt;

enum Opcode : std::uint32_t {
  kDetails = 0x10,
  kCalibrationTable = 0x15,
  kSetAdvanced = 0x2b,
  kGetAdvanced = 0x2c,
  kSetSynchronisation = 0x69,
  kGetSynchronisation = 0x6a,
  kModeTable = 0x7e,
};
constexpr std::uint32_t kCoefficients = 25;
constexpr std::uint32_t kDepthGroup = 9;
constexpr std::uint32_t kMaxSynchronisation = 260;
constexpr std::uint32_t kMinDepthUnit_um = 40;
constexpr std::uint32_t kMaxDepthUnit_um = 25000;
constexpr std::size_t kDepthTableBytes = 20;

// of the hardware monitor, as negative numbers
constexpr std::uint32_t kInvalidCommand = static_cast<std::uint32_t>(-1);
constexpr std::uint32_t kNotSupported = static_cast<std::uint32_t>(-21);

constexpr std::uint32_t kBothTemperaturesValid = 0x0101;
constexpr std::uint32_t kProjector_degC = 31;
constexpr std::uint32_t kChip_degC = 38;

Bytes numberOf(std::uint32_t value, std::size_t bytes) {
  Bytes encoded;
  ByteWriter(encoded).u32(value);
  encoded.resize(bytes);
  return encoded;
}

std::uint32_t valueOf(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
  return value;
}

}  // namespace

RealsenseUnit::RealsenseUnit(const CameraModel& model, const Faults& faults)
    : model_(model),
      faults_(faults),
      depth_unit_um_(model.depth_unit_um),
      numbers_{{kEmitter, {1, 1, 0, 2, 1}},
               {kExposure, {4, 8500, 1, 200'000, 1}},
               {kLaserPower, {2, 150, 0, 360, 30}},
               {kPreset, {1, 0, 0, 8, 1}},
               {kErrorReport, {1, 0, 0, 255, 1}},
               {kExternalTrigger, {1, 0, 0, 1, 1}},
               {kTemperatures,
                {4, kBothTemperaturesValid | kProjector_degC << 16 | kChip_degC << 24, 0, 0xffffffff, 1}},
               {kAutoExposure, {1, 1, 0, 1, 1}}},
      reply_(kMonitorBytes) {}

std::uint32_t RealsenseUnit::selectors() const {
  std::uint32_t bits = 1U << (kMonitor - 1);
  for (const auto& [selector, number] : numbers_) bits |= 1U << (selector - 1);
  return bits;
}

std::size_t RealsenseUnit::length(std::uint8_t selector) const {
  if (selector == kMonitor) return kMonitorBytes;
  const auto found = numbers_.find(selector);
  return found != numbers_.end() ? found->second.bytes : 0;
}

std::optional<Bytes> RealsenseUnit::get(std::uint8_t selector, std::uint8_t request) {
  if (selector == kMonitor) return request == UVC_GET_CUR ? reply_ : Bytes(kMonitorBytes);
  const auto found = numbers_.find(selector);
  if (found == numbers_.end()) return std::nullopt;
  const Number& number = found->second;
  switch (request) {
    case UVC_GET_CUR:
    case UVC_GET_DEF:
      return numberOf(number.value, number.bytes);
    case UVC_GET_MIN:
      return numberOf(number.least, number.bytes);
    case UVC_GET_MAX:
      return numberOf(number.largest, number.bytes);
    case UVC_GET_RES:
      return numberOf(number.step, number.bytes);
    default:
      return std::nullopt;
  }
}

bool RealsenseUnit::set(std::uint8_t selector, std::span<const std::uint8_t> value) {
  if (selector == kMonitor) {
    monitor(value);
    return true;
  }
  const auto found = numbers_.find(selector);
  if (found == numbers_.end() || selector == kTemperatures || selector == kErrorReport) return false;
  Number& number = found->second;
  const std::uint32_t wanted = valueOf(value);
  if (wanted < number.least || wanted > number.largest) return false;
  number.value = wanted;
  return true;
}

/// Executes a request and keeps its reply for the next GET_CUR.
void RealsenseUnit::monitor(std::span<const std::uint8_t> bytes) {
  reply_.assign(kMonitorBytes, 0);
  const std::uint16_t counted = get16(bytes, 0);
  const std::size_t data_bytes = std::size_t{counted} - kFixedBytes;
  if (get16(bytes, 2) != kMagic || counted < kFixedBytes ||
      data_bytes > kMonitorBytes - kRequestHeaderBytes) {
    return put32(reply_, 0, kInvalidCommand);
  }
  const Request request{get32(bytes, 4),  get32(bytes, 8),  get32(bytes, 12),
                        get32(bytes, 16), get32(bytes, 20), bytes.subspan(kRequestHeaderBytes, data_bytes)};
  const auto data = faults_.has(Fault::monitor_error) ? std::nullopt : execute(request);
  if (!data || data->size() > kMaxReplyData) return put32(reply_, 0, kNotSupported);
  put32(reply_, 0, faults_.has(Fault::monitor_echo) ? request.opcode + 1 : request.opcode);
  std::ranges::copy(*data, reply_.begin() + kReplyDataAt);
  const auto length = static_cast<std::uint32_t>(data->size());
  put32(reply_, kReplyLengthAt, faults_.has(Fault::monitor_length) ? 100'000 : length);
}

/// The data of the reply; nothing: the camera refuses.
std::optional<Bytes> RealsenseUnit::execute(const Request& request) {
  switch (request.opcode) {
    case kDetails:
      return cameraDetails(model_);
    case kCalibrationTable:
      if (request.p1 != kCoefficients) return std::nullopt;
      return coefficientsTable(model_, faults_);
    case kModeTable:
      if (faults_.has(Fault::no_mode_table)) return std::nullopt;
      return modeTable(model_, faults_);
    case kGetAdvanced:
      return request.p1 == kDepthGroup ? depthTable(request.p2) : std::nullopt;
    case kSetAdvanced:
      if (!setDepthTable(request)) return std::nullopt;
      return Bytes{};
    case kGetSynchronisation:
      return numberOf(synchronisation_, 4);
    case kSetSynchronisation:
      if (request.p1 > kMaxSynchronisation) return std::nullopt;
      synchronisation_ = request.p1;
      return Bytes{};
    default:
      return std::nullopt;
  }
}

/// which: 0 the values, 1 the least, 2 the largest.
std::optional<Bytes> RealsenseUnit::depthTable(std::uint32_t which) const {
  Bytes table;
  ByteWriter out(table);
  switch (which) {
    case 0:
      out.u32(faults_.has(Fault::unit_zero) ? 0 : depth_unit_um_).i32(0).i32(65535);
      out.i32(faults_.has(Fault::disparity) ? 1 : 0).i32(0);
      return table;
    case 1:
      out.u32(kMinDepthUnit_um).zeros(kDepthTableBytes - 4);
      return table;
    case 2:
      out.u32(kMaxDepthUnit_um).i32(65535).i32(65535).i32(1).i32(512);
      return table;
    default:
      return std::nullopt;
  }
}

bool RealsenseUnit::setDepthTable(const Request& request) {
  if (request.p1 != kDepthGroup || request.data.size() < kDepthTableBytes) return false;
  const std::uint32_t unit_um = get32(request.data, 0);
  if (unit_um < kMinDepthUnit_um || unit_um > kMaxDepthUnit_um) return false;
  depth_unit_um_ = unit_um;
  return true;
}

}  // namespace hapticd::test::uvc
