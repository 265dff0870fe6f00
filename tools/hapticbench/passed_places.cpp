// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/recordings.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr float kSameSurface_raw = 2.5F;  // noise, flicker and rounding of a Kinect stay within that
constexpr double kCoverBefore_m = 0.06;   // what is nearer than the background by more is another body
constexpr double kFromNear_m = 0.05;      // of the camera's limits, so that noise stays within them
constexpr double kFromFar_m = 0.5;
constexpr int kBorder_px = 24;

/// Content of a frame in the square around a position.
struct SquareContent {
  int pixels = 0;
  int nearer = 0;  ///< than the surface, by so much that it is another body
  int unmeasured = 0;

  bool covered() const { return nearer > 0 || 2 * unmeasured > pixels; }
  /// Whether something passed: more pixels are nearer than the flying pixels of an edge.
  bool passed() const { return 10 * nearer >= pixels; }
};
SquareContent contentOf(const rt::DepthFrame& frame, const CameraDisparity& camera, const PassedPlace& place,
                        double nearest_raw) {
  SquareContent content;
  const auto middle_column = static_cast<int>(place.column);
  const auto middle_row = static_cast<int>(place.row);
  for (int row = middle_row - place.half_px; row <= middle_row + place.half_px; ++row) {
    for (int column = middle_column - place.half_px; column <= middle_column + place.half_px; ++column) {
      const float raw = camera.of(frame.raw[camera.pixelOf(column, row)]);
      ++content.pixels;
      if (std::isnan(raw)) {
        ++content.unmeasured;
      } else if (camera.isNearer(double{raw}, nearest_raw)) {
        ++content.nearer;
      }
    }
  }
  return content;
}

std::optional<PassedPlace> placeAt(int column, int row, const BenchSequence& session,
                                   std::span<const float> background, const CameraDisparity& camera) {
  constexpr double kPatch_m = 0.04;
  constexpr double kFitted_m = 0.12;
  constexpr int kMinHalf_px = 8;
  constexpr double kMaxResidual_raw = 1;
  constexpr int kMinFramesInSight = 15;
  constexpr int kMinFramesPassed = 2;
  const float raw = background[camera.pixelOf(column, row)];
  if (!std::isfinite(raw)) return std::nullopt;
  const rt::DepthModelParameters& pinhole = camera.model().parameters();
  const double depth = camera.depth_m(double{raw});
  if (depth < pinhole.near_m + kFromNear_m || depth > pinhole.far_m - kFromFar_m) return std::nullopt;
  const int fitted_px =
      std::max(kMinHalf_px, static_cast<int>(std::lround(kFitted_m / 2 * pinhole.fx_px / depth)));
  const bool inside = column >= kBorder_px + fitted_px &&
                      column < camera.width_px() - kBorder_px - fitted_px && row >= kBorder_px + fitted_px &&
                      row < camera.height_px() - kBorder_px - fitted_px;
  if (!inside) return std::nullopt;
  std::vector<DisparitySample> samples;
  int pixels = 0;
  for (int v = row - fitted_px; v <= row + fitted_px; v += 2) {
    for (int u = column - fitted_px; u <= column + fitted_px; u += 2) {
      ++pixels;
      const float at = background[camera.pixelOf(u, v)];
      if (std::isfinite(at)) samples.push_back({static_cast<double>(u), static_cast<double>(v), double{at}});
    }
  }
  if (10 * samples.size() < 9 * static_cast<std::size_t>(pixels)) return std::nullopt;
  const auto fit = fitDisparity(samples, column, row, fitted_px);
  if (!fit || fit->outlier_share > 0.02) return std::nullopt;
  const double middle_raw = fit->quadratic.at(column, row);
  if (fit->residual_raw > kMaxResidual_raw * camera.noiseScale(middle_raw)) return std::nullopt;
  PassedPlace place{.surface = fit->quadratic,
                    .column = static_cast<double>(column),
                    .row = static_cast<double>(row),
                    .point = surfacePoint(camera, fit->quadratic, column, row),
                    .covered = {}};
  place.distance_m = -place.point.position_m.z;
  place.half_px = std::max(2, static_cast<int>(std::lround(kPatch_m / 2 * pinhole.fx_px / depth)));
  const double nearest_raw = camera.ofDepth(camera.depth_m(middle_raw) - kCoverBefore_m);
  int passed = 0;
  for (const auto& frame : session.frames) {
    const SquareContent content = contentOf(*frame, camera, place, nearest_raw);
    place.covered.push_back(content.covered());
    if (content.passed()) ++passed;
  }
  if (passed < kMinFramesPassed || longestInSight(place.covered).frames < kMinFramesInSight)
    return std::nullopt;
  return place;
}

}  // namespace

InSight longestInSight(const std::vector<bool>& covered) {
  InSight longest;
  int run = 0;
  for (int frame = 0; frame < static_cast<int>(covered.size()); ++frame) {
    run = covered[static_cast<std::size_t>(frame)] ? 0 : run + 1;
    if (run > longest.frames) longest = {frame + 1 - run, run};
  }
  return longest;
}

std::vector<float> restingBackground(const BenchSequence& session, std::span<const PixelStatistics> pixels,
                                     const CameraDisparity& camera) {
  std::vector<float> background(pixels.size(), std::numeric_limits<float>::quiet_NaN());
  const std::size_t frames = session.frames.size();
  for (std::size_t pixel = 0; pixel < pixels.size(); ++pixel) {
    const float farthest = pixels[pixel].farthest;
    const float same_surface = kSameSurface_raw * pixels[pixel].noise_scale;
    double sum = 0;
    std::size_t count = 0;
    for (const auto& frame : session.frames) {
      const float raw = camera.of(frame->raw[pixel]);
      if (std::isnan(raw) || std::abs(raw - farthest) > same_surface) continue;
      sum += double{raw};
      ++count;
    }
    if (pixels[pixel].valid > 0 && 10 * count >= 3 * frames)
      background[pixel] = static_cast<float>(sum / static_cast<double>(count));
  }
  return background;
}

std::vector<PassedPlace> passedPlaces(const BenchSequence& session, std::span<const float> background,
                                      const CameraDisparity& camera, int most) {
  constexpr int kStride_px = 12;
  std::vector<PassedPlace> candidates;
  for (int row = 0; row < camera.height_px(); row += kStride_px) {
    for (int column = 0; column < camera.width_px(); column += kStride_px) {
      if (auto place = placeAt(column, row, session, background, camera))
        candidates.push_back(std::move(*place));
    }
  }
  // each next one is the one that is farthest from those before
  std::vector<PassedPlace> chosen;
  while (!candidates.empty() && static_cast<int>(chosen.size()) < most) {
    const auto apart = [&chosen](const PassedPlace& candidate) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const PassedPlace& other : chosen)
        nearest = std::min(nearest, std::hypot(candidate.column - other.column, candidate.row - other.row));
      return nearest;
    };
    const auto next = std::ranges::max_element(candidates, {}, apart);
    chosen.push_back(std::move(*next));
    candidates.erase(next);
  }
  return chosen;
}

bool measuresNear(const rt::DepthFrame& frame, const CameraDisparity& camera, const PassedPlace& place,
                  const Vec3& centre_m, double radius_m, double before_m) {
  const double depth = -centre_m.z;
  const rt::DepthModelParameters& pinhole = camera.model().parameters();
  const auto reach = static_cast<int>(std::ceil(radius_m * pinhole.fx_px / (depth - radius_m))) + 1;
  const auto middle_column =
      static_cast<int>(std::lround(pinhole.cx_px + pinhole.fx_px * centre_m.x / depth));
  const auto middle_row = static_cast<int>(std::lround(pinhole.cy_px - pinhole.fy_px * centre_m.y / depth));
  for (int row = std::max(0, middle_row - reach); row <= std::min(camera.height_px() - 1, middle_row + reach);
       ++row) {
    for (int column = std::max(0, middle_column - reach);
         column <= std::min(camera.width_px() - 1, middle_column + reach); ++column) {
      const float raw = camera.of(frame.raw[camera.pixelOf(column, row)]);
      if (std::isnan(raw)) continue;
      const Vec3 point = camera.pointOf(column, row, double{raw});
      const bool is_before = dot(point - place.point.position_m, place.point.normal) > before_m;
      if (is_before && norm(point - centre_m) <= radius_m) return true;
    }
  }
  return false;
}

namespace {

constexpr double kGhost_n = 0.1;
constexpr double kWrong_n = 0.5;
constexpr double kNear_m = 0.02;
constexpr long kEnterTick = 150;  // the law has seen five frames
constexpr double kEnter_m_per_tick = 2e-4;
constexpr double kWaitBefore_m = 0.03;
constexpr long kCountFromTick = 450;  // in sight until then
constexpr long kAfterCover_ticks = 200;

}  // namespace

void PassingError::add(const PassingError& other) {
  left_out += other.left_out;
  ghost.add(other.ghost);
  ghost_covered.add(other.ghost_covered);
  error.add(other.error);
  change.add(other.change);
  calm.add(other.calm);
}

PassingError judgePassing(const std::vector<PassingTick>& ticks) {
  PassingError result;
  const bool presses =
      std::ranges::any_of(ticks, [](const PassingTick& tick) { return !(tick.true_n == Vec3{}); });
  Vec3 sum_n;
  double calm_ticks = 0;
  for (const PassingTick& tick : ticks) {
    if (tick.covered || tick.left_out) continue;
    sum_n += tick.force_n;
    calm_ticks += 1;
  }
  const Vec3 usual_n = calm_ticks > 0 ? (1 / calm_ticks) * sum_n : Vec3{};
  std::vector<double> ghosts, ghosts_covered, errors, changes, calm_changes;
  for (const PassingTick& tick : ticks) {
    if (tick.left_out) {
      ++result.left_out;
      // it ends a run
      errors.push_back(0);
      changes.push_back(0);
    } else if (!presses) {
      ghosts.push_back(norm(tick.force_n));
      if (tick.covered) ghosts_covered.push_back(norm(tick.force_n));
    } else {
      errors.push_back(tick.covered ? norm(tick.force_n - tick.true_n) : 0);
      const double change_n = norm(tick.force_n - usual_n);
      changes.push_back(tick.covered ? change_n : 0);
      calm_changes.push_back(tick.covered ? 0 : change_n);
    }
  }
  result.ghost = exceedance(ghosts, kGhost_n);
  result.ghost_covered = exceedance(ghosts_covered, kGhost_n);
  if (presses) {
    result.error = exceedance(errors, kWrong_n);
    result.change = exceedance(changes, kWrong_n);
    result.calm = exceedance(calm_changes, kWrong_n);
  }
  return result;
}

PassingError passPlace(const std::string& law, const BenchSequence& session, const PassedPlace& place,
                       const CameraDisparity& camera, double before_m) {
  const auto box = shippedBox(law, place.distance_m, session.camera());
  const double stiffness = box->parameters().force.stiffness_n_per_m;
  const int first = longestInSight(place.covered).first;
  PlayedSession played(session, first);
  FramePlayer player(*box, played.stream());
  const long end = played.arrivalTick(2 * static_cast<int>(session.frames.size()) - 2);
  // a measurement this much before the surface is not the surface
  const double noise_unit_m = camera.model().noiseUnit_m(place.distance_m);
  const double apart_m = before_m > 0 ? -1 : std::max(0.008, 2.5 * noise_unit_m);
  std::vector<PassingTick> ticks;
  long covered_until = -1;
  bool near = false;
  for (long tick = 0; tick < end; ++tick) {
    const double displacement_m = kEnter_m_per_tick * static_cast<double>(std::max(0L, tick - kEnterTick));
    const double front_m = std::max(before_m, kWaitBefore_m - displacement_m);
    const Vec3 hip = place.point.position_m + front_m * place.point.normal;
    PassingTick now{.force_n = player.tick(hip).law_force_n_in_world,
                    .true_n = stiffness * std::max(0.0, -front_m) * place.point.normal};
    const auto frame = static_cast<std::size_t>(played.frameOfSession(player.frame()));
    if (place.covered[frame]) covered_until = tick + kAfterCover_ticks;
    if (player.frameIsNew())
      near = measuresNear(*session.frames[frame], camera, place, hip, kNear_m, apart_m);
    now.covered = tick <= covered_until;
    now.left_out = near;
    if (tick >= kCountFromTick) ticks.push_back(now);
  }
  return judgePassing(ticks);
}

}  // namespace hapticd::tools
