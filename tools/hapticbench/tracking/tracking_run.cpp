// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "rt/base/clock.h"
#include "rt/depth/depth_model.h"
#include "tools/hapticbench/disparity.h"
#include "tools/hapticbench/recordings.h"
#include "tools/hapticbench/tracking/tracking.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/scene_noise.h"

namespace hapticd::tools {
namespace {

using rt::SolidPose;
using rt::Tracking;
using rt::TrackingVerdict;
using rt::Vec3;

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

}  // namespace

std::string_view nameOf(TrackingNoise noise) {
  constexpr std::array<std::string_view, kTrackingNoises.size()> kNames{"kinect", "harsh", "recorded",
                                                                        "d405"};
  return kNames.at(static_cast<std::size_t>(noise));
}

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

double TrackingRow::foundPercent() const {
  return failures == 0 ? 100 : 100.0 * failures_found / failures;
}

TrackingRow measureTracking(const TrackingCase& chosen, const TrackingSettings& settings,
                            const RecordedNoise* recorded) {
  return TrackingRun(chosen, settings, recorded).measure();
}

}  // namespace hapticd::tools
