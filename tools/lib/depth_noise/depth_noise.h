// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::tools {

/// What is left of a value over an image when the plane that fits best is subtracted.
class PlaneResidual {
 public:
  /// x, y: from the centre of the part of the image.
  void add(double x, double y, double value) {
    if (count_ == 0) origin_ = value;
    const double v = value - origin_;
    ++count_;
    x_ += x, y_ += y, v_ += v;
    xx_ += x * x, xy_ += x * y, yy_ += y * y;
    xv_ += x * v, yv_ += y * v, vv_ += v * v;
  }
  std::size_t count() const { return count_; }
  double mean() const { return origin_ + v_ / static_cast<double>(count_); }
  /// Returns the variance around the plane; 0 with fewer than four points, or points on a line.
  double variance() const {
    const auto n = static_cast<double>(count_);
    if (count_ < 4) return 0;
    const double xx = xx_ - x_ * x_ / n, xy = xy_ - x_ * y_ / n, yy = yy_ - y_ * y_ / n;
    const double xv = xv_ - x_ * v_ / n, yv = yv_ - y_ * v_ / n, vv = vv_ - v_ * v_ / n;
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 0)) return 0;
    const double a = (xv * yy - yv * xy) / determinant;
    const double b = (yv * xx - xv * xy) / determinant;
    const double left = vv - a * xv - b * yv;
    return left > 0 ? left / (n - 3) : 0;
  }

 private:
  std::size_t count_ = 0;
  double origin_ = 0;  // the first value, which keeps the sums precise
  double x_ = 0, y_ = 0, v_ = 0, xx_ = 0, xy_ = 0, yy_ = 0, xv_ = 0, yv_ = 0, vv_ = 0;
};

/// Noise of the pixels whose mean depth lies in one interval.
struct NoiseAtDepth {
  double depth_m = 0;
  double temporal_m = 0;   ///< standard deviation from frame to frame
  double static_m = 0;     ///< standard deviation of what is the same in each frame; 0 if not measured
  std::size_t pixels = 0;  ///< at this depth
  bool has_static = true;  ///< whether the static part was measured

  double sigma_m() const;  ///< of both parts
};

/// Fits sigma(Z) = c0 + c1 Z + c2 Z^2, all at least 0, with as few terms as explain the measurements. Where
/// these span less than a third of their depth, the one term of the camera's principle is fitted: c0 for time
/// of flight, c2 otherwise. The static share is the mean one. Depths without a measurement of the static
/// part are left out unless it was measured nowhere. Nothing without measurements.
std::optional<rt::DepthNoiseParameters> fittedNoise(std::span<const NoiseAtDepth> at_depths,
                                                    rt::DepthPrinciple principle);

/// What frames of a resting scene show of a camera's noise.
struct DepthNoiseReport {
  std::uint64_t frames = 0;
  double share_of_holes = 0;            ///< of all pixels of all frames, those without a measurement
  std::vector<NoiseAtDepth> at_depths;  ///< from near to far; empty: too few frames or pixels at rest
  double correlation_px = 1;            ///< of the part that changes from frame to frame
};

/// Separates the noise of a camera from the scene that it sees, which must rest: the temporal part is the
/// deviation of each pixel from its mean over the frames, the static part what is left of that mean on
/// surfaces that are locally plane.
/// Thread: one at a time.
class DepthNoise {
 public:
  /// Measurements of a pixel that its deviation takes at the least.
  static constexpr std::uint32_t kMinMeasurements = 8;

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
    double static_m2;  ///< variance of the static part; may be slightly negative
  };

  /// The pixels and tiles of one interval of depths.
  struct Bin {
    std::vector<double> variances_m2;  ///< of the pixels, from frame to frame
    std::vector<double> static_m2;     ///< of the tiles
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

/// Draws depths in metres, row by row and 0 for a hole, as lines of `columns` letters: '@' for the nearest,
/// '.' for the farthest, ' ' for holes. A letter stands for the mean of its part of the image, whose height
/// is twice its width, as letters are. Empty without any depth.
std::string depthPicture(const std::vector<double>& depth_m, int width_px, int height_px, int columns);

/// The noise for people: a line for each depth, the correlation length, the static share, and the lines for
/// the configuration. Says so where nothing was measured.
std::string textOf(const DepthNoiseReport& report, rt::DepthPrinciple principle);

/// The noise for programs: adds the members "noiseAtDepths" and "noise", which is null where nothing was
/// measured.
void addTo(nlohmann::ordered_json& document, const DepthNoiseReport& report, rt::DepthPrinciple principle);

}  // namespace hapticd::tools
