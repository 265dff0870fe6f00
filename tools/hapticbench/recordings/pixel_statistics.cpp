// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/pixel_statistics.h"

#include <algorithm>
#include <cmath>

#include "rt/depth_frame.h"

namespace hapticd::tools {
namespace {

/// Sums over some frames; of differences from a value near them, for precision.
struct PixelSums {
  double count = 0;
  double sum = 0;
  double squares = 0;

  void add(double value) {
    count += 1;
    sum += value;
    squares += value * value;
  }
  double mean() const { return count > 0 ? sum / count : 0; }
};

PixelStatistics statisticsOf(std::vector<float>& values, const PixelSums& first, const PixelSums& second,
                             const CameraDisparity& camera) {
  PixelStatistics pixel;
  pixel.valid = static_cast<std::uint16_t>(values.size());
  if (values.empty()) return pixel;
  const double count = first.count + second.count;
  const double mean = (first.sum + second.sum) / count;
  const double variance = (first.squares + second.squares) / count - mean * mean;
  pixel.mean = static_cast<float>(mean);
  pixel.deviation = static_cast<float>(std::sqrt(std::max(variance, 0.0)));
  pixel.drift = first.count > 0 && second.count > 0 ? static_cast<float>(second.mean() - first.mean()) : 0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 4 / 5);
  std::nth_element(values.begin(), place, values.end(),
                   [&camera](float one, float other) { return camera.isNearer(one, other); });
  pixel.farthest = *place;
  pixel.noise_scale = static_cast<float>(camera.noiseScale(mean));
  // of the difference of two means of half as many frames
  pixel.drift_noise = static_cast<float>(camera.changingNoise(mean) * 2 / std::sqrt(count));
  return pixel;
}

}  // namespace

std::vector<PixelStatistics> pixelStatistics(const BenchSequence& session, const CameraDisparity& camera) {
  std::vector<PixelStatistics> pixels(session.frames.front()->pixels());
  const std::size_t frames = session.frames.size();
  std::vector<float> values;
  for (std::size_t pixel = 0; pixel < pixels.size(); ++pixel) {
    PixelSums first;
    PixelSums second;
    values.clear();
    for (std::size_t frame = 0; frame < frames; ++frame) {
      const float disparity = camera.of(session.frames[frame]->raw[pixel]);
      if (std::isnan(disparity)) continue;
      (2 * frame < frames ? first : second).add(disparity);
      values.push_back(disparity);
    }
    pixels[pixel] = statisticsOf(values, first, second, camera);
  }
  return pixels;
}

bool rests(const PixelStatistics& pixel, std::size_t frames) {
  // Temporal noise of a Kinect is 0.33 to 0.45 raw with rounding, its drift over a second less than that; a
  // surface that moves by a raw unit or an edge exceeds both.
  constexpr float kMostDeviation = 1.0F;
  constexpr float kMostDrift = 0.7F;
  constexpr float kMostDriftDeviations = 4;
  const float most_drift = std::max(kMostDrift * pixel.noise_scale, kMostDriftDeviations * pixel.drift_noise);
  return 10 * static_cast<std::size_t>(pixel.valid) >= 8 * frames &&
         pixel.deviation <= kMostDeviation * pixel.noise_scale && std::abs(pixel.drift) <= most_drift;
}

}  // namespace hapticd::tools
