// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::test::uvc {

/// A size that the camera offers, with its rates in frames per second, the default first.
struct DepthMode {
  std::uint16_t width_px = 0;
  std::uint16_t height_px = 0;
  std::vector<std::uint16_t> rates_hz;
};

/// Of a rectified image without distortion, in pixels.
struct Intrinsics {
  float fx_px = 0;
  float fy_px = 0;
  float ppx_px = 0;
  float ppy_px = 0;
};

/// Whose commands the extension unit understands.
enum class Protocol : std::uint8_t { realsense, orbbec };

/// A camera in plain numbers, from which descriptors, tables and frames are made.
struct CameraModel {
  Protocol protocol = Protocol::realsense;
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string manufacturer;
  std::string product_name;
  std::string function_name;               ///< of the depth function; Orbbec's contains " Depth"
  std::string serial;                      ///< of the USB device
  std::array<std::uint8_t, 6> module{};    ///< serial number of the optical module, in its details
  std::array<std::uint8_t, 4> firmware{};  ///< major, minor, patch, build
  std::string format = "Z16 ";             ///< fourcc of the pixels, 16 bits each
  double horizontal_view_deg = 90;         ///< 10 to 150
  double baseline_mm = 50;
  std::uint32_t depth_unit_um = 1000;  ///< until the host sets another one
  std::vector<DepthMode> modes;        ///< at least one
};

/// Like an Intel RealSense D435: 8086:0b07.
CameraModel realsenseD435();
/// Like an Orbbec Gemini 335: 2bc5:0800.
CameraModel gemini335();
/// The model of that name, "d435" or "gemini335".
std::optional<CameraModel> modelNamed(std::string_view name);

/// What the camera's tables say about a mode. The principal point is off the centre, so that a reader that
/// takes the centre is noticed.
Intrinsics intrinsicsOf(const CameraModel& model, std::uint16_t width_px, std::uint16_t height_px);

}  // namespace hapticd::test::uvc
