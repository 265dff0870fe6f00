// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/calibration_tables.h"

#include <array>
#include <limits>
#include <utility>

#include "drivers/base/crc32.h"

namespace hapticd::test::uvc {
namespace {

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

}  // namespace

Bytes cameraDetails(const CameraModel& model) {
  Bytes bytes(kDetailsBytes);
  for (std::size_t i = 0; i < model.firmware.size(); ++i) bytes[kFirmwareAt + i] = model.firmware[3 - i];
  for (std::size_t i = 0; i < model.module.size(); ++i) bytes[kModuleAt + i] = model.module[i];
  return bytes;
}

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

}  // namespace hapticd::test::uvc
