// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/handle_frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace hapticd::drivers {
namespace {

using rt::Vec3;

constexpr double kRounding = 1e-12;
constexpr std::int64_t kPeriodNs = 1'000'000;

/// Returns a frame with settings changed by a test.
HandleFrame frameOf(const config::HandleSettings& settings, double motion_scale = 1) {
  rt::HandleScaleParameters scale;
  scale.motion_scale = motion_scale;
  return HandleFrame(settings, scale);
}

HandleMeasurement at(const Vec3& position_m, std::int64_t tick, std::uint32_t buttons = 0) {
  HandleMeasurement measurement;
  measurement.position_m_in_handle = position_m;
  measurement.time_ns = tick * kPeriodNs;
  measurement.buttons = buttons;
  return measurement;
}

// A quarter turn about z maps the handle's x to the world's y.
TEST(HandleFrame, TransformsPositionsToTheWorld) {
  config::HandleSettings settings;
  settings.setPose({{1, 2, 3}, 0, 0, std::numbers::pi / 2});
  HandleFrame frame = frameOf(settings, 2);
  const rt::HandleState state = frame.stateOf(at({0.1, 0, 0.05}, 1));
  EXPECT_LT(norm(state.position_m_in_world - Vec3{1, 2.2, 3.1}), kRounding);
}

// Roll is first about the world's x, then pitch about y, then yaw about z: each rotates the result of the
// previous ones.
TEST(HandleFrame, AppliesRollPitchAndYawInTheOrderOfTheCamera) {
  config::HandleSettings settings;
  settings.roll_rad = std::numbers::pi / 2;   // y to z
  settings.pitch_rad = std::numbers::pi / 2;  // z to x
  settings.yaw_rad = std::numbers::pi / 2;    // x to y
  HandleFrame frame = frameOf(settings);
  EXPECT_LT(norm(frame.stateOf(at({0, 0.3, 0}, 1)).position_m_in_world - Vec3{0, 0.3, 0}), kRounding);
  EXPECT_LT(norm(frame.stateOf(at({0, 0, 0.3}, 2)).position_m_in_world - Vec3{0.3, 0, 0}), kRounding)
      << "z to -y, which y's turn leaves, to x";
}

TEST(HandleFrame, TransformsForcesBackByTheSameRotation) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> angle(-3, 3);
  for (int i = 0; i < 100; ++i) {
    config::HandleSettings settings;
    settings.roll_rad = angle(random);
    settings.pitch_rad = angle(random);
    settings.yaw_rad = angle(random);
    HandleFrame frame = frameOf(settings, 3);
    const Vec3 motion{angle(random), angle(random), angle(random)};
    const Vec3 force{angle(random), angle(random), angle(random)};
    const Vec3 moved = frame.stateOf(at(motion, 1)).position_m_in_world;
    // the power is the same in both frames except for the scale of the motion
    EXPECT_NEAR(dot(moved, force), 3 * dot(motion, frame.forceInHandle(force)), 100 * kRounding);
  }
}

TEST(HandleFrame, ComputesTheVelocityFromThePositionsWhateverTheDeviceClaims) {
  config::HandleSettings settings;
  settings.setPose({{1, 2, 3}, 0, 0, std::numbers::pi / 2});
  HandleFrame frame = frameOf(settings, 2);
  const Vec3 speed_m_per_s{0.1, 0, 0.05};
  rt::HandleState state;
  for (int tick = 1; tick <= 5; ++tick) {
    HandleMeasurement measurement = at((0.001 * tick) * speed_m_per_s, tick);
    measurement.velocity_m_per_s_in_handle = 0.9 * speed_m_per_s;
    state = frame.stateOf(measurement);
  }
  EXPECT_LT(norm(state.velocity_m_per_s_in_world - Vec3{0, 0.2, 0.1}), 1e-9);
  EXPECT_EQ(state.velocity_claim, rt::VelocityClaim::consistent);
}

TEST(HandleFrame, HasNoForceThatIsNotFinite) {
  const HandleFrame frame = frameOf({});
  EXPECT_EQ(frame.forceInHandle({1, std::numeric_limits<double>::quiet_NaN(), 1}), Vec3{});
}

TEST(HandleFrame, KeepsTheHipWhileTheClutchIsHeldAndContinuesFromThere) {
  config::HandleSettings settings;
  settings.clutch_button = 2;
  HandleFrame frame = frameOf(settings);
  constexpr std::uint32_t kClutch = 1U << 2;
  frame.stateOf(at({0.1, 0, 0}, 1));
  EXPECT_EQ(frame.stateOf(at({0.1, 0, 0}, 2, 1U)).condition, rt::HandleCondition::ready) << "another button";
  for (int tick = 3; tick < 10; ++tick) {
    const rt::HandleState held = frame.stateOf(at({0.1 - 0.01 * tick, 0.02, 0}, tick, kClutch));
    EXPECT_EQ(held.condition, rt::HandleCondition::clutched);
    EXPECT_EQ(held.velocity_m_per_s_in_world, Vec3{});
    // held where it was when the clutch was pressed
    EXPECT_LT(norm(held.position_m_in_world - Vec3{0.07, 0.02, 0}), kRounding);
  }
  const rt::HandleState back = frame.stateOf(at({0.01, 0.02, 0}, 10));
  EXPECT_EQ(back.condition, rt::HandleCondition::ready);
  EXPECT_LT(norm(back.position_m_in_world - Vec3{0.07, 0.02, 0}), kRounding) << "no leap";
  EXPECT_LT(norm(frame.stateOf(at({0.02, 0.02, 0}, 11)).position_m_in_world - Vec3{0.08, 0.02, 0}),
            kRounding);
}

TEST(HandleFrame, CountsMeasurementsAndSessionsAndPassesOnTheDevicesState) {
  HandleFrame frame = frameOf({});
  frame.beginSession();
  HandleMeasurement measurement = at({}, 1, 5);
  measurement.calibrated = false;
  measurement.delay_s = 0.003;
  const rt::HandleState first = frame.stateOf(measurement);
  EXPECT_EQ(first.condition, rt::HandleCondition::not_calibrated);
  EXPECT_EQ(first.buttons, 5U);
  EXPECT_EQ(first.delay_s, 0.003);
  EXPECT_EQ(first.sequence, 1U);
  EXPECT_EQ(first.session, 1U);
  frame.beginSession();
  const rt::HandleState second = frame.stateOf(at({}, 2));
  EXPECT_EQ(second.sequence, 2U);
  EXPECT_EQ(second.session, 2U);
}

// ---- Position

constexpr double kStep_m = 5e-5;

double rounded(double position_m) {
  return kStep_m * std::round(position_m / kStep_m);
}

/// A hand's motion: a few sines of random frequency, up to 10 Hz, and amplitude.
double wanderAt(unsigned seed, double t_s) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  double position_m = 0;
  for (int i = 0; i < 4; ++i) {
    const double hz = std::pow(10, 2 * share(random) - 1);
    position_m += 0.01 * share(random) / hz * std::sin(2 * std::numbers::pi * (hz * t_s + share(random)));
  }
  return position_m;
}

TEST(PositionTracker, StaysWithinHalfAStepOfWhatIsMeasuredAndAStepOfTheTruth) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    PositionTracker tracker(kStep_m);
    for (int i = 0; i < 3000; ++i) {
      const double true_m = wanderAt(seed, i * 1e-3);
      const double found_m = tracker.add({0, rounded(true_m), 0}, i * kPeriodNs).y;
      ASSERT_LE(std::abs(found_m - rounded(true_m)), 0.5 * kStep_m * (1 + 1e-9)) << seed;
      ASSERT_LE(std::abs(found_m - true_m), kStep_m * (1 + 1e-9)) << seed;
    }
  }
}

// Rounding has an error of 0.29 steps RMS.
TEST(PositionTracker, InterpolatesASteadyMotion) {
  for (const double speed : {0.0073, 0.011, 0.03, 0.1}) {
    PositionTracker tracker(kStep_m);
    double squares = 0;
    for (int i = 0; i < 2000; ++i) {
      const double found_m = tracker.add({0, 0, rounded(speed * i * 1e-3)}, i * kPeriodNs).z;
      if (i >= 100) squares += std::pow(found_m - speed * i * 1e-3, 2);
    }
    EXPECT_LT(std::sqrt(squares / 1900), 0.15 * kStep_m) << speed << " m/s";
  }
}

// A spring that acts late by T gives an oscillating device k pi w A^2 T per period. What the interpolation
// adds to rounding must not be late by as much as the half period of 1 ms that holding the force costs
// anyway.
TEST(PositionTracker, FeedsAnOscillationByLessThanHoldingTheForceDoes) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  constexpr double kHalfPeriod_s = 0.5e-3;
  for (int i = 0; i < 200; ++i) {
    const double w = 2 * std::numbers::pi * (4 + 26 * share(random));
    const double amplitude_m = kStep_m * std::pow(10, 2 * share(random));
    PositionTracker tracker(kStep_m);
    double work = 0;  // per stiffness
    constexpr int kSamples = 10'000;
    for (int tick = 0; tick < kSamples; ++tick) {
      const double t_s = tick * 1e-3;
      const double measured_m = rounded(amplitude_m * std::sin(w * t_s));
      const double added_m = tracker.add({measured_m, 0, 0}, tick * kPeriodNs).x - measured_m;
      work -= added_m * amplitude_m * w * std::cos(w * t_s) * 1e-3;
    }
    const double per_second_of_lateness = 0.5 * w * w * amplitude_m * amplitude_m * kSamples * 1e-3;
    EXPECT_LT(work / per_second_of_lateness, kHalfPeriod_s) << w << " rad/s, " << amplitude_m << " m";
  }
}

TEST(PositionTracker, LeavesSlowStepsAsTheyAre) {
  PositionTracker tracker(kStep_m);
  for (int i = 0; i < 2000; ++i) {
    const double measured_m = rounded(0.004 * i * 1e-3);
    ASSERT_EQ(tracker.add({0, measured_m, 0}, i * kPeriodNs).y, measured_m);
  }
}

TEST(PositionTracker, ReturnsAnExactPositionAsItIs) {
  PositionTracker tracker(0);
  for (int i = 0; i < 100; ++i) {
    const Vec3 place{wanderAt(1, i * 1e-3), wanderAt(2, i * 1e-3), 0};
    EXPECT_EQ(tracker.add(place, i * kPeriodNs), place);
  }
}

TEST(PositionTracker, ForgetsAllAtAPositionThatIsNotFinite) {
  PositionTracker tracker(kStep_m);
  for (int i = 0; i < 100; ++i) tracker.add({rounded(0.05 * i * 1e-3), 0, 0}, i * kPeriodNs);
  EXPECT_TRUE(std::isnan(tracker.add({std::nan(""), 0, 0}, 100 * kPeriodNs).x));
  const Vec3 next{101 * kStep_m, 0, 0};
  EXPECT_EQ(tracker.add(next, 101 * kPeriodNs), next);
}

TEST(PositionTracker, LeavesTheStepsOfADeviceThatMeasuresTooOftenForALine) {
  PositionTracker tracker(kStep_m);
  for (int i = 0; i < 4000; ++i) {
    const double measured_m = rounded(0.03 * i * 0.25e-3);
    ASSERT_EQ(tracker.add({measured_m, 0, 0}, i * kPeriodNs / 4).x, measured_m);
  }
}

TEST(PositionTracker, BeginsAnewAfterAPause) {
  PositionTracker tracker(kStep_m);
  for (int i = 0; i < 100; ++i) tracker.add({rounded(0.05 * i * 1e-3), 0, 0}, i * kPeriodNs);
  const Vec3 later{100 * kStep_m, 0, 0};
  EXPECT_EQ(tracker.add(later, 1'000 * kPeriodNs), later);
  EXPECT_EQ(tracker.add(later, 1'001 * kPeriodNs), later);
  tracker.reset();
  EXPECT_EQ(tracker.add({}, 1'002 * kPeriodNs), Vec3{});
}

// ---- Velocity

/// Returns the velocity estimates for a motion sampled at 1 kHz and rounded to `quantum_m`; `resolution_m`:
/// of the estimator.
template <typename Motion>
std::vector<double> estimates(double quantum_m, double resolution_m, int samples, Motion motion) {
  VelocityEstimator estimator(resolution_m);
  std::vector<double> velocities;
  for (int i = 0; i < samples; ++i) {
    const double x = std::round(motion(i * 1e-3) / quantum_m) * quantum_m;
    velocities.push_back(estimator.add({0, x, 0}, i * kPeriodNs).y);
  }
  return velocities;
}

TEST(VelocityEstimator, HasNoBiasAtConstantVelocity) {
  for (const double speed : {0.001, 0.03, 0.5}) {
    const std::vector<double> found = estimates(1e-9, 1e-9, 100, [&](double t) { return speed * t; });
    EXPECT_NEAR(found.back(), speed, 1e-6) << "a rounding of 1 nm over 2 ms at most";
  }
}

// Rounded positions are off by up to half a quantum: the slope of three of them, (x_0 - x_2) / (2 T), by at
// most half the error of a raw difference, q / T.
TEST(VelocityEstimator, IsQuietOnASlowHandWhereARawDifferenceIsNot) {
  constexpr double kQuantum = 5e-5;
  const std::vector<double> found = estimates(kQuantum, kQuantum, 2000, [](double t) { return 0.0071 * t; });
  double worst = 0;
  for (std::size_t i = 20; i < found.size(); ++i) worst = std::max(worst, std::abs(found[i] - 0.0071));
  EXPECT_LE(worst, 0.5 * kQuantum / 1e-3 * (1 + 1e-9)) << "of the raw difference";
}

// The line is never longer than two periods of 1 ms, so it lags by at most half of that.
TEST(VelocityEstimator, FollowsAnAccelerationWithinItsStatedLag) {
  constexpr double kAcceleration = 20;  // of a jerking hand
  constexpr double kQuantum = 1e-7;     // far below the resolution: a long line would fit the oscillation
  constexpr double kRounding_s = kQuantum / 1e-3 / kAcceleration;
  const std::vector<double> found =
      estimates(kQuantum, 5e-5, 60, [](double t) { return 0.5 * kAcceleration * t * t; });
  for (std::size_t i = 30; i < found.size(); ++i) {
    const double lag_s = static_cast<double>(i) * 1e-3 - found[i] / kAcceleration;
    EXPECT_LT(lag_s, 1e-3 + kRounding_s);
    EXPECT_GT(lag_s, 0.5e-3 - kRounding_s) << "two samples";
  }
}

TEST(VelocityEstimator, ForgetsThePauseOfADeviceAndSamplesThatDoNotComeLater) {
  VelocityEstimator estimator(5e-5);
  estimator.add({0, 0, 0}, 0);
  EXPECT_EQ(estimator.add({1, 0, 0}, 1'000 * kPeriodNs), Vec3{}) << "a second later";
  EXPECT_EQ(estimator.add({1.1, 0, 0}, 1'000 * kPeriodNs), Vec3{}) << "at the same time: it replaces";
  EXPECT_NEAR(estimator.add({1.101, 0, 0}, 1'001 * kPeriodNs).x, 1, 1e-9);
  estimator.add({5, 0, 0}, 1'002 * kPeriodNs);
  EXPECT_NEAR(estimator.add({1.102, 0, 0}, 1'001 * kPeriodNs).x, 2, 1e-9) << "the device's clock went back";
}

}  // namespace
}  // namespace hapticd::drivers
