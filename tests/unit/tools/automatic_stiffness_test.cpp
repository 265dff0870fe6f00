// SPDX-License-Identifier: Apache-2.0
// The automatic stiffness against closed forms, on scenes whose noise and limits are known.
#include "rt/laws/automatic_stiffness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "rt/safety/stiffness_limit.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {
namespace {

constexpr double kFrame_s = 1.0 / 30;
constexpr double kLoop_s = 0.001;
constexpr double kAbove_m = 0.01;
constexpr double kWithin = 0.1;

/// A box with the automatic stiffness in front of a plane. No rule but the ceiling of 1000 N/m binds until a
/// test makes one do so.
class Automatic {
 public:
  explicit Automatic(const TrueSceneParameters& scene, SceneNoise noise = SceneNoise::none,
                     const rt::DepthModelParameters& camera = fineDepthModelAround(1, 0.3))
      : scene_(scene, camera), noise_(noise), box_(camera, {}, {}), probe_(camera, {}, {}) {
    for (OfflineBox* box : {&box_, &probe_}) {
      box->parameters().law = rt::ForceLaw::surface;
      box->setLoopPeriod(kLoop_s);
    }
    rt::LiveParameters& parameters = box_.parameters();
    parameters.force.stiffness_is_automatic = true;
    parameters.force.stiffness_n_per_m = 1000;
    parameters.safety.continuous_force_n = 1000;
  }

  rt::LiveParameters& parameters() { return box_.parameters(); }
  rt::StartParameters& start() { return box_.start(); }
  const rt::StiffnessRules& rules() { return box_.core().stiffnessRules(); }

  /// The HIP on the optical axis, `above_m` in front of the plane.
  rt::Vec3 hip(double above_m = kAbove_m) const {
    const TrueSceneParameters& scene = scene_.parameters();
    return {0, 0, -(scene.distance_m - scene.speed_m_per_s * time_s_ - above_m)};
  }

  /// Shows the next frame, and ticks once.
  rt::Tick nextFrame(double above_m = kAbove_m) {
    ++frames_;
    time_s_ = static_cast<double>(frames_) * kFrame_s;
    scene_.render(time_s_, frames_, noise_, *frame_);
    box_.show(*frame_);
    return box_.tick(hip(above_m), kFrame_s);
  }
  rt::Tick frames(int count) {
    rt::Tick tick;
    for (int i = 0; i < count; ++i) tick = nextFrame();
    return tick;
  }
  /// Ticks without new frames until the stiffness is what the rules allow.
  rt::Tick settle() {
    rt::Tick tick;
    for (int i = 0; i < 2'000; ++i) tick = box_.tick(hip(), kFrame_s);
    return tick;
  }
  rt::Tick tick(double above_m, double period_s = kLoop_s) { return box_.tick(hip(above_m), period_s); }

  /// How deep a HIP at a fixed place inside the plane is, as the law sees it in the newest frame. The probe's
  /// HIP is where the box's is while the frame is modelled, so that both have the same surface.
  double lawDepth() {
    probe_.show(*frame_);
    probe_.lawForce(hip());
    const double depth_m = probe_.lawForce(hip(-kAbove_m)).depth_m;
    probe_.lawForce(hip());
    return depth_m;
  }

 private:
  TrueScene scene_;
  SceneNoise noise_;
  OfflineBox box_;
  OfflineBox probe_;
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
  std::uint64_t frames_ = 0;
  double time_s_ = 0;
};

/// Standard deviation over a second of frames, mean over all such spans.
double spreadOver1s(const std::vector<double>& values) {
  constexpr std::size_t kSpan = 30;
  double sum = 0;
  std::size_t spans = 0;
  for (std::size_t begin = 0; begin + kSpan <= values.size(); ++begin, ++spans) {
    double mean = 0;
    for (std::size_t i = 0; i < kSpan; ++i) mean += values[begin + i] / kSpan;
    for (std::size_t i = 0; i < kSpan; ++i) sum += std::pow(values[begin + i] - mean, 2) / (kSpan - 1);
  }
  return std::sqrt(sum / static_cast<double>(spans));
}

void expectSettled(const rt::Tick& tick, double stiffness_n_per_m, rt::StiffnessBound bound) {
  EXPECT_NEAR(tick.stiffness_n_per_m, stiffness_n_per_m, kWithin * stiffness_n_per_m);
  EXPECT_EQ(tick.stiffness_bound, bound);
}

TEST(AutomaticStiffness, ReachesTheCeiling) {
  Automatic automatic({});
  automatic.parameters().force.stiffness_ceiling_n_per_m = 600;
  automatic.frames(60);
  expectSettled(automatic.settle(), 600, rt::StiffnessBound::ceiling);
}

TEST(AutomaticStiffness, StaysWithinWhatIsStable) {
  Automatic automatic({});
  constexpr double kMass_kg = 0.0005;
  automatic.start().device_mass_kg = kMass_kg;
  automatic.start().handle.motion_scale = 2;
  automatic.frames(60);
  const double lag_s = kLoop_s / 2;
  expectSettled(automatic.settle(), rt::stiffnessOfMass_n_per_m(kMass_kg, lag_s) / 2,
                rt::StiffnessBound::stability);
}

TEST(AutomaticStiffness, StaysWithinTheContinuousForceOfTheDevice) {
  Automatic automatic({});
  automatic.parameters().safety.continuous_force_n = 3;
  automatic.frames(60);
  expectSettled(automatic.settle(), 300, rt::StiffnessBound::device);
}

TEST(AutomaticStiffness, StaysWithinTheSlewLimitOfAMovingSurface) {
  constexpr double kSpeed_m_per_s = 0.1;
  Automatic automatic({.distance_m = 1, .speed_m_per_s = kSpeed_m_per_s});
  automatic.parameters().safety.max_slew_n_per_s = 15;
  expectSettled(automatic.frames(45), 15 / kSpeed_m_per_s, rt::StiffnessBound::slew);
}

struct NoiseScene {
  SceneNoise noise;
  double distance_m;
};

class AutomaticStiffnessInNoise : public testing::TestWithParam<NoiseScene> {};

TEST_P(AutomaticStiffnessInNoise, KeepsTheNoiseOfATypicalForceUnnoticed) {
  const auto [noise, distance_m] = GetParam();
  Automatic automatic({.distance_m = distance_m}, noise, {});
  constexpr double kCeiling_n_per_m = 5000;
  automatic.parameters().force.stiffness_ceiling_n_per_m = kCeiling_n_per_m;
  constexpr int kStart = 30;
  constexpr int kMeasured = 150;
  std::vector<double> depths_m;
  for (int i = 0; i < kStart + kMeasured; ++i) {
    automatic.nextFrame();
    const double depth_m = automatic.lawDepth();
    if (i >= kStart) depths_m.push_back(depth_m);
  }
  const double sigma_m = spreadOver1s(depths_m);
  const double allowed = 0.07 / sigma_m;
  RecordProperty("sigma_um", static_cast<int>(1e6 * sigma_m));
  if (allowed < kCeiling_n_per_m) {
    expectSettled(automatic.settle(), allowed, rt::StiffnessBound::noise);
  } else {
    expectSettled(automatic.settle(), kCeiling_n_per_m, rt::StiffnessBound::ceiling);
  }
}

INSTANTIATE_TEST_SUITE_P(Noises, AutomaticStiffnessInNoise,
                         testing::Values(NoiseScene{SceneNoise::quantised, 0.6},
                                         NoiseScene{SceneNoise::quantised, 2},
                                         NoiseScene{SceneNoise::sensor, 0.6},
                                         NoiseScene{SceneNoise::sensor, 1}, NoiseScene{SceneNoise::sensor, 2},
                                         NoiseScene{SceneNoise::harsh, 0.6}, NoiseScene{SceneNoise::harsh, 1},
                                         NoiseScene{SceneNoise::harsh, 2}));

TEST(AutomaticStiffness, StaysModestWhileTheNoiseIsNotKnown) {
  Automatic automatic({});
  rt::Tick tick = automatic.nextFrame();
  EXPECT_EQ(tick.stiffness_n_per_m, rt::kModestStiffness_n_per_m);
  tick = automatic.settle();
  EXPECT_EQ(tick.stiffness_n_per_m, rt::kModestStiffness_n_per_m);
  EXPECT_EQ(tick.stiffness_bound, rt::StiffnessBound::noise);
  EXPECT_EQ(automatic.rules().surface.frames, 0U);

  automatic.parameters().force.stiffness_ceiling_n_per_m = 50;
  expectSettled(automatic.settle(), 50, rt::StiffnessBound::ceiling);
}

TEST(AutomaticStiffness, NeverRisesInContactAndFallsThere) {
  Automatic automatic({});
  automatic.frames(60);
  const rt::Tick before = automatic.tick(kAbove_m);
  ASSERT_LT(before.stiffness_n_per_m, 300);
  rt::Tick tick = automatic.tick(-0.003);
  ASSERT_EQ(tick.contact, rt::ContactState::contact);
  const double first = tick.stiffness_n_per_m;
  for (int i = 0; i < 1'000; ++i) tick = automatic.tick(-0.003);
  EXPECT_EQ(tick.stiffness_n_per_m, first);
  EXPECT_EQ(tick.stiffness_bound, rt::StiffnessBound::ceiling);

  automatic.parameters().force.stiffness_ceiling_n_per_m = 100;
  double last_n = norm(tick.command_force_n_in_world);
  for (int i = 0; i < 1'000; ++i) {
    const double last = tick.stiffness_n_per_m;
    tick = automatic.tick(-0.003);
    ASSERT_LE(tick.stiffness_n_per_m, last);
    ASSERT_GE(tick.stiffness_n_per_m, last * (1 - 0.5001 * kLoop_s));
    const double force_n = norm(tick.command_force_n_in_world);
    ASSERT_NEAR(force_n, last_n, 0.001) << "a change so slow is no step";
    last_n = force_n;
  }
  EXPECT_FALSE(tick.blending);
  EXPECT_LT(tick.stiffness_n_per_m, 0.65 * first);
}

TEST(AutomaticStiffness, RisesByATenthAndFallsByHalfASecond) {
  rt::AutomaticStiffness stiffness;
  rt::LiveParameters parameters;
  parameters.force.stiffness_is_automatic = true;
  EXPECT_EQ(stiffness.begin(parameters), rt::kModestStiffness_n_per_m);
  rt::StiffnessRules rules;
  rules.ceiling_n_per_m = 1000;
  rules.surface.frames = 60;
  const auto second = [&](bool in_contact) {
    for (int i = 0; i < 1'000; ++i) {
      stiffness.begin(parameters);
      stiffness.follow(rules, in_contact, kLoop_s);
    }
    return stiffness.stiffness_n_per_m();
  };
  EXPECT_EQ(second(true), rt::kModestStiffness_n_per_m);
  const double risen = second(false);
  EXPECT_NEAR(risen, rt::kModestStiffness_n_per_m * std::exp(0.1), 0.01);
  rules.noise_n_per_m = 1;
  EXPECT_NEAR(second(true), risen * std::exp(-0.5), 0.05);
  EXPECT_EQ(stiffness.bound(), rt::StiffnessBound::noise);
}

TEST(AutomaticStiffness, StartsNoStifferThanTheNumberBefore) {
  rt::AutomaticStiffness stiffness;
  rt::LiveParameters parameters;
  parameters.force.stiffness_n_per_m = 120;
  EXPECT_EQ(stiffness.begin(parameters), 120);
  EXPECT_EQ(stiffness.bound(), rt::StiffnessBound::configured);
  parameters.force.stiffness_is_automatic = true;
  EXPECT_EQ(stiffness.begin(parameters), 120);
  parameters.force.stiffness_is_automatic = false;
  parameters.force.stiffness_n_per_m = 900;
  EXPECT_EQ(stiffness.begin(parameters), 900);
  parameters.force.stiffness_is_automatic = true;
  EXPECT_EQ(stiffness.begin(parameters), rt::kModestStiffness_n_per_m);
}

TEST(AutomaticStiffness, GivesTheForcesOfTheSameNumber) {
  Automatic automatic({}, SceneNoise::sensor, {});
  Automatic number({}, SceneNoise::sensor, {});
  automatic.parameters().force.stiffness_ceiling_n_per_m = 150;
  number.parameters().force.stiffness_is_automatic = false;
  number.parameters().force.stiffness_n_per_m = 150;
  double largest_n = 0;
  for (int frame = 0; frame < 20; ++frame) {
    const double above_m = 0.004 * std::cos(frame);
    automatic.nextFrame(above_m);
    number.nextFrame(above_m);
    for (int i = 0; i < 33; ++i) {
      const rt::Tick one = automatic.tick(above_m);
      const rt::Tick other = number.tick(above_m);
      ASSERT_EQ(one.command_force_n_in_world, other.command_force_n_in_world);
      ASSERT_EQ(one.energy_j, other.energy_j);
      ASSERT_EQ(other.stiffness_bound, rt::StiffnessBound::configured);
      largest_n = std::max(largest_n, norm(one.command_force_n_in_world));
    }
  }
  EXPECT_GT(largest_n, 0.2);
}

TEST(AutomaticStiffness, ChangesTheForceSlowlyWhereItIsSwitched) {
  Automatic automatic({});
  automatic.parameters().force.stiffness_is_automatic = false;
  automatic.frames(20);
  rt::Tick tick;
  for (int i = 0; i < 200; ++i) tick = automatic.tick(-0.003);
  const double before_n = norm(tick.command_force_n_in_world);
  ASSERT_GT(before_n, 2);
  automatic.parameters().force.stiffness_is_automatic = true;
  double force_n = before_n;
  for (int i = 0; i < 200; ++i) {
    const double stiffness_n_per_m = tick.stiffness_n_per_m;
    tick = automatic.tick(-0.003);
    const double now_n = norm(tick.command_force_n_in_world);
    ASSERT_NEAR(now_n, force_n, 1.01 * stiffness_n_per_m * rt::kMaxGrowth_m_per_s * 1e-3) << i;
    force_n = now_n;
  }
  EXPECT_LT(force_n, before_n - 0.3);
}

}  // namespace
}  // namespace hapticd::tools
