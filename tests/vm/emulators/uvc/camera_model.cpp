// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/camera_model.h"

#include <cmath>
#include <numbers>

namespace hapticd::test::uvc {

CameraModel realsenseD435() {
  CameraModel model;
  model.protocol = Protocol::realsense;
  model.vendor = 0x8086;
  model.product = 0x0b07;
  model.manufacturer = "Intel(R) RealSense(TM) Depth Camera 435";
  model.product_name = "Intel(R) RealSense(TM) Depth Camera 435";
  model.function_name = "Intel(R) RealSense(TM) Depth Camera 435 Depth";
  model.serial = "814512070123";
  model.module = {0x81, 0x35, 0x22, 0x07, 0x01, 0x23};
  model.firmware = {5, 16, 0, 1};
  model.modes = {{640, 480, {30, 60, 90}}, {848, 480, {30, 60, 90}}, {1280, 720, {30, 15}},
                 {640, 360, {30, 90}},     {480, 270, {30, 90}},     {424, 240, {30, 90}}};
  return model;
}

CameraModel gemini335() {
  CameraModel model;
  model.protocol = Protocol::orbbec;
  model.vendor = 0x2bc5;
  model.product = 0x0800;
  model.manufacturer = "Orbbec(R)";
  model.product_name = "Orbbec Gemini 335";
  model.function_name = "Orbbec Gemini 335 Depth";
  model.serial = "CP0E54000042";
  model.firmware = {1, 2, 20, 0};
  model.horizontal_view_deg = 86;
  model.modes = {{848, 480, {30, 60, 15}}, {640, 480, {30, 60}}, {1280, 800, {30, 15}}, {1280, 720, {30}}};
  return model;
}

std::optional<CameraModel> modelNamed(std::string_view name) {
  if (name == "d435") return realsenseD435();
  if (name == "gemini335") return gemini335();
  return std::nullopt;
}

Intrinsics intrinsicsOf(const CameraModel& model, std::uint16_t width_px, std::uint16_t height_px) {
  const double half_view_rad = model.horizontal_view_deg / 2 * std::numbers::pi / 180;
  const auto focal_px = static_cast<float>(width_px / (2 * std::tan(half_view_rad)));
  constexpr float kOffCentreX = 1.75F;
  constexpr float kOffCentreY = -2.25F;
  return {.fx_px = focal_px,
          .fy_px = focal_px,
          .ppx_px = static_cast<float>(width_px) / 2 + kOffCentreX,
          .ppy_px = static_cast<float>(height_px) / 2 + kOffCentreY};
}

}  // namespace hapticd::test::uvc
