// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "rt/base/clock.h"
#include "rt/depth/depth_model.h"
#include "rt/tracking/solid_tracker.h"
#include "tools/hapticbench/disparity.h"
#include "tools/hapticbench/engine/sequences.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/recordings.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/known_solid.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// A depth camera that tracks, and where the noise of its frames comes from.
enum class TrackingNoise : std::uint8_t {
  kinect,    ///< of the synthetic Kinect, as in a recorded room
  harsh,     ///< of the synthetic Kinect, as of two other devices
  recorded,  ///< a Kinect's, added from the frames of a resting recording: what changes from frame to frame
  d405,      ///< of a RealSense D405 by its vendor's figures, 848 x 480
};
constexpr auto wordsOf(TrackingNoise) {
  return rt::words<TrackingNoise>("kinect", "harsh", "recorded", "d405");
}

/// What changes from frame to frame in a recording of a scene at rest, raw units of a Kinect v1.
class RecordedNoise {
 public:
  /// Nothing unless the recording is of a Kinect and most of its pixels rest.
  static std::optional<RecordedNoise> of(const BenchSequence& session);

  /// Adds the noise of a frame to exact raw values, row by row without padding, and rounds: the pattern of
  /// any number is shifted over the image, so that there are more of them than frames. Pixels that did not
  /// rest become unmeasured.
  void deliver(std::uint32_t number, const std::vector<float>& exact, rt::DepthFrame& frame) const;

 private:
  std::vector<std::vector<float>> residuals_;  // of each frame, row by row without padding; NaN: did not rest
};

struct TrackingCase {
  SolidKind solid = SolidKind::organ;
  TrackingNoise noise = TrackingNoise::kinect;
  double distance_m = 0.6;
};

struct TrackingSettings {
  int trials = 20;       ///< poses of the solid, each with its own frame and five starts nearby
  int bad_starts = 200;  ///< for each case, shared among its poses
  double limit_m = rt::TrackingLimits{}.max_target_error_m;
  std::uint32_t seed = 1;
};

/// Results of one case. Errors are those of the target, where the surface faces the camera, and of a place 30
/// mm behind the solid's middle.
struct TrackingRow {
  TrackingCase chosen;
  std::vector<double> near_m;  ///< of all fits, with every direction estimated
  std::vector<double> far_m;
  std::vector<double> rotation_rad;
  std::vector<double> accepted_near_m;  ///< of the results that may be used, with the limits as shipped
  std::vector<double> expected_m;       ///< by the tracker, standard deviation, all directions estimated
  std::vector<double> points;
  std::vector<double> condition;
  std::vector<double> cpu_s;  ///< CPU time of the steps from nearby starts
  double floor_near_m = 0;  ///< standard deviation that the noise allows; infinite where a motion is not seen
  int starts = 0;           ///< from nearby
  int refused = 0;          ///< of these
  std::vector<int> verdicts;  ///< of these, by TrackingVerdict
  int failures = 0;  ///< hard cases whose result is off by more than the limit, or where there is no solid
  int failures_found = 0;  ///< of these, refused
  int hard_cases = 0;      ///< bad starts, occlusions, other bodies and none
  int hard_accepted = 0;   ///< of these, accepted and right

  double foundPercent() const { return failures == 0 ? 100 : 100.0 * failures_found / failures; }
  int wronglyAccepted() const { return failures - failures_found; }
};

std::optional<RecordedNoise> RecordedNoise::of(const BenchSequence& session) {
  if (!isKinect(session.camera())) return std::nullopt;
  const CameraDisparity camera(session.camera());
  const std::vector<PixelStatistics> pixels = pixelStatistics(session, camera);
  std::size_t at_rest = 0;
  RecordedNoise noise;
  for (const auto& frame : session.frames) {
    auto& residual = noise.residuals_.emplace_back();
    for (int row = 0; row < camera.height_px(); ++row) {
      for (int column = 0; column < camera.width_px(); ++column) {
        const std::size_t pixel = camera.pixelOf(column, row);
        const bool counts = rests(pixels[pixel], session.frames.size());
        at_rest += counts ? 1 : 0;
        // Not measured in this frame: NaN as well.
        residual.push_back(counts ? camera.of(frame->raw[pixel]) - pixels[pixel].mean
                                  : std::numeric_limits<float>::quiet_NaN());
      }
    }
  }
  const std::size_t all = noise.residuals_.size() * noise.residuals_.front().size();
  return 2 * at_rest > all ? std::optional(std::move(noise)) : std::nullopt;
}

void RecordedNoise::deliver(std::uint32_t number, const std::vector<float>& exact,
                            rt::DepthFrame& frame) const {
  const std::vector<float>& residual = residuals_[number % residuals_.size()];
  const auto width = static_cast<std::size_t>(frame.camera.width_px);
  const auto height = static_cast<std::size_t>(frame.camera.height_px);
  std::mt19937 random(number);
  const std::size_t right = random() % width;
  const std::size_t down = random() % height;
  std::ranges::fill(frame.image(), frame.camera.raw_no_measurement);
  const auto stride = static_cast<std::size_t>(rt::strideOf(frame.camera.width_px));
  for (std::size_t row = 0; row < height; ++row) {
    for (std::size_t column = 0; column < width; ++column) {
      const float value = exact[row * width + column];
      const float noise = residual[(row + down) % height * width + (column + right) % width];
      if (!(value >= 0) || std::isnan(noise)) continue;
      frame.raw[row * stride + column] =
          static_cast<std::uint16_t>(std::clamp(std::lround(value + noise), 0L, 2046L));
    }
  }
}

/// Rotations are in units of 1 m / kLength_m, which makes all six coordinates alike.
constexpr double kLength_m = 0.04;

/// A row of the model: how the distance of a point changes with the pose, in the solid's frame.
struct PointRow {
  Eigen::Matrix<double, 1, 6> slope;
  double sigma_m = 0;     // of the distance, by the noise
  double rounding_m = 0;  // of the distance, by rounding to raw values
  double column = 0;
  double row = 0;
};

std::vector<PointRow> rowsOf(const rt::DistanceGrid& grid, const rt::SolidPose& truth,
                             std::span<const rt::TrackingPoint> points,
                             const rt::DepthModelParameters& camera, double scale) {
  std::vector<PointRow> rows;
  const Vec3 eye_m = truth.placeIn({});
  constexpr double kGateSigmas = 5;
  for (const rt::TrackingPoint& point : points) {
    const Vec3 place_m = truth.placeIn(point.place_m);
    const rt::GridDistance found = distanceAt(grid, place_m);
    const Vec3 normal = (1 / norm(found.gradient)) * found.gradient;
    const double cosine = dot(normal, eye_m - place_m) / norm(eye_m - place_m);
    if (cosine < rt::kMinSightCosine) continue;
    if (std::abs(found.distance_m) > kGateSigmas * point.depth_sigma_m) continue;
    const double depth_m = -point.place_m.z;
    const double unit_m =
        camera.law == rt::DepthLawKind::linear ? camera.unit_m : std::abs(camera.a_per_m) * depth_m * depth_m;
    const Vec3 turn = (1 / kLength_m) * cross(place_m - found.distance_m * normal, normal);
    PointRow row;
    row.slope << turn.x, turn.y, turn.z, normal.x, normal.y, normal.z;
    row.sigma_m = scale * cosine * point.depth_sigma_m;
    row.rounding_m = cosine * unit_m / std::sqrt(12.0);
    row.column = camera.cx_px + camera.fx_px * point.place_m.x / depth_m;
    row.row = camera.cy_px - camera.fy_px * point.place_m.y / depth_m;
    rows.push_back(row);
  }
  return rows;
}

/// Smallest standard deviation of an unbiased estimate of where a place of the solid is (Cramer-Rao bound),
/// from points of a camera at the origin with this noise and correlation, and rounding; infinite where they
/// do not determine it. `scale`: of the stated noise.
double trackingFloor_m(const rt::DistanceGrid& grid, const rt::SolidPose& truth,
                       std::span<const rt::TrackingPoint> points, const rt::DepthModelParameters& camera,
                       double scale, const Vec3& target_m_in_solid) {
  const std::vector<PointRow> rows = rowsOf(grid, truth, points, camera, scale);
  const auto count = static_cast<Eigen::Index>(rows.size());
  constexpr double kUndetermined = std::numeric_limits<double>::infinity();
  if (count < 6) return kUndetermined;
  Eigen::MatrixXd covariance(count, count);
  Eigen::MatrixXd slopes(count, 6);
  const double correlation_px = camera.noise.correlation_px;
  for (Eigen::Index i = 0; i < count; ++i) {
    const PointRow& a = rows[static_cast<std::size_t>(i)];
    slopes.row(i) = a.slope;
    for (Eigen::Index j = 0; j <= i; ++j) {
      const PointRow& b = rows[static_cast<std::size_t>(j)];
      const double across = std::max(0.0, 1 - std::abs(a.column - b.column) / correlation_px);
      const double down = std::max(0.0, 1 - std::abs(a.row - b.row) / correlation_px);
      covariance(i, j) = covariance(j, i) = a.sigma_m * b.sigma_m * across * down;
    }
    covariance(i, i) += a.rounding_m * a.rounding_m;
  }
  const Eigen::Matrix<double, 6, 6> information = slopes.transpose() * covariance.llt().solve(slopes);
  // The normals of a grid differ a little from those of its solid, so that a motion that does not show seems
  // to.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(information);
  constexpr double kSmallest = 1e-4;
  const auto& eigenvalues = solver.eigenvalues();
  if (!(eigenvalues(0) > kSmallest * eigenvalues(5))) return kUndetermined;
  const Vec3 t = (1 / kLength_m) * target_m_in_solid;
  Eigen::Matrix<double, 3, 6> shift;
  shift << 0, t.z, -t.y, 1, 0, 0,  //
      -t.z, 0, t.x, 0, 1, 0,       //
      t.y, -t.x, 0, 0, 0, 1;
  const Eigen::Matrix<double, 3, 6> along = shift * solver.eigenvectors();
  return std::sqrt((along * eigenvalues.cwiseInverse().asDiagonal() * along.transpose()).trace());
}

using rt::SolidPose;
using rt::Tracking;
using rt::TrackingVerdict;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kGridSpacing_m = 0.001;
constexpr double kWallBehind_m = 0.1;
constexpr double kNearShift_m = 0.005;
constexpr double kNearRotation_rad = 4 * kDegree;
constexpr int kNearStarts = 5;
constexpr double kBadShift_m = 0.03;
constexpr double kBadRotation_rad = 25 * kDegree;
constexpr double kFarBehind_m = 0.03;
/// Below it a direction is none that the shape shows, such as the rotation of a sphere on a grid.
constexpr double kPlainCondition = 1e-4;

rt::DepthModelParameters cameraOf(TrackingNoise noise) {
  return noise == TrackingNoise::d405 ? stereoCamera(848, 480, 87, 0.018, 1e-4, 0.07, 2.0)
                                      : kinectWithNoise();
}

/// One solid before one camera, at many poses.
class TrackingRun {
 public:
  TrackingRun(const TrackingCase& chosen, const TrackingSettings& settings, const RecordedNoise* recorded)
      : settings_(settings),
        recorded_(recorded),
        solid_(chosen.solid, kGridSpacing_m),
        model_(cameraOf(chosen.noise), {}),
        camera_(model_.parameters()),
        sensor_(settings.seed),
        random_(settings.seed),
        tracker_(solid_.grid()) {
    row_.chosen = chosen;
    row_.verdicts.resize(rt::kWords<TrackingVerdict>.size());
    frame_->camera = model_.parameters();
    limits_.max_target_error_m = settings.limit_m;
  }

  TrackingRow measure() {
    const int bad_starts = (settings_.bad_starts + settings_.trials - 1) / settings_.trials;
    for (int trial = 0; trial < settings_.trials; ++trial) {
      place();
      show({{row_.chosen.solid, truth_}});
      for (int start = 0; start < kNearStarts; ++start) nearStart(trial == 0 && start == 0);
      for (int start = 0; start < bad_starts; ++start) {
        const double times = 1 + start % 4;
        predict(times * kBadShift_m, times * kBadRotation_rad);
        judge(/*is_there=*/true);
      }
      showBehindOther(trial);
      for (int start = 0; start < kNearStarts; ++start) {
        predict(start * kNearShift_m, start * kNearRotation_rad);
        judge(/*is_there=*/true);
      }
      showOtherInstead(trial);
      for (int start = 0; start < kNearStarts; ++start) {
        predict(start * kNearShift_m, start * kNearRotation_rad);
        judge(/*is_there=*/false);
      }
    }
    return row_;
  }

 private:
  void place() {
    const double distance_m = row_.chosen.distance_m;
    truth_ = rt::movedInSolid(
        {.position_m = {0.05 * distance_m * uniform(), 0.05 * distance_m * uniform(), -distance_m}}, {},
        0.25 * direction(), {});
    const Vec3 towards = (-1 / norm(truth_.position_m)) * truth_.directionIn(truth_.position_m);
    double along_m = 0.1;
    for (int step = 0; step < 200; ++step) along_m -= distanceFrom(row_.chosen.solid, along_m * towards);
    near_m_ = along_m * towards;
    far_m_ = -kFarBehind_m * towards;
    request_ = {};
    request_.target_m_in_solid = near_m_;
    // The solid has moved a little since the last frame.
    request_.last = rt::movedInSolid(truth_, {}, 0.03 * direction(), 0.003 * direction());
  }
  void show(const std::vector<PlacedSolid>& solids) {
    tools::measure(solids, row_.chosen.distance_m + kWallBehind_m, camera_);
    ++frames_;
    if (row_.chosen.noise == TrackingNoise::recorded) {
      recorded_->deliver(static_cast<std::uint32_t>(frames_) + 1000 * settings_.seed, camera_.exact(),
                         *frame_);
    } else {
      const SceneNoise noise =
          row_.chosen.noise == TrackingNoise::harsh ? SceneNoise::harsh : SceneNoise::sensor;
      sensor_.deliver(camera_, frames_, noise, *frame_);
    }
    camera_.removeOutsideLimits(*frame_);
  }
  /// A rod or a plate 40 to 100 mm before the solid.
  void showBehindOther(int trial) {
    PlacedSolid before{trial % 2 == 0 ? SolidKind::cylinder : SolidKind::plate, truth_};
    before.T_world_solid = rt::movedInSolid(truth_, {}, {0, 0, uniform()}, {});
    before.T_world_solid.position_m += Vec3{0.07 * uniform(), 0.06 * uniform(), 0.07 + 0.03 * uniform()};
    show({before, {row_.chosen.solid, truth_}});
  }
  /// Another solid, or none every fourth time.
  void showOtherInstead(int trial) {
    if (trial % 4 == 0) return show({});
    std::vector<SolidKind> others;
    for (const SolidKind kind : kAllSolids) {
      if (kind != row_.chosen.solid) others.push_back(kind);
    }
    SolidPose pose = truth_;
    pose.position_m += 0.01 * direction();
    show({{others[static_cast<std::size_t>(trial) % others.size()], pose}});
  }

  void predict(double shift_m, double rotation_rad) {
    request_.predicted = rt::movedInSolid(truth_, {}, rotation_rad * direction(), shift_m * direction());
  }
  double errorAt_m(const SolidPose& pose, const Vec3& place_m) const {
    return norm(pose.placeOut(place_m) - truth_.placeOut(place_m));
  }

  void nearStart(bool with_floor) {
    predict(kNearShift_m, kNearRotation_rad);
    const std::int64_t begin_ns = rt::threadCpu_ns();
    const Tracking found = tracker_.step(model_, frame_->image(), request_, limits_);
    row_.cpu_s.push_back(1e-9 * static_cast<double>(rt::threadCpu_ns() - begin_ns));
    ++row_.starts;
    ++row_.verdicts[static_cast<std::size_t>(found.verdict)];
    if (found.verdict == TrackingVerdict::tracked) {
      row_.accepted_near_m.push_back(errorAt_m(found.pose, near_m_));
    } else {
      ++row_.refused;
    }
    rt::TrackingLimits all = limits_;
    all.min_condition = kPlainCondition;
    const Tracking fit = tracker_.step(model_, frame_->image(), request_, all);
    row_.near_m.push_back(errorAt_m(fit.pose, near_m_));
    row_.far_m.push_back(errorAt_m(fit.pose, far_m_));
    row_.rotation_rad.push_back(angleBetween_rad(fit.pose, truth_));
    row_.expected_m.push_back(fit.noise_error_m);
    row_.points.push_back(static_cast<double>(fit.used));
    if (fit.largest_eigenvalue > 0)
      row_.condition.push_back(fit.smallest_eigenvalue / fit.largest_eigenvalue);
    if (with_floor) findFloor();
  }
  /// With the noise that the points have at the true pose, which may be less than what the camera states.
  void findFloor() {
    double square = 0;
    int count = 0;
    const Vec3 eye_m = truth_.placeIn({});
    for (const rt::TrackingPoint& point : tracker_.points()) {
      const Vec3 place_m = truth_.placeIn(point.place_m);
      const rt::GridDistance at = distanceAt(solid_.grid(), place_m);
      const double cosine = dot(at.gradient, eye_m - place_m) / norm(at.gradient) / norm(eye_m - place_m);
      const double relative = at.distance_m / (cosine * point.depth_sigma_m);
      constexpr double kFacing = 0.5;
      constexpr double kOutlier = 5;
      if (cosine < kFacing || std::abs(relative) > kOutlier) continue;
      square += relative * relative;
      ++count;
    }
    const double scale = count > 0 ? std::sqrt(square / count) : 1;
    row_.floor_near_m =
        trackingFloor_m(solid_.grid(), truth_, tracker_.points(), model_.parameters(), scale, near_m_);
  }
  void judge(bool is_there) {
    const Tracking found = tracker_.step(model_, frame_->image(), request_, limits_);
    const bool accepted = found.verdict == TrackingVerdict::tracked;
    const bool right = is_there && errorAt_m(found.pose, near_m_) <= settings_.limit_m;
    ++row_.hard_cases;
    if (accepted && right) ++row_.hard_accepted;
    if (right) return;
    ++row_.failures;
    if (!accepted) ++row_.failures_found;
  }

  Vec3 direction() {
    std::normal_distribution<double> normal;
    const Vec3 v{normal(random_), normal(random_), normal(random_)};
    return (1 / norm(v)) * v;
  }
  double uniform() { return std::uniform_real_distribution(-1.0, 1.0)(random_); }

  TrackingSettings settings_;
  const RecordedNoise* recorded_;
  SolidGrid solid_;
  rt::DepthModel model_;
  drivers::SceneCamera camera_;
  SceneSensor sensor_;
  std::mt19937 random_;
  rt::SolidTracker tracker_;
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
  std::uint64_t frames_ = 0;
  rt::TrackingLimits limits_{};
  rt::TrackingRequest request_{};
  SolidPose truth_{};
  Vec3 near_m_{};
  Vec3 far_m_{};
  TrackingRow row_{};
};

/// Tracks the solid of a case from nearby starts (5 mm and 4 degrees), from bad ones (30 mm and 25 degrees,
/// and up to four times as much), behind other bodies, and where other bodies or none are in its place.
/// `recorded`: not null for TrackingNoise::recorded.
TrackingRow measureTracking(const TrackingCase& chosen, const TrackingSettings& settings,
                            const RecordedNoise* recorded) {
  return TrackingRun(chosen, settings, recorded).measure();
}

struct TrackingOptions {
  std::vector<SolidKind> solids{SolidKind::organ, SolidKind::ellipsoid, SolidKind::round_ellipsoid,
                                SolidKind::corner, SolidKind::sphere};
  std::vector<TrackingNoise> noises = everyOne<TrackingNoise>();
  std::vector<double> distances_m{0.6, 1.0};
  TrackingSettings settings;
  std::string recordings;
};

constexpr const char* kTrackingExplanation =
    "Solids of about 100 mm, at rest before a wall. near, far: error of the place of the surface that faces\n"
    "the camera, and of one 30 mm behind the middle, of fits that estimate every direction; expected: "
    "standard\n"
    "deviation of near that the tracker states; floor: the smallest that the noise allows these points\n"
    "(Cramer-Rao bound; -: undetermined, as are the errors). accepted: with the limits as shipped, where\n"
    "directions below 2 % are not estimated. hard: bad starts, other bodies in front, other bodies or none "
    "in\n"
    "place of the solid; right: of these, results that are accepted and right; failures: of these, results\n"
    "that are not right; found: of the failures, the share that is refused.\n\n";

/// A quantile of a list, if there is one.
Figure figureOf(const std::vector<double>& values, double share) {
  return values.empty() ? Figure(nullptr) : Figure(quantile(values, share));
}

Row trackingCells(const TrackingRow& r) {
  const bool is_seen = std::isfinite(r.floor_near_m);
  Row row{{"/solid", "solid", 0, nameOf(r.chosen.solid)},
          {"/noise", "noise", 0, nameOf(r.chosen.noise)},
          {"/distance_m", "m", 1, r.chosen.distance_m},
          {"/points", "points", 0, figureOf(r.points, 0.5)},
          {"/condition", "min/max", 4, figureOf(r.condition, 0.5)}};
  // Nothing where a motion that does not show makes them meaningless.
  const auto add = [&](const std::string& key, const char* heading, double scale,
                       const std::vector<double>& values) {
    for (const auto& [member, shown, share] :
         {std::tuple("/median", heading, 0.5), std::tuple("/p95", "p95", 0.95),
          std::tuple("/max", "max", 1.0)})
      row.push_back({key + member, shown, 2, is_seen ? figureOf(values, share) : Figure(nullptr), scale});
  };
  add("/rotation_rad", "rot. deg", 180 / std::numbers::pi, r.rotation_rad);
  add("/near_m", "near mm", 1e3, r.near_m);
  add("/far_m", "far mm", 1e3, r.far_m);
  row = joined(std::move(row),
               {{"/expected_m", "expected", 2, figureOf(r.expected_m, 0.5), 1e3},
                {"/floor_m", "floor", 2, is_seen ? Figure(r.floor_near_m) : Figure(nullptr), 1e3},
                {"/accepted_percent", "accepted %", 0, percentOf(r.starts - r.refused, r.starts)},
                {"/accepted_near_m/p95", "p95 mm", 2, figureOf(r.accepted_near_m, 0.95), 1e3},
                {"/accepted_near_m/max", "max mm", 2, figureOf(r.accepted_near_m, 1), 1e3},
                {"/hard_cases", "hard", 0, r.hard_cases},
                {"/hard_right_percent", "right %", 0, percentOf(r.hard_accepted, r.hard_cases)},
                {"/failures", "failures", 0, r.failures},
                {"/found_percent", "found %", 1, r.foundPercent()},
                {"/cpu_s/median", "CPU ms", 2, figureOf(r.cpu_s, 0.5), 1e3},
                {"/cpu_s/p95", "p95", 2, figureOf(r.cpu_s, 0.95), 1e3}});
  for (std::size_t i = 0; i < r.verdicts.size(); ++i)
    row.push_back({fmt::format("/verdicts/{}", rt::kWords<TrackingVerdict>[i]), "", 0, r.verdicts[i]});
  return row;
}

/// Largest error of what is accepted: 1 mm at 0.6 m and 2.5 mm at 1 m, growing with the square of the
/// distance as the noise does; where the noise does not allow that, three times its floor.
double bound_m(const TrackingRow& row) {
  const double z = row.chosen.distance_m;
  constexpr double kSigmas = 3;
  constexpr double kErrorAt1m_m = 0.0025;
  return std::max(kErrorAt1m_m * z * z, std::isfinite(row.floor_near_m) ? kSigmas * row.floor_near_m : 0);
}

std::vector<Limit> trackingLimits(const TrackingRow& r) {
  return {{"failures that are accepted", r.failures > 0, static_cast<double>(r.wronglyAccepted()), 0},
          {"error of what is accepted, 95 %, m", !r.accepted_near_m.empty(),
           quantile(r.accepted_near_m, 0.95), bound_m(r)}};
}

/// The noise of the recording in the folder whose pixels rest; nothing where there is none.
base::Result<std::optional<RecordedNoise>> recordedNoise(const std::string& folder, std::string& name) {
  constexpr std::size_t kFrames = 24;
  const auto sequences = recordedSequences(folder, kFrames);
  if (!sequences) return std::unexpected(sequences.error());
  std::optional<RecordedNoise> found;
  for (const BenchSequence& sequence : *sequences) {
    if (auto noise = RecordedNoise::of(sequence)) {
      found = std::move(noise);
      name = sequence.name;
    }
  }
  return found;
}

int runTracking(const TrackingOptions& chosen, const StudyCommand& command) {
  Report report;
  report.say(kTrackingExplanation);
  std::optional<RecordedNoise> recorded;
  if (std::ranges::find(chosen.noises, TrackingNoise::recorded) != chosen.noises.end()) {
    std::string name;
    auto noise = recordedNoise(chosen.recordings, name);
    if (!noise) return fail(noise.error(), EX_NOINPUT);
    recorded = std::move(*noise);
    report.note("/recording", name);
    report.say(recorded
                   ? fmt::format("recorded: what changes from frame to frame in {}\n\n", name)
                   : fmt::format("recorded: left out, no recording at rest in {}\n\n", chosen.recordings));
  }
  std::vector<TrackingCase> cases = varied(std::vector<TrackingCase>(1), &TrackingCase::noise, chosen.noises);
  cases = varied(cases, &TrackingCase::distance_m, chosen.distances_m);
  cases = varied(cases, &TrackingCase::solid, chosen.solids);
  std::vector<TrackingRow> rows;
  for (const TrackingCase& one : cases) {
    if (one.noise == TrackingNoise::recorded && !recorded) continue;
    showProgress(fmt::format("{}, {}, {} m", nameOf(one.solid), nameOf(one.noise), one.distance_m));
    rows.push_back(measureTracking(one, chosen.settings, recorded ? &*recorded : nullptr));
  }
  report.note("/trials", chosen.settings.trials);
  report.note("/limit_m", chosen.settings.limit_m);
  report.table("rows", fmt::format("{} poses of each solid\n", chosen.settings.trials),
               rowsOf(rows, trackingCells));
  report.requirements(checked(
      {""}, rows, [](const TrackingRow&, const std::string&) { return true; }, trackingLimits,
      [](const TrackingRow& r) {
        return fmt::format("{}, {}, {} m", nameOf(r.chosen.solid), nameOf(r.chosen.noise),
                           r.chosen.distance_m);
      }));
  return command.report(report);
}

}  // namespace

StudyCommand trackingCommand(CLI::App& app) {
  const auto chosen = std::make_shared<TrackingOptions>();
  StudyCommand command(app, "tracking",
                       "how exactly a depth camera finds the pose of a solid, and what it refuses");
  command.quick("an organ and a sphere at 0.6 m, 2 poses, 20 bad starts", [chosen] {
    chosen->solids = {SolidKind::organ, SolidKind::sphere};
    chosen->noises = {TrackingNoise::kinect};
    chosen->distances_m = {0.6};
    chosen->settings.trials = 2;
    chosen->settings.bad_starts = 20;
  });
  command.choices("--solids", chosen->solids, kAllSolids, "all but cylinder and plate");
  command.choices("--noises", chosen->noises, kAllOf<TrackingNoise>, "all");
  command.numbers("--distances", chosen->distances_m, 0.2, 2.0,
                  "metres from the camera to the middle (0.6,1)");
  command.number("--trials", chosen->settings.trials, 1, 10'000, "poses of each solid (20)");
  command.number("--bad-starts", chosen->settings.bad_starts, 0, 1'000'000, "bad starts of each case (200)");
  command.number("--limit", chosen->settings.limit_m, 0.0001, 0.1,
                 "largest error of the target in metres that is accepted (0.003)");
  command.seed(chosen->settings.seed, "of poses, starts and noise (1)");
  command.recordings(chosen->recordings);
  command.onRun([chosen](const StudyCommand& self) { return runTracking(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
