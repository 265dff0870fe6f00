// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/course.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/lib/truth/rigid_frame.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kTick_s = 0.001;
constexpr double kRounding_m = 1e-9;

/// A displacement across `direction` of at most 4 mm, so that HIPs do not lie on the lattice of pixels.
Vec3 aside(const Vec3& direction, std::mt19937& random) {
  constexpr double kAside_m = 0.004;
  std::uniform_real_distribution<double> share(0, 1);
  const Vec3 first = std::abs(direction.x) < 0.9 ? cross(direction, {1, 0, 0}) : cross(direction, {0, 1, 0});
  const Vec3 across = unitOf(first);
  const double radius = kAside_m * std::sqrt(share(random));
  const double angle = 2 * std::numbers::pi * share(random);
  return radius * (std::cos(angle) * across + std::sin(angle) * cross(direction, across));
}

/// Builds a course tick by tick.
class CourseMaker {
 public:
  CourseMaker(const TrueScene& scene, double stiffness_n_per_m)
      : scene_(scene), stiffness_(stiffness_n_per_m) {
    course_.outward = -scene.approach(0).inward_in_world;
  }

  /// Adds a tick; returns false at the end of the course.
  bool add(const Vec3& hip_m) {
    CourseTick tick{.hip_m = hip_m};
    const auto count = static_cast<double>(course_.ticks.size());
    tick.frame = kSettlingFrames + static_cast<int>(count * kTick_s * kFrameRate_hz + kRounding_m);
    const Vec3 to_surface = scene_.closestVisible(hip_m, 0) - hip_m;
    const bool is_behind = scene_.penetration(hip_m, 0) > 0;
    tick.depth_m = is_behind ? norm(to_surface) : -norm(to_surface);
    if (is_behind) tick.ideal_force_n = stiffness_ * to_surface;
    const double ideal_n = dot(tick.ideal_force_n, course_.outward);
    const bool lets_go = most_ideal_n_ > 0.5 && ideal_n < 0.98 * most_ideal_n_;
    if (tick.depth_m > kDeepest_m || lets_go) return false;
    most_ideal_n_ = std::max(most_ideal_n_, ideal_n);
    course_.ticks.push_back(tick);
    return true;
  }

  /// Marks the ticks at which forces are compared: every millimetre of depth between 5 and 20 mm.
  Course finish() {
    constexpr double kFirst_m = 0.005;
    constexpr double kLast_m = 0.02;
    constexpr double kStep_m = 0.001;
    double last_m = -1;
    for (CourseTick& tick : course_.ticks) {
      const double depth_m = std::abs(tick.depth_m);
      const bool in_range = depth_m >= kFirst_m - kRounding_m && depth_m <= kLast_m + kRounding_m;
      if (!in_range || std::abs(tick.depth_m - last_m) < kStep_m - kRounding_m) continue;
      tick.is_sample = tick.depth_m > 0;
      last_m = tick.depth_m;
    }
    return std::move(course_);
  }

 private:
  const TrueScene& scene_;
  double stiffness_;
  Course course_;
  double most_ideal_n_ = 0;
};

}  // namespace

std::vector<Course> pushes(const TrueScene& scene, double stiffness_n_per_m, int count, std::uint32_t seed) {
  constexpr double kStart_m = 0.03;  // in front of the surface
  constexpr double kSpeed_m_per_s = 0.1;
  constexpr double kStep_m = kSpeed_m_per_s * kTick_s;
  constexpr int kTicks = static_cast<int>((kStart_m + 2 * kDeepest_m) / kStep_m);
  std::mt19937 random(seed);
  const TrueScene::Approach approach = scene.approach(0);
  std::vector<Course> courses;
  for (int i = 0; i < count; ++i) {
    CourseMaker maker(scene, stiffness_n_per_m);
    const Vec3 foot = approach.surface_m_in_world + aside(approach.inward_in_world, random);
    for (int tick = 0; tick < kTicks; ++tick) {
      if (!maker.add(foot + (tick * kStep_m - kStart_m) * approach.inward_in_world)) break;
    }
    courses.push_back(maker.finish());
  }
  return courses;
}

}  // namespace hapticd::tools
