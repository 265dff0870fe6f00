// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "rt/base/clock.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/sweep.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kDistance_m = 1;
constexpr double kFineRange_m = 0.05;  // to either side; one raw unit is then 0.05 mm
constexpr double kY_m = -0.00052;      // off the lattice of pixels
constexpr double kStrokeDepth_m = 0.005;
constexpr double kMinRidge_m = 0.0001;
constexpr double kMaxRidge_m = 0.04;
constexpr double kRidgeWidth_m = 0.02;
constexpr double kFarAside_m = 0.08;  // neither edge nor ridge has an effect there, whatever the radius

bool isSpringLaw(rt::ForceLaw law) {
  return rt::rowOf(law).looks_in_radius;
}

rt::DepthModelParameters depthModel() {
  return fineDepthModelAround(kDistance_m, kFineRange_m);
}

/// A law in front of a scene, led to a position from free space.
class Hand {
 public:
  Hand(const rt::LiveParameters& parameters, const rt::DepthFrame& frame) : box_(depthModel(), {}, {}) {
    box_.parameters() = parameters;
    box_.show(frame);
  }

  Vec3 force_n(double x_m, double h_m) {
    return box_.lawForce({x_m, kY_m, h_m - kDistance_m}).force_n_in_world;
  }

  /// Moves inwards at x, starting without force.
  void approach(double x_m, double h_m) {
    constexpr double kStep_m = 0.0005;
    const double free_m = box_.parameters().force.radius_m + 0.01;
    for (double h = free_m; h > h_m; h -= kStep_m) force_n(x_m, h);
    force_n(x_m, h_m);
  }

 private:
  OfflineBox box_;
};

/// Force against distance on a push inwards, at even steps.
struct PushCurve {
  std::vector<double> h_m;
  std::vector<double> force_n;

  std::size_t nearest(double h) const {
    const auto closer = [h](double a, double b) { return std::abs(a - h) < std::abs(b - h); };
    return static_cast<std::size_t>(std::min_element(h_m.begin(), h_m.end(), closer) - h_m.begin());
  }
  double slope_n_per_m(std::size_t outer, std::size_t inner) const {
    return (force_n[inner] - force_n[outer]) / (h_m[outer] - h_m[inner]);
  }
  double steepest_n_per_m(std::size_t outer, std::size_t inner, std::size_t span) const {
    double steepest = 0;
    for (std::size_t i = outer; i + span <= inner; ++i)
      steepest = std::max(steepest, slope_n_per_m(i, i + span));
    return steepest;
  }
  std::size_t onset() const {
    constexpr double kFelt_n = 0.02;
    const auto first =
        std::find_if(force_n.begin(), force_n.end(), [](double force) { return force > kFelt_n; });
    return static_cast<std::size_t>(first - force_n.begin());
  }
  std::size_t peak() const {
    return static_cast<std::size_t>(std::max_element(force_n.begin(), force_n.end()) - force_n.begin());
  }
};

constexpr double kPushStep_m = 0.00025;
constexpr std::size_t kStepsPerMillimetre = 4;

/// Pushes inwards until `last_m`, or until the force is lost.
PushCurve pushInwards(Hand& hand, double first_m, double last_m) {
  PushCurve curve;
  double largest_n = 0;
  for (double h = first_m; h >= last_m; h -= kPushStep_m) {
    const double force_n = hand.force_n(0.00037, h).z;
    curve.h_m.push_back(h);
    curve.force_n.push_back(force_n);
    largest_n = std::max(largest_n, force_n);
    if (largest_n > 0.1 && force_n < largest_n / 2) break;
  }
  return curve;
}

}  // namespace

FeelProbe::FeelProbe(double ridge_step, bool timed) : ridge_step_(ridge_step), timed_(timed) {}

Feel FeelProbe::measure(const rt::LiveParameters& parameters) {
  Feel feel;
  push(parameters, feel);
  strokeOverEdge(parameters, feel);
  strokeOverRidges(parameters, feel);
  if (timed_) time(parameters, feel);
  return feel;
}

void FeelProbe::push(const rt::LiveParameters& parameters, Feel& feel) {
  Hand hand(parameters, plane());
  const double first_m = parameters.force.radius_m + 0.005;
  const double last_m = -1.05 * kNoPopThrough_n / parameters.force.stiffness_n_per_m;
  const PushCurve curve = pushInwards(hand, first_m, last_m);
  const bool springs = isSpringLaw(parameters.law);
  const std::size_t outer = springs ? curve.onset() : curve.nearest(-kStrokeDepth_m);
  const std::size_t inner = springs ? curve.peak() : curve.nearest(-0.015);
  feel.pop_through_n = std::min(kNoPopThrough_n, curve.force_n[curve.peak()]);
  feel.stroke_h_m = -kStrokeDepth_m;
  if (outer >= inner) return;  // no force
  feel.rendered_stiffness_n_per_m = curve.slope_n_per_m(outer, inner);
  feel.steepest_stiffness_n_per_m = curve.steepest_n_per_m(outer, inner, kStepsPerMillimetre);
  if (springs) feel.stroke_h_m = (curve.h_m[outer] + curve.h_m[inner]) / 2;
}

void FeelProbe::strokeOverEdge(const rt::LiveParameters& parameters, Feel& feel) {
  constexpr double kStep_m = 0.0005;
  Hand hand(parameters, halfPlane());
  hand.approach(-kFarAside_m, feel.stroke_h_m);
  const double half_n = hand.force_n(-kFarAside_m, feel.stroke_h_m).z / 2;
  double before_n = 2 * half_n;
  feel.edge_m = -kFarAside_m;
  for (double x = -kFarAside_m + kStep_m; x < kFarAside_m; x += kStep_m) {
    const double force_n = hand.force_n(x, feel.stroke_h_m).z;
    if (force_n <= half_n && before_n > half_n) {
      const double place_m = x - kStep_m * (half_n - force_n) / (before_n - force_n);
      feel.edge_m = place_m;
      return;
    }
    before_n = force_n;
  }
}

void FeelProbe::strokeOverRidges(const rt::LiveParameters& parameters, Feel& feel) {
  for (double height_m = kMinRidge_m; height_m < kMaxRidge_m; height_m *= ridge_step_) {
    if (!isNoticeable(parameters, height_m, feel.stroke_h_m)) continue;
    feel.smallest_ridge_m = height_m;
    return;
  }
}

/// A stroke across the ridge, at a constant height over the plane that it stands on.
bool FeelProbe::isNoticeable(const rt::LiveParameters& parameters, double height_m, double stroke_h_m) {
  constexpr double kStep_m = 0.001;
  Hand hand(parameters, ridge(height_m));
  hand.approach(-kFarAside_m, stroke_h_m);
  const Vec3 flat_n = hand.force_n(-kFarAside_m, stroke_h_m);
  const double noticed_n = justNoticeableDifference_n(norm(flat_n));
  for (double x = -kFarAside_m + kStep_m; x <= kRidgeWidth_m; x += kStep_m) {
    if (norm(hand.force_n(x, stroke_h_m) - flat_n) > noticed_n) return true;
  }
  return false;
}

void FeelProbe::time(const rt::LiveParameters& parameters, Feel& feel) {
  constexpr int kPositions = 200;
  Hand hand(parameters, plane());
  hand.approach(0, feel.stroke_h_m);
  std::vector<double> durations_ns;
  for (int i = 0; i < kPositions; ++i) {
    const double x_m = 0.01 * std::sin(0.1 * i);
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    hand.force_n(x_m, feel.stroke_h_m);
    durations_ns.push_back(static_cast<double>(rt::monotonicNow_ns() - begin_ns));
  }
  feel.median_force_us = quantile(durations_ns, 0.5) / 1000;
}

const rt::DepthFrame& FeelProbe::plane() {
  return ridge(0);
}

const rt::DepthFrame& FeelProbe::halfPlane() {
  auto& frame = frames_[{SceneKind::half_plane, 0}];
  if (frame == nullptr) {
    frame = std::make_unique<rt::DepthFrame>();
    TrueScene({.kind = SceneKind::half_plane, .distance_m = kDistance_m}, depthModel())
        .render(0, 1, SceneNoise::none, *frame);
  }
  return *frame;
}

/// Returns a frame of a ridge on a plane at kDistance_m; without ridge if the height is 0.
const rt::DepthFrame& FeelProbe::ridge(double height_m) {
  const SceneKind kind = height_m > 0 ? SceneKind::thin_plate : SceneKind::plane;
  auto& frame = frames_[{kind, height_m}];
  if (frame == nullptr) {
    frame = std::make_unique<rt::DepthFrame>();
    TrueScene({.kind = kind,
               .distance_m = kDistance_m - height_m,
               .plate_width_m = kRidgeWidth_m,
               .plate_thickness_m = height_m,
               .wall_behind_m = height_m},
              depthModel())
        .render(0, 1, SceneNoise::none, *frame);
  }
  return *frame;
}

}  // namespace hapticd::tools
