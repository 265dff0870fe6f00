// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <linux/usb/video.h>

#include <algorithm>
#include <array>
#include <bit>

#include "tests/vm/emulators/uvc/extension_unit.h"

namespace hapticd::test::uvc {
namespace {

constexpr std::uint16_t kRequestMagic = 0x4d47;
constexpr std::uint16_t kResponseMagic = 0x4252;
constexpr std::size_t kRequestHeaderBytes = 8;
constexpr std::size_t kMaxListPacket = 1000;

enum Opcode : std::uint16_t {
  kGetProperty = 1,
  kSetProperty = 2,
  kGetStructure = 3,
  kVersion = 26,
  kGetStructure11 = 27,
  kBeginList = 29,
  kReadList = 30,
  kEndList = 31,
};

enum Property : std::uint32_t {
  kDepthPrecision = 75,
  kDepthUnit = 176,
  kVersions = 1000,
  kSerialNumber = 1035,
  kDepthCalibration = 4026,
  kCameraParameters = 4027,
};

enum Error : std::uint16_t { kDone = 0, kInvalid = 1, kUnsupported = 2, kRejected = 5, kNotFound = 6 };

// of the structures behind a property
constexpr std::uint16_t kCalibrationVersion = 1;
constexpr std::uint16_t kParametersVersion = 0;

/// Micrometres by the levels of the depth precision.
constexpr std::array<std::uint32_t, 6> kPrecision_um{1000, 800, 400, 100, 200, 500};

void addIntrinsics(ByteWriter& out, const Intrinsics& of, const DepthMode& mode) {
  out.f32(of.fx_px).f32(of.fy_px).f32(of.ppx_px).f32(of.ppy_px).u16(mode.width_px).u16(mode.height_px);
}

class OrbbecUnit final : public ExtensionUnit {
 public:
  OrbbecUnit(const CameraModel& model, const Faults& faults);

  std::uint32_t selectors() const override { return 0b111; }
  std::size_t length(std::uint8_t selector) const override;
  std::optional<Bytes> get(std::uint8_t selector, std::uint8_t request) override;
  bool set(std::uint8_t selector, std::span<const std::uint8_t> value) override;
  std::uint32_t depthUnit_um() const override { return depth_unit_um_; }

 private:
  struct Answer {
    std::uint16_t error = 0;
    Bytes data = {};
  };

  Answer execute(std::uint16_t opcode, std::span<const std::uint8_t> data);
  Answer property(std::uint32_t id) const;
  Answer setProperty(std::uint32_t id, std::uint32_t value);
  Answer structure(std::uint32_t id) const;
  Bytes versions() const;
  Answer beginList(std::uint32_t id);
  Answer readList(std::uint32_t at, std::uint32_t bytes) const;
  Bytes cameraParameters() const;
  Bytes depthCalibration() const;

  const CameraModel& model_;
  const Faults& faults_;
  std::uint32_t depth_unit_um_;
  Bytes list_;      // that is being read
  Bytes response_;  // to the last request, without padding
};

OrbbecUnit::OrbbecUnit(const CameraModel& model, const Faults& faults)
    : model_(model), faults_(faults), depth_unit_um_(model.depth_unit_um) {}

std::size_t OrbbecUnit::length(std::uint8_t selector) const {
  switch (selector) {
    case 1:
      return 512;
    case 2:
      return 64;
    case 3:
      return 1024;
    default:
      return 0;
  }
}

std::optional<Bytes> OrbbecUnit::get(std::uint8_t selector, std::uint8_t request) {
  if (length(selector) == 0) return std::nullopt;
  Bytes bytes = request == UVC_GET_CUR ? response_ : Bytes{};
  bytes.resize(length(selector));
  return bytes;
}

bool OrbbecUnit::set(std::uint8_t /*selector*/, std::span<const std::uint8_t> value) {
  response_.clear();
  const std::size_t data_bytes = std::size_t{get16(value, 2)} * 2;
  if (get16(value, 0) != kRequestMagic || kRequestHeaderBytes + data_bytes > value.size()) return true;
  const std::uint16_t opcode = get16(value, 4);
  Answer answer = execute(opcode, value.subspan(kRequestHeaderBytes, data_bytes));
  if (faults_.has(Fault::response_error)) answer = {kRejected};
  const auto half_words = static_cast<std::uint16_t>((sizeof answer.error + answer.data.size() + 1) / 2);
  const auto number =
      static_cast<std::uint16_t>(get16(value, 6) + (faults_.has(Fault::response_number) ? 1 : 0));
  ByteWriter out(response_);
  out.u16(faults_.has(Fault::response_magic) ? 0 : kResponseMagic).u16(half_words).u16(opcode).u16(number);
  out.u16(answer.error).append(answer.data);
  return true;
}

OrbbecUnit::Answer OrbbecUnit::execute(std::uint16_t opcode, std::span<const std::uint8_t> data) {
  constexpr std::size_t kPropertyBytes = 4;
  if (data.size() < kPropertyBytes) return {kInvalid};
  const std::uint32_t id = get32(data, 0);
  switch (opcode) {
    case kGetProperty:
      return property(id);
    case kSetProperty:
      return data.size() < 8 ? Answer{kInvalid} : setProperty(id, get32(data, 4));
    case kVersion:
      return {kDone, {id == kDepthCalibration ? std::uint8_t{kCalibrationVersion} : std::uint8_t{0}, 0}};
    case kGetStructure:
    case kGetStructure11: {
      Answer answer = structure(id);
      if (opcode == kGetStructure11 && answer.error == kDone) answer.data.insert(answer.data.begin(), {0, 0});
      return answer;
    }
    case kBeginList:
      return beginList(id);
    case kReadList:
      return data.size() < 12 ? Answer{kInvalid} : readList(get32(data, 4), get32(data, 8));
    case kEndList:
      list_.clear();
      return {};
    default:
      return {kUnsupported};
  }
}

/// Value, largest, least, default, step.
OrbbecUnit::Answer OrbbecUnit::property(std::uint32_t id) const {
  Answer answer;
  ByteWriter out(answer.data);
  if (id == kDepthPrecision) {
    const auto level = std::ranges::find(kPrecision_um, depth_unit_um_) - kPrecision_um.begin();
    out.i32(static_cast<std::int32_t>(level)).i32(kPrecision_um.size() - 1).i32(0).i32(0).i32(1);
    return answer;
  }
  if (id == kDepthUnit) {
    const std::uint32_t unit_um = faults_.has(Fault::unit_zero) ? 0 : depth_unit_um_;
    out.f32(static_cast<float>(unit_um) / 1000).f32(1).f32(0.1F).f32(1).f32(0.1F);
    return answer;
  }
  return {kNotFound};
}

OrbbecUnit::Answer OrbbecUnit::setProperty(std::uint32_t id, std::uint32_t value) {
  if (id == kDepthPrecision) {
    if (value >= kPrecision_um.size()) return {kRejected};
    depth_unit_um_ = kPrecision_um[value];
    return {};
  }
  if (id == kDepthUnit) {
    const float unit_mm = std::bit_cast<float>(value);
    if (!(unit_mm >= 0.1F && unit_mm <= 1.0F)) return {kRejected};
    depth_unit_um_ = static_cast<std::uint32_t>(unit_mm * 1000 + 0.5F);
    return {};
  }
  return {kNotFound};
}

OrbbecUnit::Answer OrbbecUnit::structure(std::uint32_t id) const {
  if (id == kVersions) return {kDone, versions()};
  if (id != kSerialNumber) return {kNotFound};
  return {kDone, Bytes(model_.serial.begin(), model_.serial.end())};
}

/// Texts in fields of a fixed size: firmware, hardware, SDK, depth chip, image chip, serial number; type;
/// name.
Bytes OrbbecUnit::versions() const {
  constexpr std::size_t kField = 16;
  Bytes bytes;
  const auto add = [&bytes](std::string text) {
    text.resize(kField);
    bytes.insert(bytes.end(), text.begin(), text.end());
  };
  const auto& [major, minor, patch, build] = model_.firmware;
  add(fmt::format("{}.{}.{}.{}", major, minor, patch, build));
  for (const char* const part : {"1.0", "2.0", "MX6600", "none"}) add(part);
  add(model_.serial);
  ByteWriter(bytes).u32(0);
  add(model_.product_name);
  return bytes;
}

/// Version of the structure and bytes of the whole list.
OrbbecUnit::Answer OrbbecUnit::beginList(std::uint32_t id) {
  if (id != kDepthCalibration && id != kCameraParameters) return {kNotFound};
  list_ = id == kDepthCalibration ? depthCalibration() : cameraParameters();
  if (faults_.has(Fault::list_size)) list_.resize(list_.size() - 10);
  Answer answer;
  ByteWriter(answer.data)
      .u16(id == kDepthCalibration ? kCalibrationVersion : kParametersVersion)
      .u32(static_cast<std::uint32_t>(list_.size()));
  return answer;
}

OrbbecUnit::Answer OrbbecUnit::readList(std::uint32_t at, std::uint32_t bytes) const {
  if (at > list_.size() || bytes > list_.size() - at || bytes > kMaxListPacket) return {kInvalid};
  const auto first = list_.begin() + static_cast<std::ptrdiff_t>(at);
  return {kDone, Bytes(first, first + static_cast<std::ptrdiff_t>(bytes))};
}

/// Per mode: depth and colour intrinsics, their distortions, rotation and translation between them.
Bytes OrbbecUnit::cameraParameters() const {
  constexpr std::size_t kDistortionBytes = 8 * sizeof(float);
  Bytes bytes;
  ByteWriter out(bytes);
  if (faults_.has(Fault::mode_not_listed)) return bytes;
  for (const DepthMode& mode : model_.modes) {
    Intrinsics of = intrinsicsOf(model_, mode.width_px, mode.height_px);
    if (faults_.has(Fault::mode_not_finite)) of.fx_px = std::bit_cast<float>(0x7fc00000U);
    addIntrinsics(out, of, mode);
    addIntrinsics(out, {600, 600, 640, 360}, {1280, 720, {}});
    out.zeros(2 * kDistortionBytes);
    for (int element = 0; element < 9; ++element) out.f32(element % 4 == 0 ? 1.0F : 0.0F);
    out.f32(-24.0F).f32(0).f32(0);  // millimetres
  }
  return bytes;
}

Bytes OrbbecUnit::depthCalibration() const {
  const float focal_px = intrinsicsOf(model_, model_.modes.front().width_px, 0).fx_px;
  Bytes bytes;
  ByteWriter(bytes).u32(1).f32(static_cast<float>(model_.baseline_mm)).f32(0).f32(focal_px);
  ByteWriter(bytes).f32(static_cast<float>(depth_unit_um_) / 1000).f32(0).i32(0);
  return bytes;
}

}  // namespace

std::unique_ptr<ExtensionUnit> orbbecUnit(const CameraModel& model, const Faults& faults) {
  return std::make_unique<OrbbecUnit>(model, faults);
}

}  // namespace hapticd::test::uvc
