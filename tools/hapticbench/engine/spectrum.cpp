// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <utility>

namespace hapticd::tools {
namespace {

constexpr std::size_t kSize = Spectrum::kSegment;
using Segment = std::array<std::complex<double>, kSize>;

// Of the Hann window, which is zero at the segment's beginning alone.
constexpr double kWindowSum = kSize / 2.0;
constexpr double kWindowSquares = 3.0 * kSize / 8;

double hann(std::size_t i) {
  return 0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / kSize);
}

/// Discrete Fourier transform in place (radix 2, decimation in time).
void transform(Segment& values) {
  for (std::size_t i = 1, reversed = 0; i < kSize; ++i) {
    std::size_t bit = kSize / 2;
    for (; (reversed & bit) != 0; bit /= 2) reversed ^= bit;
    reversed |= bit;
    if (i < reversed) std::swap(values[i], values[reversed]);
  }
  for (std::size_t length = 2; length <= kSize; length *= 2) {
    const double angle = -2 * std::numbers::pi / static_cast<double>(length);
    for (std::size_t begin = 0; begin < kSize; begin += length) {
      for (std::size_t k = 0; k < length / 2; ++k) {
        const std::complex<double> turned =
            std::polar(1.0, angle * static_cast<double>(k)) * values[begin + k + length / 2];
        values[begin + k + length / 2] = values[begin + k] - turned;
        values[begin + k] += turned;
      }
    }
  }
}

}  // namespace

Spectrum::Spectrum(std::span<const double> values, double rate_hz)
    : resolution_hz_(rate_hz / kSize), power_(kSize / 2 + 1) {
  std::size_t segments = 0;
  for (std::size_t begin = 0; begin + kSize <= values.size(); begin += kSize / 2) {
    const std::span<const double> part = values.subspan(begin, kSize);
    const double mean = std::accumulate(part.begin(), part.end(), 0.0) / kSize;
    Segment segment;
    for (std::size_t i = 0; i < kSize; ++i) segment[i] = hann(i) * (part[i] - mean);
    transform(segment);
    for (std::size_t k = 0; k < power_.size(); ++k) power_[k] += std::norm(segment[k]);
    ++segments;
  }
  for (double& power : power_) power /= static_cast<double>(std::max<std::size_t>(segments, 1));
}

void Spectrum::add(const Spectrum& other) {
  for (std::size_t k = 0; k < power_.size(); ++k) power_[k] += other.power_[k];
}

std::size_t Spectrum::bin(double frequency_hz) const {
  const auto nearest = static_cast<std::size_t>(std::lround(frequency_hz / resolution_hz_));
  return std::min(nearest, power_.size() - 1);
}

double Spectrum::rms(double low_hz, double high_hz) const {
  double sum = 0;
  for (std::size_t k = bin(low_hz); k <= bin(high_hz); ++k) {
    const bool is_single = k == 0 || k == kSize / 2;  // without a mirror image at the negative frequency
    sum += (is_single ? 1 : 2) * power_[k];
  }
  return std::sqrt(sum / (kSize * kWindowSquares));
}

Spectrum::Line Spectrum::largestLine(double low_hz, double high_hz) const {
  std::size_t largest = bin(low_hz);
  for (std::size_t k = largest; k <= bin(high_hz); ++k) {
    if (power_[k] > power_[largest]) largest = k;
  }
  return {2 * std::sqrt(power_[largest]) / kWindowSum, static_cast<double>(largest) * resolution_hz_};
}

}  // namespace hapticd::tools
