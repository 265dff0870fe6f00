// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/course.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kStart_m = 0.03;       // in front of the surface
constexpr double kWait_m = 0.02;        // in front of the surface
constexpr double kPress_m = 0.01;       // behind the surface
constexpr double kSpeed_m_per_s = 0.1;  // of the hand
constexpr double kAside_m = 0.004;
constexpr double kTick_s = 0.001;
constexpr double kSlowScene_m_per_s = 0.05;
constexpr double kSlowTick_s = 0.004;  // slower scenes are looked at less often
constexpr double kFirstSample_m = 0.005;
constexpr double kLastSample_m = 0.02;
constexpr double kSampleStep_m = 0.001;
constexpr double kRounding_m = 1e-9;

/// A place in the disc of kAside_m across `direction`, so that HIPs do not lie on the lattice of pixels.
Vec3 aside(const Vec3& direction, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  const Vec3 first = std::abs(direction.x) < 0.9 ? cross(direction, {1, 0, 0}) : cross(direction, {0, 1, 0});
  const Vec3 across = (1 / norm(first)) * first;
  const double radius = kAside_m * std::sqrt(share(random));
  const double angle = 2 * std::numbers::pi * share(random);
  return radius * (std::cos(angle) * across + std::sin(angle) * cross(direction, across));
}

/// Builds a course tick by tick.
class CourseMaker {
 public:
  CourseMaker(const TrueScene& scene, double stiffness_n_per_m, double tick_s)
      : scene_(scene), stiffness_(stiffness_n_per_m), tick_s_(tick_s) {
    course_.outward = -scene.approach(0).inward_in_world;
    course_.first_moving_frame = 1 << 30;
  }

  /// The scene moves from the next frame on.
  void startScene() { course_.first_moving_frame = frame(); }

  /// One tick more; false where the course is at its end.
  bool add(const Vec3& hip_m) {
    CourseTick tick;
    tick.hip_m = hip_m;
    tick.frame = frame();
    const double t_s = FrameReel::time_s(tick.frame, course_.first_moving_frame);
    const Vec3 to_surface = scene_.closestVisible(hip_m, t_s) - hip_m;
    const bool is_behind = scene_.penetration(hip_m, t_s) > 0;
    tick.depth_m = is_behind ? norm(to_surface) : -norm(to_surface);
    if (is_behind) tick.ideal_force_n = stiffness_ * to_surface;
    const double ideal_n = dot(tick.ideal_force_n, course_.outward);
    const bool lets_go = most_ideal_n_ > 0.5 && ideal_n < 0.98 * most_ideal_n_;
    if (tick.depth_m > kDeepest_m || lets_go) return false;
    most_ideal_n_ = std::max(most_ideal_n_, ideal_n);
    if (!course_.ticks.empty()) course_.ticks.back().ends_frame = course_.ticks.back().frame != tick.frame;
    course_.ticks.push_back(tick);
    ++count_;
    return true;
  }

  /// Marks the ticks at which forces are compared: every millimetre of depth between 5 and 20 mm. While the
  /// scene moves only the last tick of a frame counts, when a law has had the time to follow.
  Course finish() {
    course_.ticks.back().ends_frame = true;
    double last_m = -1;
    for (CourseTick& tick : course_.ticks) {
      const bool moving = tick.frame > course_.first_moving_frame;
      const double depth_m = std::abs(tick.depth_m);
      const bool in_range = depth_m >= kFirstSample_m - kRounding_m && depth_m <= kLastSample_m + kRounding_m;
      const bool is_new = std::abs(tick.depth_m - last_m) >= kSampleStep_m - kRounding_m;
      if (!in_range || !is_new || (moving && !tick.ends_frame)) continue;
      tick.sample = tick.depth_m > 0 ? SamplePlace::behind : SamplePlace::in_front;
      last_m = tick.depth_m;
    }
    return std::move(course_);
  }

  double tick_s() const { return tick_s_; }

 private:
  int frame() const {
    return kSettlingFrames + static_cast<int>(count_ * tick_s_ * kFrameRate_hz + kRounding_m);
  }

  const TrueScene& scene_;
  double stiffness_;
  double tick_s_;
  Course course_;
  int count_ = 0;
  double most_ideal_n_ = 0;
};

double tickOf(const TrueScene& scene) {
  return scene.parameters().speed_m_per_s < kSlowScene_m_per_s ? kSlowTick_s : kTick_s;
}

/// The HIP stays while the scene advances.
Course letSceneCome(CourseMaker maker, const TrueScene& scene, const Vec3& hip_m) {
  maker.startScene();
  const auto ticks = std::lround(kAdvance_m / scene.parameters().speed_m_per_s / maker.tick_s());
  for (long tick = 0; tick < ticks; ++tick) {
    if (!maker.add(hip_m)) break;
  }
  return maker.finish();
}

}  // namespace

std::vector<Course> pushes(const TrueScene& scene, double stiffness_n_per_m, int count, std::uint32_t seed) {
  std::mt19937 random(seed);
  const TrueScene::Approach approach = scene.approach(0);
  std::vector<Course> courses;
  for (int i = 0; i < count; ++i) {
    CourseMaker maker(scene, stiffness_n_per_m, kTick_s);
    const Vec3 foot = approach.surface_m_in_world + aside(approach.inward_in_world, random);
    constexpr double kStep_m = kSpeed_m_per_s * kTick_s;
    constexpr int kTicks = static_cast<int>((kStart_m + 2 * kDeepest_m) / kStep_m);
    for (int tick = 0; tick < kTicks; ++tick) {
      if (!maker.add(foot + (tick * kStep_m - kStart_m) * approach.inward_in_world)) break;
    }
    courses.push_back(maker.finish());
  }
  return courses;
}

Course waitForPlane(const TrueScene& scene, double stiffness_n_per_m, std::uint32_t seed) {
  std::mt19937 random(seed);
  const TrueScene::Approach approach = scene.approach(0);
  const Vec3 foot = approach.surface_m_in_world + aside(approach.inward_in_world, random);
  const Vec3 hip = foot - kWait_m * approach.inward_in_world;
  CourseMaker maker(scene, stiffness_n_per_m, tickOf(scene));
  maker.add(hip);
  return letSceneCome(std::move(maker), scene, hip);
}

Course pressThenPlane(const TrueScene& scene, double stiffness_n_per_m, std::uint32_t seed) {
  std::mt19937 random(seed);
  const TrueScene::Approach approach = scene.approach(0);
  const Vec3 foot = approach.surface_m_in_world + aside(approach.inward_in_world, random);
  CourseMaker maker(scene, stiffness_n_per_m, tickOf(scene));
  const double step_m = kSpeed_m_per_s * maker.tick_s();
  const auto ticks = std::lround((kStart_m + kPress_m) / step_m);
  for (long tick = 0; tick < ticks; ++tick) {
    maker.add(foot + (static_cast<double>(tick) * step_m - kStart_m) * approach.inward_in_world);
  }
  return letSceneCome(std::move(maker), scene, foot + kPress_m * approach.inward_in_world);
}

}  // namespace hapticd::tools
