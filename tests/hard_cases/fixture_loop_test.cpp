// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "tools/hapticbench/stability.h"

// The closed loop of device, hand and delay with fixtures and tissue in front of the surface or in its place.
namespace hapticd::test {
namespace {

using rt::FixtureKind;
using tools::ContactRun;
using tools::Rig;
using tools::Tap;

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
