// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/vendor_devices/phantom_omni/emulated_omni.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"

// The measurement of an Omni's gains with a simulated arm in its own time.
namespace hapticd::test {
namespace {

namespace omni = tools::phantom_omni;

/// Encoders resolve 0.024 degrees.
constexpr double kCount_rad = 2 * std::numbers::pi / 15000;

class SimulatedArm final : public omni::BenchArm {
 public:
  OmniModel model;
  bool keeps_torque = false;
  std::uint64_t steps_late = 0;  ///< that it claims from now on
  OmniJoints last_counts{};      ///< of the last step
  double most_counts = 0;

  base::Result<omni::BenchStep> step(const omni::PerJoint<int>& counts) override {
    for (std::size_t joint = 0; joint < 3; ++joint) {
      last_counts[joint] = counts[joint];
      most_counts = std::max(most_counts, std::abs(last_counts[joint]));
    }
    return omni::BenchStep{passed(kStep_s, last_counts), kStep_s};
  }
  base::Result<omni::JointAngles> pausePackets(double seconds) override {
    ++pauses;
    return passed(seconds, keeps_torque ? last_counts : OmniJoints{});
  }
  std::uint64_t lateSteps() const override { return steps_late == 0 ? 0 : late_ += steps_late; }
  int pauses = 0;

 private:
  omni::JointAngles passed(double seconds, const OmniJoints& counts) {
    constexpr double kDt_s = 2.5e-4;
    OmniJoints torque{};
    for (std::size_t joint = 0; joint < 3; ++joint)
      torque[joint] = counts[joint] * model.settings.n_m_per_count[joint];
    for (double passed_s = 0; passed_s < seconds - kDt_s / 2; passed_s += kDt_s) model.step(kDt_s, torque);
    omni::JointAngles seen_rad{};
    for (std::size_t joint = 0; joint < 3; ++joint)
      seen_rad[joint] = std::round(model.angles_rad[joint] / kCount_rad) * kCount_rad;
    return seen_rad;
  }

  mutable std::uint64_t late_ = 0;
};

/// Does what is asked for, with the arm that it has.
class Helper final : public tools::Person {
 public:
  Helper(SimulatedArm& arm, double mass_kg) : arm_(arm), mass_kg_(mass_kg) {}

  std::vector<std::string> requests;
  int gives_up_at = -1;  ///< number of the request
  bool pulls_left = false;
  double mass_share = 1;       ///< of the mass that is asked for
  std::string flips_signs_at;  ///< begin of a request

  void say(const std::string&) override {}
  bool isReady(const std::string& request) override {
    if (static_cast<int>(requests.size()) == gives_up_at) return false;
    requests.push_back(request);
    OmniModelSettings& settings = arm_.model.settings;
    settings.hanging_kg = settings.pull_right_kg = 0;
    const double mass_kg = mass_share * mass_kg_;
    if (request.starts_with("Hang")) settings.hanging_kg = mass_kg;
    if (request.starts_with("Lead")) settings.pull_right_kg = pulls_left ? -mass_kg : mass_kg;
    if (!flips_signs_at.empty() && request.starts_with(flips_signs_at)) {
      for (double& gain : settings.n_m_per_count) gain = -gain;
    }
    if (request.starts_with("Take everything")) arm_.model.angles_rad = {0.1, 0, 0.05};
    if (request.starts_with("Take the mass off")) arm_.model.angles_rad[0] = 0;
    arm_.model.velocity_rad_per_s = {};
    return true;
  }
  std::optional<bool> answer(const std::string&) override { return std::nullopt; }

 private:
  SimulatedArm& arm_;
  double mass_kg_;
};

OmniModelSettings randomSettings(std::mt19937& random) {
  OmniModelSettings settings;
  settings.n_m_per_count = randomOmniGains(random);
  std::uniform_real_distribution<double> friction(0.001, 0.03);
  for (double& n_m : settings.friction_n_m) n_m = friction(random);
  settings.own_mass_kg = std::uniform_real_distribution<double>(0, 0.05)(random);
  return settings;
}

constexpr double kMass_kg = 0.1;

base::Result<omni::OmniCalibration> measure(SimulatedArm& arm, Helper& helper) {
  return omni::GainMeasurement(arm, helper, kMass_kg).run();
}

/// Expects that the measurement refuses this arm with these words, and leaves it without torque.
void expectRefused(SimulatedArm& arm, Helper& helper, const std::string& words) {
  const auto found = measure(arm, helper);
  ASSERT_FALSE(found) << words;
  EXPECT_NE(found.error().text().find(words), std::string::npos) << found.error().text();
  EXPECT_NE(found.error().text().find("nothing was stored"), std::string::npos) << found.error().text();
  EXPECT_LE(arm.most_counts, omni::GainMeasurement::kMostRampCounts);
}

TEST(OmniGains, AreFoundWithTheirSignsWhateverTheyAre) {
  std::mt19937 random(20261);
  // The joint's own weight and the lever of the mass change over the mark's 3 degrees on both sides, the
  // cosine by 0.3 %; the encoders resolve as much of a lever; speeds are not quite steady.
  constexpr double kTolerance = 0.01;
  for (int round = 0; round < 40; ++round) {
    SimulatedArm arm;
    arm.model.settings = randomSettings(random);
    Helper helper(arm, kMass_kg);
    const auto found = measure(arm, helper);
    ASSERT_TRUE(found) << round << ": " << found.error().text();
    for (std::size_t joint = 0; joint < 3; ++joint) {
      const double gain = arm.model.settings.n_m_per_count[joint];
      EXPECT_NEAR(found->n_m_per_count[joint] / gain, 1, kTolerance) << round << " " << joint;
    }
    EXPECT_TRUE(found->releases_without_packets);
    EXPECT_LE(arm.most_counts, omni::GainMeasurement::kMostRampCounts);
    EXPECT_EQ(helper.requests.size(), 4U);
  }
}

TEST(OmniGains, ComeWithWhetherTheDeviceKeepsItsTorqueWithoutPackets) {
  std::mt19937 random(20262);
  for (int round = 0; round < 10; ++round) {
    SimulatedArm arm;
    arm.model.settings = randomSettings(random);
    arm.keeps_torque = true;
    Helper helper(arm, kMass_kg);
    const auto found = measure(arm, helper);
    ASSERT_TRUE(found) << found.error().text();
    EXPECT_FALSE(found->releases_without_packets) << round;
    EXPECT_EQ(arm.pauses, 1);
  }
}

TEST(OmniGains, AreRefusedWithTheReasonWhereTheMeasurementCannotBeTrusted) {
  struct Row {
    const char* words;
    std::function<void(SimulatedArm& arm, Helper& helper)> spoil;
  };
  const auto withGains = [](const OmniJoints& gains) {
    return [gains](SimulatedArm& arm, Helper&) { arm.model.settings.n_m_per_count = gains; };
  };
  const auto withoutMotor = [](std::size_t joint) {
    return [joint](SimulatedArm& arm, Helper&) { arm.model.settings.n_m_per_count[joint] = 0; };
  };
  const auto withMassShare = [](double share) {
    return [share](SimulatedArm&, Helper& helper) { helper.mass_share = share; };
  };
  const auto flippedAt = [](const char* request) {
    return [request](SimulatedArm&, Helper& helper) { helper.flips_signs_at = request; };
  };
  const auto givenUpAt = [](int request) {
    return [request](SimulatedArm&, Helper& helper) { helper.gives_up_at = request; };
  };
  const std::vector<Row> rows{
      {"its gain is not found", withoutMotor(0)},
      {"its gain is not found", withoutMotor(1)},
      {"its gain is not found", withoutMotor(2)},
      {"do not move the mass", withGains({1e-4, 1e-4, 1e-4})},  // it is too heavy for the motors
      {"is larger than the load",
       [](SimulatedArm& arm, Helper&) {
         arm.model.settings.friction_n_m = {0.2, 0.2, 0.2};
         arm.model.settings.n_m_per_count = {5e-4, 5e-4, 5e-4};
       }},
      {"is larger than the load of 0", withMassShare(0)},
      {"its sign is inconsistent", withMassShare(-0.3)},  // it pulls up
      {"do not move the mass", flippedAt("Hang")},
      {"do not move the mass", flippedAt("Lead")},
      {"the mass has not turned it to the right",
       [](SimulatedArm&, Helper& helper) { helper.pulls_left = true; }},
      {"its gain of 0.003 N m for a count is not within", withGains({3e-3, 3e-3, 3e-3})},
      {"its gain of 0.003 N m for a count is not within", withGains({-3e-3, -3e-3, -3e-3})},
      {"this computer is too busy", [](SimulatedArm& arm, Helper&) { arm.steps_late = 1; }},
      {"was given up", givenUpAt(0)},
      {"was given up", givenUpAt(1)},
      {"was given up", givenUpAt(2)},
      {"was given up", givenUpAt(3)},
  };
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SCOPED_TRACE(i);
    SimulatedArm arm;
    Helper helper(arm, kMass_kg);
    rows[i].spoil(arm, helper);
    expectRefused(arm, helper, rows[i].words);
  }
}

}  // namespace
}  // namespace hapticd::test
