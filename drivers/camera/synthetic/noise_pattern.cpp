// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/noise_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {
namespace {

/// Adds a row to sums that no other pointer refers to, so that the compiler uses vectors.
void add(const float* row, std::size_t count, float* __restrict sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += row[i];
}

}  // namespace

void smoothOverWindow(int window, int width, int height, std::span<const float> cells,
                      std::span<float> image) {
  const auto columns = static_cast<std::size_t>(width);
  const auto rows = static_cast<std::size_t>(height);
  const auto side = static_cast<std::size_t>(window);
  const std::size_t reach = side / 2;
  std::vector<float> row_sums(cells.size());
  std::vector<float> padded(columns + side - 1);
  for (std::size_t row = 0; row < rows; ++row) {
    const float* const cell = &cells[row * columns];
    for (std::size_t k = 0; k < reach; ++k) padded[k] = cell[columns - reach + k];
    std::copy_n(cell, columns, &padded[reach]);
    for (std::size_t k = 0; reach + k + 1 < side; ++k) padded[reach + columns + k] = cell[k];
    for (std::size_t k = 0; k < side; ++k) add(&padded[k], columns, &row_sums[row * columns]);
  }
  // A sum of window^2 cells has `window` times their standard deviation.
  const float unit_variance = 1.0F / static_cast<float>(window);
  std::vector<float> total(columns);
  for (std::size_t row = 0; row < rows; ++row) {
    std::ranges::fill(total, 0.0F);
    for (std::size_t k = 0; k < side; ++k)
      add(&row_sums[(row + rows + k - reach) % rows * columns], columns, total.data());
    std::ranges::transform(total, &image[row * columns], [=](float sum) { return sum * unit_variance; });
  }
}

namespace {

constexpr std::uint32_t kStaticPurpose = 0x10;
constexpr std::uint32_t kFixedPurpose = 0x11;
constexpr std::uint32_t kSlowPurpose = 0x15;
constexpr std::uint32_t kCoarsePurpose = 0x16;
constexpr std::uint32_t kDriftPurpose = 0x12;
constexpr std::uint32_t kFastPurpose = 0x13;
constexpr std::uint32_t kEpochPurpose = 0x14;

constexpr std::uint64_t kFramesUntilItRepeats = 65536;  // keeps epochs exact in a float

/// Returns a uniformly distributed value with mean 0 and variance 1; the mean of the 81 values of a window is
/// normal to within a thousandth of its fourth moment.
float uniform(std::uint32_t bits) noexcept {
  constexpr float kHalfWidth = 1.7320508F;  // sqrt(3)
  return (static_cast<float>(static_cast<std::int32_t>(bits)) * 0x1p-31F) * kHalfWidth;
}

/// Returns a value above 0 and at most 1.
double aboveZero(std::uint32_t bits) noexcept {
  return (double{static_cast<float>(bits >> 8)} + 1) * 0x1p-24;
}

/// Returns the correlation of RandomLevels at two places `s` >= 0 apart, averaged over the first place: the
/// integral of the products of the weights that belong to the same level.
double levelCorrelation(double s) noexcept {
  const double right_angle = std::numbers::pi / 2;
  if (s < 1) return (1 - s / 2) * std::cos(right_angle * s) + std::sin(right_angle * s) / std::numbers::pi;
  if (s >= 2) return 0;
  const double overlap = 2 - s;
  return std::sin(right_angle * overlap) / std::numbers::pi - overlap / 2 * std::cos(right_angle * overlap);
}

/// Returns independent cells with the given standard deviation.
std::vector<float> fixedCells(std::uint32_t seed, std::uint32_t purpose, double deviation) {
  std::vector<float> cells(kKinectPixels);
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    cells[cell] =
        static_cast<float>(deviation) * uniform(static_cast<std::uint32_t>(bitsFor(seed, purpose, cell)));
  }
  return cells;
}

}  // namespace

NoisePattern::NoisePattern(std::uint32_t seed, const NoisePatternParameters& parameters)
    : parameters_(parameters),
      static_salt_(static_cast<std::uint32_t>(bitsFor(seed, kStaticPurpose, 0))),
      slow_salt_(static_cast<std::uint32_t>(bitsFor(seed, kSlowPurpose, 0))),
      drift_salt_(static_cast<std::uint32_t>(bitsFor(seed, kDriftPurpose, 0))),
      fast_salt_(static_cast<std::uint32_t>(bitsFor(seed, kFastPurpose, 0))),
      fixed_(fixedCells(seed, kFixedPurpose, parameters.static_raw * std::sqrt(parameters.share_of_pixel))),
      coarse_(parameters.coarse_raw > 0 ? kKinectPixels : 0),
      epochs_(parameters.drift_raw > 0 ? kKinectPixels : 0) {
  if (!coarse_.empty())
    smoothOverWindow(kCoarseWindow, kKinectWidth, kKinectHeight,
                     fixedCells(seed, kCoarsePurpose, parameters.coarse_raw), coarse_);
  // A cell keeps a value for T frames. If T is distributed as the sum of two exponential variables of mean
  // `drift_frames`, the probability that k frames share a value, E[max(0, 1 - k/T)], is exp(-k/drift_frames).
  for (std::size_t cell = 0; cell < epochs_.size(); ++cell) {
    const std::uint64_t bits = bitsFor(seed, kEpochPurpose, cell);
    const double product =
        aboveZero(static_cast<std::uint32_t>(bits)) * aboveZero(static_cast<std::uint32_t>(bits >> 32));
    const double duration_frames = -parameters.drift_frames * std::log(product);
    const double shortest_frames = 0.05;  // changes in every frame anyway
    const auto phase_bits = static_cast<std::uint32_t>(scramble(bits));
    epochs_[cell] = {static_cast<float>(1 / std::max(duration_frames, shortest_frames)),
                     static_cast<float>(aboveZero(phase_bits))};
  }
}

double NoisePattern::staticCorrelation(const NoisePatternParameters& parameters, double change_raw) {
  const double slow = levelCorrelation(std::abs(change_raw) / double{kSlowSpacing_raw});
  const double fast = levelCorrelation(std::abs(change_raw) / double{kFastSpacing_raw});
  const double share_of_fast = 1 - parameters.share_of_pixel - parameters.share_of_slow;
  return parameters.share_of_pixel + parameters.share_of_slow * slow + share_of_fast * fast;
}

void NoisePattern::fillCells(std::uint64_t frame, std::span<const float> exact,
                             std::span<float> cells) const {
  static const RandomLevels levels;
  const double share_of_fast = 1 - parameters_.share_of_pixel - parameters_.share_of_slow;
  const auto static_slow = static_cast<float>(parameters_.static_raw * std::sqrt(parameters_.share_of_slow));
  const auto static_fast = static_cast<float>(parameters_.static_raw * std::sqrt(share_of_fast));
  const auto drift = static_cast<float>(parameters_.drift_raw);
  const auto fast = static_cast<float>(parameters_.fast_raw);
  const auto number = static_cast<std::uint32_t>(frame % kFramesUntilItRepeats);
  const std::uint32_t fast_salt = scramble32(fast_salt_ + number);
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const std::uint32_t base = static_cast<std::uint32_t>(cell) * kCellFactor;
    const float place = exact[cell] + 2;  // above 0 even where nothing is seen
    float sum = fixed_[cell] + fast * uniform(scramble32(base + fast_salt)) +
                static_fast * levels.at(base + static_salt_, place / kFastSpacing_raw, uniform) +
                static_slow * levels.at(base + slow_salt_, place / kSlowSpacing_raw, uniform);
    if (!epochs_.empty()) {
      const Epoch epoch = epochs_[cell];
      const auto value =
          static_cast<std::uint32_t>(epoch.per_frame * static_cast<float>(number) + epoch.phase);
      sum += drift * uniform(scramble32(base + drift_salt_ + value * kLevelFactor));
    }
    cells[cell] = sum;
  }
}

void NoisePattern::render(std::uint64_t frame, std::span<const float> exact, std::span<float> noise) const {
  std::vector<float> cells(kKinectPixels);
  fillCells(frame, exact, cells);
  smoothOverWindow(kWindow, kKinectWidth, kKinectHeight, cells, noise);
  for (std::size_t pixel = 0; pixel < coarse_.size(); ++pixel) noise[pixel] += coarse_[pixel];
}

}  // namespace hapticd::drivers
