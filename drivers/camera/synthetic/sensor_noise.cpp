// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/noise_pattern.h"

namespace hapticd::drivers {
namespace {

constexpr std::uint32_t kFlickerPurpose = 2;
constexpr std::uint32_t kWeakPurpose = 3;
constexpr std::uint32_t kDitherPurpose = 4;
constexpr std::uint32_t kFlyingPurpose = 5;

/// Replaces each element of a line that wraps around by the sum of kCorrelationPixels neighbours.
void smoothLine(float* line, int length, int stride) {
  constexpr int kWindow = SensorNoise::kCorrelationPixels;
  std::vector<float> original(static_cast<std::size_t>(length));
  for (int i = 0; i < length; ++i) original[static_cast<std::size_t>(i)] = line[i * stride];
  for (int i = 0; i < length; ++i) {
    float sum = 0;
    for (int k = 0; k < kWindow; ++k) sum += original[static_cast<std::size_t>((i + k) % length)];
    line[i * stride] = sum;
  }
}

void normalise(std::vector<float>& values) {
  double sum = 0;
  double squares = 0;
  for (const float value : values) {
    sum += double{value};
    squares += double{value} * double{value};
  }
  const auto count = static_cast<double>(values.size());
  const double mean = sum / count;
  const double deviation = std::sqrt(squares / count - mean * mean);
  for (float& value : values) value = static_cast<float>((double{value} - mean) / deviation);
}

/// Returns the value that the fraction `share` of `values` exceeds.
float quantileAbove(std::vector<float> values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>((1 - share) * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

std::uint16_t toRaw(float disparity) noexcept {
  return disparity >= 0 && disparity < static_cast<float>(kKinectNoMeasurement)
             ? static_cast<std::uint16_t>(disparity)
             : kKinectNoMeasurement;
}

bool jumps(float a, float b) noexcept {
  return std::fabs(a - b) > SensorNoise::kEdgeJumpRaw;
}

/// Returns a value in [0, 1).
float fractionOf(std::uint32_t bits) noexcept {
  return static_cast<float>(bits >> 8) * 0x1p-24F;
}

}  // namespace

SensorNoise::Parameters SensorNoise::recorded() {
  return {
      .pattern = {
          .static_raw = 0.30, .drift_raw = 0.28, .drift_frames = 11.5, .fast_raw = 0.22, .coarse_raw = 0.22}};
}

SensorNoise::Parameters SensorNoise::harsh() {
  return {.pattern = {.static_raw = 0.5, .fast_raw = 0.2}};
}

SensorNoise::SensorNoise(std::uint32_t seed, const Parameters& parameters)
    : seed_(seed),
      parameters_(parameters),
      weak_above_(0),
      pattern_(seed, parameters.pattern),
      field_(static_cast<std::size_t>(kFieldWidth) * kFieldHeight) {
  std::mt19937 generator(seed);
  for (float& value : field_) value = static_cast<float>(generator() >> 8);
  for (int row = 0; row < kFieldHeight; ++row)
    smoothLine(&field_[std::size_t(row) * kFieldWidth], kFieldWidth, 1);
  for (int column = 0; column < kFieldWidth; ++column) {
    smoothLine(&field_[static_cast<std::size_t>(column)], kFieldHeight, kFieldWidth);
  }
  normalise(field_);
  weak_above_ = quantileAbove(field_, parameters.flicker_share);
}

SensorNoise::Offset SensorNoise::offset(std::uint64_t frame, std::uint32_t purpose) const {
  const std::uint64_t bits = bitsFor(seed_, purpose, frame);
  return {static_cast<int>(bits % kFieldWidth), static_cast<int>((bits >> 32) % kFieldHeight)};
}

float SensorNoise::field(Offset offset, int column, int row) const {
  const auto line = static_cast<std::size_t>((row + offset.row) % kFieldHeight);
  return field_[line * kFieldWidth + static_cast<std::size_t>((column + offset.column) % kFieldWidth)];
}

void SensorNoise::dither(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const {
  const auto salt = static_cast<std::uint32_t>(bitsFor(seed_, kDitherPurpose, frame));
  for (std::size_t pixel = 0; pixel < exact.size(); ++pixel) {
    const std::uint32_t bits = scramble32(static_cast<std::uint32_t>(pixel) * 0x9e3779b9U + salt);
    raw[pixel] = exact[pixel] >= 0 ? toRaw(exact[pixel] + fractionOf(bits)) : kKinectNoMeasurement;
  }
}

/// Returns the value of a measured pixel at an edge: that of its own side or one between both sides.
std::uint16_t SensorNoise::atEdge(std::uint32_t bits, float disparity, float neighbour, float noise) const {
  const bool flies = neighbour >= 0 && fractionOf(bits) < static_cast<float>(parameters_.flying_share);
  const float share = flies ? fractionOf(scramble32(bits + 1)) : 0;
  return toRaw(disparity + share * (neighbour - disparity) + noise + 0.5F);
}

void SensorNoise::applyRow(std::uint64_t frame, int row, const Offsets& offsets, std::span<const float> lit,
                           std::span<const float> noise, std::uint16_t* raw) const {
  const auto first = static_cast<std::size_t>(row) * kKinectWidth;
  const float* const line = &lit[first];
  const float* const above = row > 0 ? line - kKinectWidth : line;
  const float* const below = row + 1 < kKinectHeight ? line + kKinectWidth : line;
  const auto salt = static_cast<std::uint32_t>(bitsFor(seed_, kFlyingPurpose, frame));
  for (int column = 0; column < kFirstDeadColumn; ++column) {
    const std::size_t pixel = first + static_cast<std::size_t>(column);
    const float disparity = line[column];
    if (disparity < 0) {
      raw[pixel] = kKinectNoMeasurement;
      continue;
    }
    const float left = line[std::max(column - 1, 0)];
    const float right = line[column + 1];
    const float beside = jumps(disparity, left)            ? left
                         : jumps(disparity, right)         ? right
                         : jumps(disparity, above[column]) ? above[column]
                                                           : below[column];
    const bool edge = jumps(disparity, beside);
    const bool unsteady = edge || field(offsets.weak, column, row) > weak_above_;
    if (unsteady && field(offsets.flicker, column, row) > 0) {
      raw[pixel] = kKinectNoMeasurement;
    } else if (edge) {
      const std::uint32_t bits = scramble32(static_cast<std::uint32_t>(pixel) * 0x9e3779b9U + salt);
      raw[pixel] = atEdge(bits, disparity, beside, noise[pixel]);
    } else {
      raw[pixel] = toRaw(disparity + noise[pixel] + 0.5F);
    }
  }
  std::fill_n(raw + first + kFirstDeadColumn, kKinectWidth - kFirstDeadColumn, kKinectNoMeasurement);
}

void SensorNoise::applySensor(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const {
  std::vector<float> noise(kKinectPixels);
  pattern_.render(frame, exact, noise);
  std::vector<float> lit(exact.begin(), exact.end());
  for (std::size_t row = 0; row < kKinectHeight; ++row) {
    removeShadow(std::span(lit).subspan(row * kKinectWidth, kKinectWidth), parameters_.shadow_side,
                 parameters_.shadow_pixels_per_raw);
  }
  const Offsets offsets{offset(frame, kFlickerPurpose), offset(0, kWeakPurpose)};
  for (int row = 0; row < kKinectHeight; ++row) applyRow(frame, row, offsets, lit, noise, raw);
}

}  // namespace hapticd::drivers
