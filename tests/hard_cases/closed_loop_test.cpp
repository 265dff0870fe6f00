// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/hapticbench/stability.h"

namespace hapticd::test {
namespace {

using rt::FixtureKind;
using tools::ContactRun;
using tools::CoreOutput;
using tools::Rig;
using tools::Tap;

// The closed loop of device, hand and delay around the whole core with the shipped settings, in cases beyond
// hapticbench's taps.

struct Case {
  double mass_kg;
  double friction_n;
  double quantum_m;
  int delay_ticks;
};

constexpr double kDeviceDamping_n_s_per_m = 0.05;

class ClosedLoop : public testing::TestWithParam<const char*> {
 protected:
  /// Returns the law of the test parameter with its shipped settings; the driver reports the delay.
  std::unique_ptr<tools::Wall> wallOf(const Case& of) const {
    const rt::ForceLaw law =
        std::string_view(GetParam()) == "proxy" ? rt::ForceLaw::proxy : rt::ForceLaw::surface;
    auto wall = std::make_unique<tools::CoreWall>(law, rt::LiveParameters{}, CoreOutput::command);
    wall->set(500, 0);
    wall->reportDelay_s(of.delay_ticks * tools::kTick_s);
    return wall;
  }
  static Rig rigOf(const Case& of, double hand_stiffness_n_per_m = 0, double hand_damping_n_s_per_m = 0) {
    Rig rig;
    rig.system = {.mass_kg = of.mass_kg,
                  .damping_n_s_per_m = kDeviceDamping_n_s_per_m,
                  .coulomb_friction_n = of.friction_n,
                  .hand_stiffness_n_per_m = hand_stiffness_n_per_m,
                  .hand_damping_n_s_per_m = hand_damping_n_s_per_m};
    rig.quantum_m = of.quantum_m;
    rig.delay_ticks = of.delay_ticks;
    rig.as_driver = true;
    return rig;
  }
};

/// Devices with exact measurements, with encoders, and with encoders and the dry friction of gears.
std::vector<Case> hardCases() {
  std::vector<Case> cases;
  for (const double mass_kg : {0.045, 0.1}) {
    for (const int delay_ticks : {0, 1, 2, 5, 10}) {
      cases.push_back({mass_kg, 0, 0, delay_ticks});
      cases.push_back({mass_kg, 0, 55e-6, delay_ticks});
      cases.push_back({mass_kg, 0.26, 55e-6, delay_ticks});
    }
  }
  return cases;
}

/// The case that settles most slowly, 100 g without delay, keeps 0.44 N s/m of contact damping and its own
/// 0.05 N s/m; sampling cancels K T / 2 = 0.25 N s/m of that. The time constant is 0.83 s, so oscillations of
/// 20 mm decay to 0.02 mm in the first 6 s; the last 2 s are evaluated.
constexpr double kFall_s = 8;

// Nobody holds the device: a weight of 1 N drops it onto the surface at up to 0.2, 0.37, 0.47 and 0.67 m/s
// (45 g), and it bounces.
TEST_P(ClosedLoop, AReleasedDeviceThatFallsOntoTheSurfaceComesToRest) {
  for (const double height_m : {0.0009, 0.003, 0.005, 0.01}) {
    for (const Case& of : hardCases()) {
      const auto wall = wallOf(of);
      const Tap fall{.start_m = height_m, .speed_m_per_s = 0, .constant_n = -1};
      const ContactRun run = tools::runContactFor(*wall, rigOf(of), fall, kFall_s);
      const std::string where = fmt::format("{} m, {} kg, {} N, {} m, {} ms", height_m, of.mass_kg,
                                            of.friction_n, of.quantum_m, of.delay_ticks);
      EXPECT_FALSE(run.ran_away) << where;
      EXPECT_LT(run.peak_to_peak_m, 2 * std::max(of.quantum_m, 5e-5))
          << where << ": rest, but for the encoder";
      EXPECT_LE(run.most_given_j, tools::kMaxGiven_j) << where;
      EXPECT_GT(run.deepest_m, -0.025) << where << ": it is stopped";
    }
  }
}

// Fast taps of a light and of a firm hand.
TEST_P(ClosedLoop, FastTapsComeToRest) {
  for (const Case& of : hardCases()) {
    for (const double grip : {1.0, 2.5}) {
      const auto wall = wallOf(of);
      const ContactRun run =
          tools::runContactFor(*wall, rigOf(of, 400 * grip, 4 * grip),
                               {.start_m = 0, .speed_m_per_s = 0.5, .hand_target_m = -0.005}, 4);
      EXPECT_LT(run.peak_to_peak_m, 1e-4) << of.mass_kg << " " << of.friction_n << " " << of.delay_ticks;
      EXPECT_LE(run.most_given_j, tools::kMaxGiven_j) << of.mass_kg << " " << of.delay_ticks;
    }
  }
}

// Stiffness that remains for each delay, e.g. 0.35 * 0.045 kg / (10.5 ms)^2 = 142.86 N/m.
TEST_P(ClosedLoop, KeepsTheStiffnessThatIsStableWithTheLightestDevice) {
  for (const auto& [delay_ticks, min_n_per_m] : {std::pair{0, 500.0}, {2, 500.0}, {5, 500.0}, {10, 142.8}}) {
    const auto wall = wallOf({0.045, 0, 0, delay_ticks});
    wall->approach(-0.004);
    EXPECT_GE(wall->stiffnessKept_n_per_m(), min_n_per_m) << delay_ticks;
    // at rest only the spring acts; the surface is within 0.1 mm of its nominal position (rounding)
    EXPECT_NEAR(wall->force_n(-0.004, 0), 0.004 * wall->stiffnessKept_n_per_m(), 1e-4 * 500) << delay_ticks;
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, ClosedLoop, testing::Values("proxy", "surface"),
                         [](const auto& law) { return std::string(law.param); });

// The closed loop of device, hand and delay with fixtures and tissue in front of the surface or in its place.

constexpr double kSurface_m = -1;

/// What is added to the surface.
struct Added {
  std::unique_ptr<rt::FixtureSet> fixtures = std::make_unique<rt::FixtureSet>();
  std::unique_ptr<rt::TissueMap> tissue = std::make_unique<rt::TissueMap>();

  rt::Fixture& fixture(FixtureKind kind, double stiffness_n_per_m) {
    rt::Fixture& fixture = fixtures->fixtures[fixtures->count++];
    fixture.kind = kind;
    fixture.identity = fixtures->count;
    fixture.definition = fixtures->count;
    fixture.stiffness_n_per_m = stiffness_n_per_m;
    fixture.max_force_n = 10;
    fixture.shape.kind = rt::ShapeKind::plane;
    fixture.shape.position_m_in_world = {0, 0, kSurface_m};
    fixtures->generation = 1;
    return fixture;
  }
  rt::TissueRegion& region(rt::ContactModel model, double stiffness_n_per_m) {
    rt::TissueRegion& region = tissue->regions[tissue->count++];
    region.identity = tissue->count;
    region.shape.kind = rt::ShapeKind::sphere;
    region.shape.position_m_in_world = {0, 0, kSurface_m};
    region.shape.radius_m = 0.2;
    region.model = model;
    region.stiffness_n_per_m = stiffness_n_per_m;
    tissue->generation = 1;
    return region;
  }
};

struct Scene {
  const char* name;
  void (*add)(Added&);
};

void addPlane(Added& added) {
  added.fixture(FixtureKind::plane, 500);
}
void addPlanes(Added& added) {
  added.fixture(FixtureKind::plane, 300);
  added.fixture(FixtureKind::plane, 700).shape.axis_in_world = {0.6, 0, 0.8};
}
void addStandoff(Added& added) {
  added.fixture(FixtureKind::standoff, 700).clearance_m = 0.003;
}
void addLayers(Added& added) {
  rt::TissueRegion& region = added.region(rt::ContactModel::layered, 300);
  region.lower_stiffness_n_per_m = 1200;
  region.layer_m = 0.002;
}
void addHuntCrossley(Added& added) {
  rt::TissueRegion& region = added.region(rt::ContactModel::hunt_crossley, 600);
  region.damping_per_speed_s_per_m = 0.5;
}
void addAll(Added& added) {
  addStandoff(added);
  addPlanes(added);
  addLayers(added);
}

class FixtureLoop : public testing::TestWithParam<Scene> {
 protected:
  FixtureLoop() { GetParam().add(added_); }

  std::unique_ptr<tools::CoreWall> wallWith(int delay_ticks) const {
    auto wall = std::make_unique<tools::CoreWall>(rt::ForceLaw::surface, rt::LiveParameters{},
                                                  tools::CoreOutput::command);
    wall->set(500, 0);
    wall->reportDelay_s(delay_ticks * tools::kTick_s);
    wall->setAdditions(added_.fixtures.get(), added_.tissue.get());
    return wall;
  }

 private:
  Added added_;
};

Rig rigOf(double mass_kg, int delay_ticks, double hand_stiffness_n_per_m, double hand_damping_n_s_per_m) {
  Rig rig;
  rig.system = {.mass_kg = mass_kg,
                .damping_n_s_per_m = 0.05,
                .coulomb_friction_n = 0,
                .hand_stiffness_n_per_m = hand_stiffness_n_per_m,
                .hand_damping_n_s_per_m = hand_damping_n_s_per_m};
  rig.quantum_m = 55e-6;
  rig.delay_ticks = delay_ticks;
  rig.as_driver = true;
  return rig;
}

/// Where several springs act, the device rests between two steps of the encoder, of 55 um, on either side.
constexpr double kRest_m = 3 * 55e-6;

constexpr int kDelays[] = {0, 1, 2, 5, 10};

TEST_P(FixtureLoop, AReleasedDeviceComesToRest) {
  for (const double mass_kg : {0.045, 0.1}) {
    for (const int delay_ticks : kDelays) {
      for (const double height_m : {0.005, 0.012}) {
        const auto wall = wallWith(delay_ticks);
        const Tap fall{.start_m = height_m, .speed_m_per_s = 0, .constant_n = -1};
        const ContactRun run = tools::runContactFor(*wall, rigOf(mass_kg, delay_ticks, 0, 0), fall, 8);
        const std::string where = fmt::format("{} kg, {} ms, {} m", mass_kg, delay_ticks, height_m);
        EXPECT_FALSE(run.ran_away) << where;
        EXPECT_LT(run.peak_to_peak_m, kRest_m) << where << ": rest, but for the encoder";
        EXPECT_LE(run.most_given_j, tools::kMaxGiven_j) << where;
        EXPECT_GT(run.deepest_m, -0.035) << where << ": it is stopped within the shell of the surface";
      }
    }
  }
}

TEST_P(FixtureLoop, FastTapsOfAHandComeToRest) {
  for (const int delay_ticks : kDelays) {
    for (const double grip : {1.0, 2.5}) {
      const auto wall = wallWith(delay_ticks);
      const ContactRun run =
          tools::runContactFor(*wall, rigOf(0.045, delay_ticks, 400 * grip, 4 * grip),
                               {.start_m = 0.004, .speed_m_per_s = 0.5, .hand_target_m = -0.005}, 4);
      EXPECT_LT(run.peak_to_peak_m, kRest_m) << delay_ticks << " ms, grip " << grip;
      EXPECT_LE(run.most_given_j, tools::kMaxGiven_j) << delay_ticks << " ms, grip " << grip;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, FixtureLoop,
                         testing::Values(Scene{"plane", addPlane}, Scene{"planes", addPlanes},
                                         Scene{"standoff", addStandoff}, Scene{"layers", addLayers},
                                         Scene{"hunt_crossley", addHuntCrossley}, Scene{"all", addAll}),
                         [](const auto& scene) { return std::string(scene.param.name); });

}  // namespace
}  // namespace hapticd::test
