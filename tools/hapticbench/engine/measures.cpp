// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <utility>

namespace hapticd::tools {

double Exceedance::percent() const {
  return percentOf(above, ticks);
}

void Exceedance::add(const Exceedance& other) {
  ticks += other.ticks;
  above += other.above;
  longest = std::max(longest, other.longest);
  largest = std::max(largest, other.largest);
}

Exceedance exceedance(std::span<const double> values, double limit) {
  Exceedance result{.ticks = values.size()};
  std::size_t run = 0;
  for (const double value : values) {
    run = value > limit ? run + 1 : 0;
    result.above += run > 0 ? 1 : 0;
    result.longest = std::max(result.longest, run);
    result.largest = std::max(result.largest, value);
  }
  return result;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto place = values.begin() + std::lround(share * last);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

double robustDeviation(std::vector<double> residuals) {
  constexpr double kNormalDeviation = 1.4826;  // of a normal distribution whose median magnitude is one
  for (double& residual : residuals) residual = std::abs(residual);
  return kNormalDeviation * quantile(std::move(residuals), 0.5);
}

double rootMeanSquare(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

namespace {

constexpr double kNoDirection_n = 0.05;  // half the smallest force that a person notices

}  // namespace

double angleBetween_deg(const rt::Vec3& a, const rt::Vec3& b) {
  // by the chord between the unit vectors, which is exact for small angles where the cosine is not
  const double chord = norm((1 / norm(a)) * a - (1 / norm(b)) * b);
  return 2 * std::asin(std::min(chord / 2, 1.0)) * 180 / std::numbers::pi;
}

bool isRightForce(const rt::Vec3& force_n, const rt::Vec3& true_n) {
  constexpr double kSize_n = 0.5;
  const double size_n = norm(force_n);
  const double true_size_n = norm(true_n);
  if (std::abs(size_n - true_size_n) > std::max(kSize_n, justNoticeableDifference_n(true_size_n)))
    return false;
  if (size_n < 2 * kNoDirection_n || true_size_n == 0) return true;
  return angleBetween_deg(force_n, true_n) <= kRightDirection_deg;
}

double justNoticeableDifference_n(double force_n) {
  return std::max(0.07 * force_n, 0.1);
}

void ForceErrors::add(const rt::Vec3& force_n, const rt::Vec3& truth_n) {
  const double truth = norm(truth_n);
  const double error = norm(force_n - truth_n);
  error_n.add(error);
  error_jnd.add(error / justNoticeableDifference_n(truth));
  if (truth > 0) error_percent.add(100 * error / truth);
  if (truth > kNoDirection_n && norm(force_n) > kNoDirection_n)
    direction_deg.add(angleBetween_deg(force_n, truth_n));
}

void ForceErrors::add(const ForceErrors& other) {
  error_n.add(other.error_n);
  error_percent.add(other.error_percent);
  error_jnd.add(other.error_jnd);
  direction_deg.add(other.direction_deg);
}

namespace {

constexpr double kContact_n = 0.25;
constexpr double kIdealContact_n = 0.5;

}  // namespace

PopThrough judgePush(std::span<const double> outward_n, std::span<const double> ideal_n) {
  PopThrough push;
  for (std::size_t tick = 0; tick < outward_n.size(); ++tick) {
    const double force_n = outward_n[tick];
    if (force_n > push.largest_n) {
      push.dipped = push.dipped || push.popped;
      push.popped = false;
      push.largest_n = force_n;
      push.largest_tick = tick;
      continue;
    }
    const bool gives_way = push.largest_n >= kContact_n && force_n < push.largest_n / 2;
    const bool holds_nothing = ideal_n[tick] >= kIdealContact_n && force_n <= 0;
    push.popped = push.popped || gives_way || holds_nothing;
  }
  return push;
}

double popThroughForceOnPlane_n(const rt::SpringParameters& springs, const rt::DepthModelParameters& camera,
                                double depth_m) {
  constexpr int kHeights = 4000;
  const double points_per_m2 = camera.fx_px * camera.fy_px / (depth_m * depth_m);
  const double disc_radius_m = std::sqrt(springs.max_points / (std::numbers::pi * points_per_m2));
  double largest_n = 0;
  for (int i = 1; i < kHeights; ++i) {
    const double height_m = springs.radius_m * i / kHeights;
    const double farthest_m = std::min(std::hypot(height_m, disc_radius_m), springs.radius_m);
    largest_n = std::max(largest_n, springs.stiffness_n_per_m * height_m *
                                        (2 * springs.radius_m / (height_m + farthest_m) - 1));
  }
  return largest_n;
}

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
