// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/depth_scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace hapticd::test::uvc {
namespace {

constexpr std::size_t kNumberPixels = 8;
constexpr std::uint16_t kNumberMask = 0xf;

constexpr double kPlane_m = 0.6;
constexpr double kPlaneX = 0.25;
constexpr double kPlaneY = 0.1;
constexpr double kRadius_m = 0.06;
constexpr double kCentreY_m = 0.01;
constexpr double kCentreZ_m = 0.45;

double centreX_m(std::uint32_t phase) {
  return -0.07 + 0.02 * phase;
}

/// Depth of the plane along the ray (x, y, 1).
double planeDepth_m(double x, double y) {
  return kPlane_m / (1 + kPlaneX * x + kPlaneY * y);
}

/// Depth of the sphere along the ray (x, y, 1); infinity where the ray misses it.
double sphereDepth_m(double x, double y, double centre_x_m) {
  const double a = x * x + y * y + 1;
  const double b = x * centre_x_m + y * kCentreY_m + kCentreZ_m;
  const double c =
      centre_x_m * centre_x_m + kCentreY_m * kCentreY_m + kCentreZ_m * kCentreZ_m - kRadius_m * kRadius_m;
  const double discriminant = b * b - a * c;
  return discriminant < 0 ? std::numeric_limits<double>::infinity() : (b - std::sqrt(discriminant)) / a;
}

}  // namespace

/// The images are made here, so that none is late in a stream; the sphere only where it can be seen, which
/// an emulated CPU needs.
DepthScene::DepthScene(std::uint16_t width_px, std::uint16_t height_px, const Intrinsics& intrinsics,
                       std::uint32_t unit_um)
    : width_px_(width_px),
      height_px_(height_px),
      intrinsics_(intrinsics),
      steps_per_m_(1e6 / unit_um),
      phases_(kPhases, plane()) {
  for (std::uint32_t phase = 0; phase < kPhases; ++phase) addSphere(phase, phases_[phase]);
}

double DepthScene::x(std::uint16_t column) const {
  return (column - double{intrinsics_.ppx_px}) / double{intrinsics_.fx_px};
}

double DepthScene::y(std::uint16_t row) const {
  return (row - double{intrinsics_.ppy_px}) / double{intrinsics_.fy_px};
}

std::uint16_t DepthScene::stepsOf(double depth_m) const {
  const double steps = depth_m * steps_per_m_;
  return steps > 0 && steps < 65535 ? static_cast<std::uint16_t>(steps + 0.5) : std::uint16_t{0};
}

std::uint16_t DepthScene::value(std::uint16_t column, std::uint16_t row, std::uint32_t number) const {
  const double sphere_m = sphereDepth_m(x(column), y(row), centreX_m(number % kPhases));
  return stepsOf(std::min(planeDepth_m(x(column), y(row)), sphere_m));
}

std::vector<std::uint16_t> DepthScene::plane() const {
  std::vector<std::uint16_t> image;
  image.reserve(pixels());
  for (std::uint16_t row = 0; row < height_px_; ++row) {
    for (std::uint16_t column = 0; column < width_px_; ++column) {
      image.push_back(stepsOf(planeDepth_m(x(column), y(row))));
    }
  }
  return image;
}

void DepthScene::addSphere(std::uint32_t phase, std::vector<std::uint16_t>& image) const {
  const double near_m = kCentreZ_m - kRadius_m;
  const auto seen = [near_m](double tangent, double centre_m) {
    // the nearest face of the cube around the sphere covers it, seen from the camera
    return std::abs(tangent) <= (std::abs(centre_m) + kRadius_m) / near_m;
  };
  for (std::uint16_t row = 0; row < height_px_; ++row) {
    if (!seen(y(row), kCentreY_m)) continue;
    for (std::uint16_t column = 0; column < width_px_; ++column) {
      if (!seen(x(column), centreX_m(phase))) continue;
      image[std::size_t{row} * width_px_ + column] = value(column, row, phase);
    }
  }
}

void DepthScene::write(std::uint32_t number, std::span<std::uint16_t> frame) const {
  const std::vector<std::uint16_t>& image = phases_[number % kPhases];
  std::memcpy(frame.data(), image.data(), std::min(frame.size_bytes(), pixels() * sizeof image[0]));
  putFrameNumber(frame, number);
}

std::uint32_t frameNumberIn(std::span<const std::uint16_t> frame) {
  std::uint32_t number = 0;
  for (std::size_t i = kNumberPixels; i-- > 0;) number = number << 4 | (frame[i] & kNumberMask);
  return number;
}

void putFrameNumber(std::span<std::uint16_t> frame, std::uint32_t number) {
  for (std::size_t i = 0; i < kNumberPixels; ++i) {
    const std::uint32_t nibble = number >> 4 * i & kNumberMask;
    frame[i] = static_cast<std::uint16_t>((frame[i] & 0xfff0U) | nibble);
  }
}

}  // namespace hapticd::test::uvc
