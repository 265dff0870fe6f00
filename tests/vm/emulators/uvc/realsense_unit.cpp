// SPDX-License-Identifier: Apache-2.0
#include <linux/usb/video.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <utility>

#include "drivers/base/crc32.h"
#include "tests/vm/emulators/uvc/extension_unit.h"

namespace hapticd::test::uvc {
namespace {

// The tables of a RealSense D4xx, made from the model's numbers; formats: librealsense's
// src/ds/d400/d400-private.h.

constexpr std::size_t kDetailsBytes = 276;
constexpr std::size_t kFirmwareAt = 12;
constexpr std::size_t kModuleAt = 48;

constexpr std::uint16_t kCoefficientsType = 25;
constexpr std::uint32_t kEthernetPolynomial = 0xedb88320;

/// The resolutions of the rectified parameters in their order; 0: reserved.
constexpr std::array<std::pair<std::uint16_t, std::uint16_t>, 16> kRectified{{{1920, 1080},
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

void addIntrinsics(ByteWriter& out, const Intrinsics& of) {
  out.f32(of.fx_px).f32(of.fy_px).f32(of.ppx_px).f32(of.ppy_px);
}

void addIdentity(ByteWriter& out) {
  for (int element = 0; element < 9; ++element) out.f32(element % 4 == 0 ? 1.0F : 0.0F);
}

/// What follows the header.
Bytes coefficients(const CameraModel& model, const Faults& faults) {
  Bytes bytes;
  ByteWriter out(bytes);
  // unrectified cameras, normalised by the image size; a reader of rectified depth does not need them
  for (int camera = 0; camera < 2; ++camera) {
    out.f32(0.5F).f32(0.9F).f32(0.5F).f32(0.5F).zeros(5 * sizeof(float));
  }
  addIdentity(out);
  addIdentity(out);
  out.f32(static_cast<float>(-model.baseline_mm)).u32(0).zeros(88);
  for (const auto& [width, height] : kRectified) {
    const bool none = width == 0 || faults.has(Fault::table_focal_zero);
    addIntrinsics(out, none ? Intrinsics{} : intrinsicsOf(model, width, height));
  }
  out.zeros(64);
  return bytes;
}

/// Details of the camera (GVD): firmware at byte 12, serial number of the module at 48.
Bytes cameraDetails(const CameraModel& model) {
  Bytes bytes(kDetailsBytes);
  for (std::size_t i = 0; i < model.firmware.size(); ++i) bytes[kFirmwareAt + i] = model.firmware[3 - i];
  for (std::size_t i = 0; i < model.module.size(); ++i) bytes[kModuleAt + i] = model.module[i];
  return bytes;
}

/// Coefficients table, id 25: header with checksum, baseline, rectified intrinsics by resolution.
Bytes coefficientsTable(const CameraModel& model, const Faults& faults) {
  const Bytes body = coefficients(model, faults);
  const std::uint32_t checksum = drivers::crc32Of<kEthernetPolynomial>(std::as_bytes(std::span(body)));
  const auto size = static_cast<std::uint32_t>(body.size());
  Bytes table;
  ByteWriter out(table);
  out.u8(1).u8(0);  // version 1.0, big-endian
  out.u16(faults.has(Fault::table_type) ? kCoefficientsType + 6 : kCoefficientsType);
  out.u32(faults.has(Fault::table_size) ? size - 64 : size).u32(0);
  out.u32(faults.has(Fault::table_checksum) ? ~checksum : checksum).append(body);
  if (faults.has(Fault::table_size)) table.resize(table.size() - 64);
  return table;
}

/// Rectified intrinsics of each depth mode, 20 bytes each (RECPARAMSGET).
Bytes modeTable(const CameraModel& model, const Faults& faults) {
  Bytes bytes;
  ByteWriter out(bytes);
  if (faults.has(Fault::mode_not_listed)) {
    addIntrinsics(out.u16(256).u16(144), intrinsicsOf(model, 256, 144));
    return bytes;
  }
  for (const DepthMode& mode : model.modes) {
    Intrinsics of = intrinsicsOf(model, mode.width_px, mode.height_px);
    if (faults.has(Fault::mode_not_finite)) of.fx_px = std::numeric_limits<float>::quiet_NaN();
    addIntrinsics(out.u16(mode.width_px).u16(mode.height_px), of);
  }
  return bytes;
}

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

class RealsenseUnit final : public ExtensionUnit {
 public:
  RealsenseUnit(const CameraModel& model, const Faults& faults);

  std::uint32_t selectors() const override;
  std::size_t length(std::uint8_t selector) const override;
  std::optional<Bytes> get(std::uint8_t selector, std::uint8_t request) override;
  bool set(std::uint8_t selector, std::span<const std::uint8_t> value) override;
  std::uint32_t depthUnit_um() const override { return depth_unit_um_; }

 private:
  /// A control with a number; the kernel asks for its range.
  struct Number {
    std::size_t bytes;
    std::uint32_t value, least, largest, step;
  };
  struct Request {
    std::uint32_t opcode, p1, p2, p3, p4;
    std::span<const std::uint8_t> data;
  };

  void monitor(std::span<const std::uint8_t> bytes);
  std::optional<Bytes> execute(const Request& request);
  std::optional<Bytes> depthTable(std::uint32_t which) const;
  bool setDepthTable(const Request& request);

  const CameraModel& model_;
  const Faults& faults_;
  std::uint32_t depth_unit_um_;
  std::uint32_t synchronisation_ = 0;
  std::map<std::uint8_t, Number> numbers_;
  Bytes reply_;  // of the hardware monitor
};

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

}  // namespace

std::unique_ptr<ExtensionUnit> realsenseUnit(const CameraModel& model, const Faults& faults) {
  return std::make_unique<RealsenseUnit>(model, faults);
}

}  // namespace hapticd::test::uvc
