#include "drivers/camera/synthetic/sensor_noise.h"

#include <cmath>
#include <random>

namespace hapticd::drivers {
namespace {

constexpr std::uint32_t kNoisePurpose = 1;
constexpr std::uint32_t kFlickerPurpose = 2;
constexpr std::uint32_t kWeakPurpose = 3;
constexpr std::uint32_t kDitherPurpose = 4;
constexpr float kWeakAbove =
    1.2815516F;  // 90 % quantile of the normal distribution: kFlickerShare lies above

/// A fixed bijection of 64 bits that spreads every input bit over all output bits (splitmix64's finaliser).
constexpr std::uint64_t scramble(std::uint64_t bits) noexcept {
  bits += 0x9e3779b97f4a7c15U;
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
  return bits ^ (bits >> 31);
}

/// The same for 32 bits, cheap enough for every pixel.
constexpr std::uint32_t scramble32(std::uint32_t bits) noexcept {
  bits = (bits ^ (bits >> 16)) * 0x85ebca6bU;
  bits = (bits ^ (bits >> 13)) * 0xc2b2ae35U;
  return bits ^ (bits >> 16);
}

/// Sums kCorrelationPixels neighbours along a line that wraps around.
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

std::uint16_t toRaw(float disparity) noexcept {
  return disparity >= 0 && disparity < static_cast<float>(rt::kRawNoMeasurement)
             ? static_cast<std::uint16_t>(disparity)
             : rt::kRawNoMeasurement;
}

bool jumps(float a, float b) noexcept {
  return std::fabs(a - b) > SensorNoise::kEdgeJumpRaw;
}

}  // namespace

SensorNoise::SensorNoise(std::uint32_t seed)
    : seed_(seed), field_(static_cast<std::size_t>(kFieldWidth) * kFieldHeight) {
  std::mt19937 generator(seed);
  for (float& value : field_) value = static_cast<float>(generator() >> 8);
  for (int row = 0; row < kFieldHeight; ++row)
    smoothLine(&field_[std::size_t(row) * kFieldWidth], kFieldWidth, 1);
  for (int column = 0; column < kFieldWidth; ++column) {
    smoothLine(&field_[static_cast<std::size_t>(column)], kFieldHeight, kFieldWidth);
  }
  normalise(field_);
}

SensorNoise::Offset SensorNoise::offset(std::uint64_t frame, std::uint32_t purpose) const {
  const std::uint64_t bits = scramble(scramble((std::uint64_t{seed_} << 32) | purpose) ^ frame);
  return {static_cast<int>(bits % kFieldWidth), static_cast<int>((bits >> 32) % kFieldHeight)};
}

const float* SensorNoise::fieldRow(Offset offset, int row) const {
  return &field_[static_cast<std::size_t>((row + offset.row) % kFieldHeight) * kFieldWidth];
}

void SensorNoise::dither(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const {
  const auto salt =
      static_cast<std::uint32_t>(scramble(scramble((std::uint64_t{seed_} << 32) | kDitherPurpose) ^ frame));
  for (std::size_t pixel = 0; pixel < exact.size(); ++pixel) {
    const std::uint32_t bits = scramble32(static_cast<std::uint32_t>(pixel) * 0x9e3779b9U + salt);
    const float fraction = static_cast<float>(bits >> 8) * 0x1p-24F;  // 0 <= fraction < 1
    raw[pixel] = exact[pixel] >= 0 ? toRaw(exact[pixel] + fraction) : rt::kRawNoMeasurement;
  }
}

void SensorNoise::applySensor(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const {
  const Offset noise_offset = offset(frame, kNoisePurpose);
  const Offset flicker_offset = offset(frame, kFlickerPurpose);
  const Offset weak_offset = offset(0, kWeakPurpose);
  for (int row = 0; row < rt::kFrameHeight; ++row) {
    const float* const line = &exact[static_cast<std::size_t>(row) * rt::kFrameWidth];
    const float* const above = row > 0 ? line - rt::kFrameWidth : line;
    const float* const below = row + 1 < rt::kFrameHeight ? line + rt::kFrameWidth : line;
    const float* const noise = fieldRow(noise_offset, row);
    const float* const flicker = fieldRow(flicker_offset, row);
    const float* const weak = fieldRow(weak_offset, row);
    std::uint16_t* const out = raw + static_cast<std::size_t>(row) * rt::kFrameWidth;
    for (int column = 0; column < kFirstDeadColumn; ++column) {
      const auto at = [column](Offset offset) { return (column + offset.column) & (kFieldWidth - 1); };
      const int left = column > 0 ? column - 1 : column;
      const float disparity = line[column];
      const bool unsteady = weak[at(weak_offset)] > kWeakAbove || jumps(disparity, line[left]) ||
                            jumps(disparity, line[column + 1]) || jumps(disparity, above[column]) ||
                            jumps(disparity, below[column]);
      const bool missing = disparity < 0 || (unsteady && flicker[at(flicker_offset)] > 0);
      const float noisy = disparity + static_cast<float>(kSigmaRaw) * noise[at(noise_offset)] + 0.5F;
      out[column] = missing ? rt::kRawNoMeasurement : toRaw(noisy);
    }
    std::fill(out + kFirstDeadColumn, out + rt::kFrameWidth, rt::kRawNoMeasurement);
  }
}

}  // namespace hapticd::drivers
