// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/depth_sensor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "drivers/camera/synthetic/noise_pattern.h"

namespace hapticd::drivers {
namespace {

constexpr std::uint32_t kFixedPurpose = 0x20;
constexpr std::uint32_t kStandingPurpose = 0x21;
constexpr std::uint32_t kChangingPurpose = 0x22;

constexpr std::size_t kPlaces = 1024;
/// A smaller standard deviation changes nothing that a raw value shows, but would need more levels than a
/// float tells apart.
constexpr double kMinSigma_m = 1e-6;

/// Normally distributed values of variance 1 from random bits: the quantiles of 4096 equal shares.
class NormalValues {
 public:
  NormalValues() {
    double squares = 0;
    for (std::size_t i = 0; i < kShares; ++i) {
      const double value = quantile((static_cast<double>(i) + 0.5) / kShares);
      values_[i] = static_cast<float>(value);
      squares += value * value;
    }
    const auto to_variance_1 = static_cast<float>(1 / std::sqrt(squares / kShares));
    for (float& value : values_) value *= to_variance_1;
  }
  float operator()(std::uint32_t bits) const noexcept { return values_[bits >> (32 - kBits)]; }

 private:
  static constexpr int kBits = 12;
  static constexpr std::size_t kShares = std::size_t{1} << kBits;

  /// The value that a normal variable stays below with this probability, by bisection.
  static double quantile(double probability) {
    double low = -6;
    double high = 6;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      (0.5 * std::erfc(-middle / std::numbers::sqrt2) < probability ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  std::array<float, kShares> values_{};
};

const NormalValues& normalValues() {
  static const NormalValues values;
  return values;
}

std::uint32_t saltOf(std::uint32_t seed, std::uint32_t purpose) {
  return static_cast<std::uint32_t>(bitsFor(seed, purpose, 0));
}

}  // namespace

CameraNoise::CameraNoise(const rt::DepthModelParameters& camera, std::uint32_t seed, double scale)
    : width_px_(camera.width_px),
      height_px_(camera.height_px),
      window_px_(std::clamp(static_cast<int>(std::lround(camera.noise.correlation_px)), 1,
                            std::min(camera.width_px, camera.height_px))),
      noise_(camera.noise),
      near_m_(static_cast<float>(camera.near_m)),
      places_per_m_(static_cast<float>((kPlaces - 1) / (camera.far_m - camera.near_m))),
      standing_salt_(saltOf(seed, kStandingPurpose)),
      changing_salt_(saltOf(seed, kChangingPurpose)) {
  noise_.c0_m *= scale;
  noise_.c1 *= scale;
  noise_.c2_per_m *= scale;
  if (!noise_.isKnown() || !(noise_.standing_share > 0)) return;
  fillPlaces();
  fixed_.resize(static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_));
  const auto deviation = static_cast<float>(std::sqrt(kShareOfPixel * noise_.standing_share));
  for (std::size_t cell = 0; cell < fixed_.size(); ++cell)
    fixed_[cell] = deviation * normalValues()(static_cast<std::uint32_t>(bitsFor(seed, kFixedPurpose, cell)));
}

/// Integrates dZ / sigma(Z) from near_m on by the trapezoidal rule.
void CameraNoise::fillPlaces() {
  const double step_m = 1 / double{places_per_m_};
  const auto density = [this](double depth_m) { return 1 / std::max(noise_.sigma_m(depth_m), kMinSigma_m); };
  places_.resize(kPlaces);
  double place = 0;
  for (std::size_t i = 1; i < kPlaces; ++i) {
    const double depth_m = double{near_m_} + static_cast<double>(i) * step_m;
    place += 0.5 * step_m * (density(depth_m - step_m) + density(depth_m));
    places_[i] = static_cast<float>(place);
  }
}

float CameraNoise::placeOf(float depth_m) const noexcept {
  const float at = std::clamp((depth_m - near_m_) * places_per_m_, 0.0F, static_cast<float>(kPlaces - 2));
  const auto index = static_cast<std::size_t>(at);
  const float share = at - static_cast<float>(index);
  return places_[index] + share * (places_[index + 1] - places_[index]);
}

void CameraNoise::fillCells(std::uint64_t frame, std::span<const float> depths_m,
                            std::span<float> cells) const {
  static const RandomLevels levels;
  const NormalValues& normal = normalValues();
  const auto changing = static_cast<float>(std::sqrt(1 - noise_.standing_share));
  const auto standing = static_cast<float>(std::sqrt((1 - kShareOfPixel) * noise_.standing_share));
  const auto salt = static_cast<std::uint32_t>(scramble(changing_salt_ + (frame << 32)));
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const std::uint32_t base = static_cast<std::uint32_t>(cell) * kCellFactor;
    cells[cell] = changing * normal(scramble32(base + salt));
    if (fixed_.empty()) continue;
    cells[cell] +=
        fixed_[cell] + standing * levels.at(base + standing_salt_, placeOf(depths_m[cell]), normal);
  }
}

void CameraNoise::addTo(std::uint64_t frame, std::span<float> depths_m) const {
  if (!noise_.isKnown()) return;
  std::vector<float> cells(depths_m.size());
  fillCells(frame, depths_m, cells);
  std::vector<float> smooth;
  if (window_px_ > 1) {
    smooth.resize(cells.size());
    smoothOverWindow(window_px_, width_px_, height_px_, cells, smooth);
  }
  const std::span<const float> errors = window_px_ > 1 ? smooth : cells;
  const auto c0 = static_cast<float>(noise_.c0_m);
  const auto c1 = static_cast<float>(noise_.c1);
  const auto c2 = static_cast<float>(noise_.c2_per_m);
  for (std::size_t pixel = 0; pixel < depths_m.size(); ++pixel) {
    const float z = depths_m[pixel];
    const float noisy = z + (c0 + z * (c1 + z * c2)) * errors[pixel];
    depths_m[pixel] = z > 0 ? std::max(noisy, 0.0F) : z;
  }
}

namespace {

constexpr std::uint32_t kDitherPurpose = 0x24;
constexpr double kNearest = 0.5;  // what is added before the fraction is cut off

/// `shareOf(pixel)`: 0..1, added to the exact raw value before its fraction is cut off.
template <typename ShareOf>
void deliver(const rt::DepthModelParameters& camera, std::span<const float> depths_m, rt::DepthFrame& frame,
             const ShareOf& shareOf) {
  frame.camera = camera;
  const auto width = static_cast<std::size_t>(camera.width_px);
  const auto stride = static_cast<std::size_t>(rt::strideOf(camera.width_px));
  const bool is_linear = camera.law == rt::DepthLawKind::linear;
  std::size_t pixel = 0;
  for (std::span<std::uint16_t> rest = frame.image(); !rest.empty(); rest = rest.subspan(stride)) {
    for (std::size_t column = 0; column < width; ++column, ++pixel) {
      const auto depth_m = static_cast<double>(depths_m[pixel]);
      const double exact =
          is_linear ? depth_m / camera.unit_m : (1 / depth_m - camera.b_per_m) / camera.a_per_m;
      const double raw = exact + shareOf(pixel);
      const bool has_raw = depth_m > 0 && raw >= 0 && raw < camera.raw_values;
      rest[column] = has_raw ? static_cast<std::uint16_t>(raw) : camera.raw_no_measurement;
    }
    std::ranges::fill(rest.subspan(width, stride - width), camera.raw_no_measurement);
  }
}

}  // namespace

void deliverDepths(const rt::DepthModelParameters& camera, std::span<const float> depths_m,
                   rt::DepthFrame& frame) {
  deliver(camera, depths_m, frame, [](std::size_t) { return kNearest; });
}

void deliverDithered(const rt::DepthModelParameters& camera, std::uint32_t seed, std::uint64_t frame_number,
                     std::span<const float> depths_m, rt::DepthFrame& frame) {
  const auto salt = static_cast<std::uint32_t>(bitsFor(seed, kDitherPurpose, frame_number));
  deliver(camera, depths_m, frame, [salt](std::size_t pixel) {
    return scramble32(static_cast<std::uint32_t>(pixel) * kCellFactor + salt) * 0x1p-32;
  });
}

DepthSensor::DepthSensor(const rt::DepthModelParameters& camera, std::uint32_t seed,
                         const Parameters& parameters)
    : camera_(camera),
      seed_(seed),
      edges_(camera, parameters.baseline_m, seed),
      noise_(camera, seed, parameters.noise_scale) {}

void DepthSensor::dither(std::uint64_t frame_number, std::span<const float> exact_m,
                         rt::DepthFrame& frame) const {
  deliverDithered(camera_, seed_, frame_number, exact_m, frame);
}

void DepthSensor::applySensor(std::uint64_t frame_number, std::span<const float> exact_m,
                              rt::DepthFrame& frame) const {
  std::vector<float> depths_m(exact_m.begin(), exact_m.end());
  edges_.applyTo(depths_m);
  noise_.addTo(frame_number, depths_m);
  deliverDepths(camera_, depths_m, frame);
}

}  // namespace hapticd::drivers
