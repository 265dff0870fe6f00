// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include "rt/depth/depth_frame.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/recordings.h"

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
  constexpr float kMaxDeviation = 1.0F;
  constexpr float kMaxDrift = 0.7F;
  constexpr float kMaxDriftDeviations = 4;
  const float most_drift = std::max(kMaxDrift * pixel.noise_scale, kMaxDriftDeviations * pixel.drift_noise);
  return 10 * static_cast<std::size_t>(pixel.valid) >= 8 * frames &&
         pixel.deviation <= kMaxDeviation * pixel.noise_scale && std::abs(pixel.drift) <= most_drift;
}

namespace {

constexpr int kTermsOfQuadratic = 6;
constexpr int kMinHalf_px = 12;
constexpr double kMinRestingShare = 0.97;
constexpr double kMaxOutliers = 0.01;
constexpr double kMaxResidual_raw = 0.8;  // the static pattern of a Kinect is 0.24 to 0.56
// A surface that bends more within its size is no longer flat for a patch of 40 mm.
constexpr double kMinRadius_m = 0.3;

/// A square of pixels around a middle.
struct Square {
  int column;
  int row;
  int half_px;

  bool overlaps(const Square& other) const {
    const int reach = half_px + other.half_px;
    return std::abs(column - other.column) < reach && std::abs(row - other.row) < reach;
  }
};

/// Sums over rectangles of the image of whether pixels rest.
class RestingCount {
 public:
  RestingCount(std::span<const PixelStatistics> pixels, std::size_t frames, const CameraDisparity& camera)
      : row_length_(static_cast<std::size_t>(camera.width_px()) + 1),
        sums_(row_length_ * (static_cast<std::size_t>(camera.height_px()) + 1)) {
    for (int row = 0; row < camera.height_px(); ++row) {
      for (int column = 0; column < camera.width_px(); ++column) {
        at(column + 1, row + 1) = at(column, row + 1) + at(column + 1, row) - at(column, row) +
                                  (rests(pixels[camera.pixelOf(column, row)], frames) ? 1 : 0);
      }
    }
  }
  double share(const Square& square) {
    const int left = square.column - square.half_px;
    const int top = square.row - square.half_px;
    const int right = square.column + square.half_px + 1;
    const int bottom = square.row + square.half_px + 1;
    const int resting = at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top);
    return static_cast<double>(resting) / ((right - left) * (bottom - top));
  }

 private:
  int& at(int column, int row) {
    return sums_[static_cast<std::size_t>(row) * row_length_ + static_cast<std::size_t>(column)];
  }
  std::size_t row_length_;
  std::vector<int> sums_;
};

/// The largest curvature of the fitted surface along row and column at its middle, 1/m.
double curvatureOf(const CameraDisparity& camera, const RestingSurface& surface) {
  const auto bend = [&](double across_column, double across_row) {
    const double reach = 0.5 * surface.half_px;
    const SurfacePoint before = surfacePoint(camera, surface.fit, surface.column - reach * across_column,
                                             surface.row - reach * across_row);
    const SurfacePoint after = surfacePoint(camera, surface.fit, surface.column + reach * across_column,
                                            surface.row + reach * across_row);
    return norm(after.normal - before.normal) / norm(after.position_m - before.position_m);
  };
  return std::max(bend(1, 0), bend(0, 1));
}

std::vector<DisparitySample> samplesOf(std::span<const PixelStatistics> pixels, std::size_t frames,
                                       const CameraDisparity& camera, const Square& square, int step) {
  std::vector<DisparitySample> samples;
  for (int row = square.row - square.half_px; row <= square.row + square.half_px; row += step) {
    for (int column = square.column - square.half_px; column <= square.column + square.half_px;
         column += step) {
      const PixelStatistics& pixel = pixels[camera.pixelOf(column, row)];
      if (rests(pixel, frames))
        samples.push_back({static_cast<double>(column), static_cast<double>(row), pixel.mean});
    }
  }
  return samples;
}

std::optional<RestingSurface> surfaceIn(const Square& square, std::span<const PixelStatistics> pixels,
                                        std::size_t frames, const CameraDisparity& camera) {
  const int step = std::max(1, square.half_px / 16);
  const auto fit = fitDisparity(samplesOf(pixels, frames, camera, square, step), square.column, square.row,
                                square.half_px);
  if (!fit || fit->outlier_share > kMaxOutliers) return std::nullopt;
  const double noise_scale = camera.noiseScale(fit->quadratic.at(square.column, square.row));
  if (fit->residual_raw > kMaxResidual_raw * noise_scale) return std::nullopt;
  RestingSurface surface{.fit = fit->quadratic,
                         .column = static_cast<double>(square.column),
                         .row = static_cast<double>(square.row),
                         .half_px = square.half_px,
                         .residual_raw = fit->residual_raw};
  const SurfacePoint middle = surfacePoint(camera, surface.fit, surface.column, surface.row);
  surface.distance_m = -middle.position_m.z;
  if (curvatureOf(camera, surface) > 1 / kMinRadius_m) return std::nullopt;
  const double side_px = 2 * square.half_px + 1;
  // samples that are farther apart than errors are alike are independent
  const double alike_px = std::max(camera.correlation_px(), static_cast<double>(step));
  const double error_raw = fitError(fit->residual_raw, side_px * side_px, kTermsOfQuadratic, alike_px);
  surface.fit_error_m = error_raw * camera.unit_m(surface.distance_m) * middle.normal.z;
  return surface;
}

/// The square of `size_m` around a pixel, if it is in the image.
std::optional<Square> squareAround(int column, int row, double size_m, double distance_m,
                                   const CameraDisparity& camera) {
  const Square square{
      column, row,
      static_cast<int>(std::lround(size_m * camera.model().parameters().fx_px / distance_m / 2))};
  const bool inside = column - square.half_px >= 0 && row - square.half_px >= 0 &&
                      column + square.half_px < camera.width_px() &&
                      row + square.half_px < camera.height_px();
  if (!inside || square.half_px < kMinHalf_px) return std::nullopt;
  return square;
}

/// Returns all candidates of one size.
std::vector<RestingSurface> candidates(std::span<const PixelStatistics> pixels, std::size_t frames,
                                       RestingCount& resting, const CameraDisparity& camera, double size_m) {
  constexpr int kStride_px = 8;
  const rt::DepthModelParameters& limits = camera.model().parameters();
  std::vector<RestingSurface> found;
  for (int row = 0; row < camera.height_px(); row += kStride_px) {
    for (int column = 0; column < camera.width_px(); column += kStride_px) {
      const PixelStatistics& middle = pixels[camera.pixelOf(column, row)];
      const double distance_m = camera.depth_m(double{middle.mean});
      if (!rests(middle, frames) || distance_m < limits.near_m || distance_m >= limits.far_m) continue;
      const auto square = squareAround(column, row, size_m, distance_m, camera);
      if (!square || resting.share(*square) < kMinRestingShare) continue;
      if (auto surface = surfaceIn(*square, pixels, frames, camera)) {
        surface->size_m = size_m;
        found.push_back(*surface);
      }
    }
  }
  return found;
}

}  // namespace

std::size_t distanceClassOf(double distance_m, std::span<const double> borders_m) {
  const auto above = std::ranges::upper_bound(borders_m, distance_m);
  return static_cast<std::size_t>(above - borders_m.begin());
}

double fitError(double residual_raw, double pixels, int terms, double correlation_px) {
  // The covariance of noise that is smoothed by a square adds up to the variance times the square's area.
  const double samples = pixels / (correlation_px * correlation_px);
  // A fit takes some of the pattern for the surface, so that less of it is left about it.
  const double share_left = std::max(1 - terms / samples, 0.1);
  return residual_raw / std::sqrt(share_left) * std::sqrt(terms / samples);
}

std::vector<RestingSurface> restingSurfaces(std::span<const PixelStatistics> pixels, std::size_t frames,
                                            const CameraDisparity& camera,
                                            const RestingSurfaceOptions& options) {
  RestingCount resting(pixels, frames, camera);
  std::vector<RestingSurface> chosen;
  for (const double size_m : options.sizes_m) {
    std::vector<RestingSurface> found = candidates(pixels, frames, resting, camera, size_m);
    std::ranges::stable_sort(found, {}, &RestingSurface::residual_raw);
    std::vector<int> of_class(options.class_borders_m.size() + 1, 0);
    std::vector<Square> taken;
    for (const RestingSurface& surface : found) {
      int& count = of_class[distanceClassOf(surface.distance_m, options.class_borders_m)];
      const Square square{static_cast<int>(surface.column), static_cast<int>(surface.row), surface.half_px};
      const bool overlaps =
          std::ranges::any_of(taken, [&square](const Square& other) { return square.overlaps(other); });
      if (count >= options.most_per_class || overlaps) continue;
      ++count;
      taken.push_back(square);
      chosen.push_back(surface);
    }
  }
  return chosen;
}

namespace {

using rt::Vec3;

constexpr double kDepth_m = 0.008;
constexpr double kStart_m = 0.03;
constexpr double kStep_m = 1e-4;  // 0.1 m/s at 1 kHz
constexpr int kWaitTicks = 700;   // 20 frames, more than any law takes a mean over
constexpr int kStillTicks = 2000;
constexpr int kCalmTicks = 150;  // from the end of the push to where forces count
constexpr double kMaxStroke_m = 0.1;
constexpr double kBorder_m = 0.025;  // from the end of a stroke to where the surface is no longer known

int strokeTicks(const RestingSurface& surface) {
  const double length_m = std::clamp(surface.size_m - 2 * kBorder_m, 0.0, kMaxStroke_m);
  return static_cast<int>(std::lround(length_m / kStep_m));
}

/// A path over a surface in steps of equal length.
class SurfaceWalk {
 public:
  SurfaceWalk(const RestingSurface& surface, const CameraDisparity& camera, Handling handling)
      : surface_(surface),
        camera_(camera),
        across_column_(handling == Handling::along_row ? 1 : 0),
        across_row_(handling == Handling::along_column ? 1 : 0),
        column_(surface.column),
        row_(surface.row) {}

  void step(double length_m) {
    if (length_m == 0) return;
    const auto ahead = surfacePoint(camera_, surface_.fit, column_ + across_column_, row_ + across_row_);
    const double pixels = length_m / norm(ahead.position_m - point().position_m);
    column_ += pixels * across_column_;
    row_ += pixels * across_row_;
  }
  SurfacePoint point() const { return surfacePoint(camera_, surface_.fit, column_, row_); }

 private:
  const RestingSurface& surface_;
  const CameraDisparity& camera_;
  double across_column_;
  double across_row_;
  double column_;
  double row_;
};

StrokeTick tickAt(const SurfacePoint& point, double depth_m, double stiffness) {
  return {.hip_m = point.position_m - depth_m * point.normal,
          .true_force_n = stiffness * std::max(0.0, depth_m) * point.normal,
          .normal = point.normal,
          .along = {},
          .presses = false};
}

}  // namespace

std::vector<StrokeTick> handleSurface(const RestingSurface& surface, const CameraDisparity& camera,
                                      Handling handling, double stiffness_n_per_m) {
  SurfaceWalk walk(surface, camera, handling);
  const bool strokes = handling != Handling::still;
  const int stroke_ticks = strokes ? strokeTicks(surface) : 0;
  walk.step(-kStep_m * stroke_ticks / 2);
  std::vector<StrokeTick> ticks;
  const auto stay = [&](double depth_m, int count, bool presses) {
    for (int i = 0; i < count; ++i) {
      ticks.push_back(tickAt(walk.point(), depth_m, stiffness_n_per_m));
      ticks.back().presses = presses;
    }
  };
  stay(-kStart_m, kWaitTicks, false);
  for (double depth_m = -kStart_m; depth_m < kDepth_m; depth_m += kStep_m) stay(depth_m, 1, false);
  stay(kDepth_m, kCalmTicks, false);
  if (!strokes) stay(kDepth_m, kStillTicks, true);
  for (int i = 0; i < stroke_ticks; ++i) {
    const Vec3 before = walk.point().position_m;
    walk.step(kStep_m);
    const Vec3 moved = walk.point().position_m - before;
    stay(kDepth_m, 1, true);
    ticks.back().along = (1 / norm(moved)) * moved;
  }
  return ticks;
}

namespace {

constexpr double kLostShare = 0.1;

bool isStill(const StrokeTick& tick) {
  return tick.along == Vec3{};
}

}  // namespace

void SurfaceError::add(const SurfaceError& other) {
  error_n.insert(error_n.end(), other.error_n.begin(), other.error_n.end());
  along_n.insert(along_n.end(), other.along_n.begin(), other.along_n.end());
  new_frame_n.insert(new_frame_n.end(), other.new_frame_n.begin(), other.new_frame_n.end());
  lost += other.lost;
  zero += other.zero;
  largest_true_n = std::max(largest_true_n, other.largest_true_n);
}

SurfaceError judgeSurface(std::span<const StrokeTick> ticks, std::span<const Vec3> forces_n,
                          const std::vector<bool>& new_frame) {
  SurfaceError result;
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const StrokeTick& tick = ticks[i];
    if (!tick.presses) continue;
    const double true_n = norm(tick.true_force_n);
    result.error_n.push_back(norm(forces_n[i] - tick.true_force_n));
    if (dot(forces_n[i], tick.normal) < kLostShare * true_n) ++result.lost;
    if (norm(forces_n[i]) == 0) ++result.zero;
    result.largest_true_n = std::max(result.largest_true_n, true_n);
    if (!isStill(tick)) result.along_n.push_back(dot(forces_n[i], tick.along));
    if (isStill(tick) && new_frame[i]) result.new_frame_n.push_back(norm(forces_n[i] - forces_n[i - 1]));
  }
  return result;
}

SurfaceError handleWith(const std::string& law, const BenchSequence& session, const RestingSurface& surface,
                        const CameraDisparity& camera, Handling handling) {
  const auto box = shippedBox(law, surface.distance_m, session.camera());
  const auto ticks = handleSurface(surface, camera, handling, box->parameters().force.stiffness_n_per_m);
  PlayedSession played(session);
  FramePlayer player(*box, played.stream());
  std::vector<Vec3> forces_n;
  std::vector<bool> new_frame;
  for (const StrokeTick& tick : ticks) {
    forces_n.push_back(player.tick(tick.hip_m).law_force_n_in_world);
    new_frame.push_back(player.frameIsNew());
  }
  return judgeSurface(ticks, forces_n, new_frame);
}

}  // namespace hapticd::tools
