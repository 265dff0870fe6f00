// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "rt/depth_frame.h"
#include "tools/lib/depth_noise/noise_fit.h"

namespace hapticd::tools {

/// What frames of a resting scene show of a camera's noise.
struct DepthNoiseReport {
  std::uint64_t frames = 0;
  double share_of_holes = 0;            ///< of all pixels of all frames, those without a measurement
  std::vector<NoiseAtDepth> at_depths;  ///< from near to far; empty: too few frames or pixels at rest
  double correlation_px = 1;            ///< of the part that changes from frame to frame
};

/// Separates the noise of a camera from the scene that it sees, which must rest: the changing part is the
/// deviation of each pixel from its mean over the frames, the standing part what is left of that mean on
/// surfaces that are locally plane.
/// Thread: one at a time.
class DepthNoise {
 public:
  /// Measurements of a pixel that its deviation takes at the least.
  static constexpr std::uint32_t kFewestMeasurements = 8;

  /// Adds a frame. One of another camera or mode than the last starts anew.
  void add(const rt::DepthFrame& frame);

  DepthNoiseReport report() const;

  /// Returns the mean depth in metres at each pixel, row by row without padding; 0 without measurements.
  std::vector<double> meanDepth_m() const;

  const rt::DepthModelParameters& camera() const { return camera_; }

 private:
  static constexpr int kLags = 24;  ///< longest distance in pixels at which the correlation is measured

  /// A pixel's measurements; the sums are of the differences from the first, which keeps them precise.
  struct Pixel {
    float first_m = 0;
    std::uint32_t count = 0;
    double sum_m = 0;
    double sum_m2 = 0;
  };

  /// A square part of the image on one surface.
  struct Tile {
    double depth_m;
    double standing_m2;  ///< variance of the standing part; may be slightly negative
  };

  /// The pixels and tiles of one interval of depths.
  struct Bin {
    std::vector<double> variances_m2;  ///< of the pixels, from frame to frame
    std::vector<double> standing_m2;   ///< of the tiles
    double sum_of_depths_m = 0;        ///< of the pixels
  };

  void startAnew(const rt::DepthModelParameters& camera);
  void addDifferences(int row);
  double mean_m(std::size_t pixel) const;
  double variance_m2(std::size_t pixel) const;
  std::vector<Tile> tiles() const;
  std::vector<Bin> bins() const;
  double correlation_px() const;

  rt::DepthModelParameters camera_{};
  std::uint64_t frames_ = 0;
  std::uint64_t holes_ = 0;
  std::vector<Pixel> pixels_;
  std::vector<float> depth_m_;     // of the newest frame; 0: a hole
  std::vector<float> previous_m_;  // of the frame before
  std::array<double, kLags + 1> products_{};
  std::array<double, kLags + 1> squares_{};
};

}  // namespace hapticd::tools
