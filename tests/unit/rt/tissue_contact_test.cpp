// SPDX-License-Identifier: Apache-2.0
#include "rt/tissue/tissue_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "tests/unit/rt/flat_tissue.h"

namespace hapticd::rt {
namespace {

using test::FlatTissue;

constexpr double kRounding = 1e-9;

TEST(TissueContact, LeavesTheForceWithoutRegions) {
  FlatTissue tissue;
  EXPECT_EQ(tissue.at({0, 0, -0.003}).force_n_in_world, (Vec3{0, 0, 500 * 0.003}));
  EXPECT_FALSE(tissue.contact.in_tissue);
  EXPECT_EQ(tissue.contact.tangent_n_per_m, 500);
  EXPECT_EQ(tissue.contact.largest_n_per_m, 500);
}

TEST(TissueContact, IsTheModelInsideARegionAndTheLawBesideIt) {
  FlatTissue tissue;
  tissue.parameters.contact.damping_n_s_per_m = 3;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.stiffness_n_per_m = 800;
  region.damping_n_s_per_m = 2;
  for (const double rate : {0.1, -0.1}) {  // of the depth
    EXPECT_NEAR(tissue.freshForce({0, 0, -0.004}, {0, 0, -rate}).z, 800 * 0.004 + 2 * rate, kRounding);
    EXPECT_EQ(tissue.contact.region, 0);
    EXPECT_NEAR(tissue.freshForce({0.1, 0, -0.004}, {0, 0, -rate}).z, 500 * 0.004 + 3 * rate, kRounding);
    EXPECT_EQ(tissue.contact.region, -1);
  }
  region.model = ContactModel::hunt_crossley;
  region.damping_per_speed_s_per_m = 0.5;
  EXPECT_NEAR(tissue.freshForce({0, 0, -0.004}, {0, 0, -0.2}).z,
              800 * std::pow(0.005, -0.5) * std::pow(0.004, 1.5) * (1 + 0.5 * 0.2), kRounding);
}

TEST(TissueContact, NeverPulls) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.damping_n_s_per_m = 50;
  EXPECT_EQ(tissue.freshForce({0, 0, -0.001}, {0, 0, 1}).z, 0);
  region.model = ContactModel::hunt_crossley;
  region.damping_per_speed_s_per_m = 2;
  EXPECT_EQ(tissue.freshForce({0, 0, -0.001}, {0, 0, 1}).z, 0);
}

TEST(TissueContact, StatesTheTangentStiffnessAndTheLargestOne) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.model = ContactModel::layered;
  region.stiffness_n_per_m = 300;
  region.lower_stiffness_n_per_m = 900;
  tissue.freshForce({0, 0, -0.002});
  EXPECT_NEAR(tissue.contact.tangent_n_per_m, 300, kRounding);
  EXPECT_NEAR(tissue.contact.largest_n_per_m, 900, kRounding);
  tissue.freshForce({0, 0, -0.008});
  EXPECT_NEAR(tissue.contact.tangent_n_per_m, 900, kRounding);
  region.model = ContactModel::hunt_crossley;
  tissue.freshForce({0, 0, -0.002});
  EXPECT_NEAR(tissue.contact.largest_n_per_m, 1.5 * 300 * std::sqrt(2), 1e-6);
  region.stiffness_n_per_m = 100;
  tissue.freshForce({0, 0, -0.002});
  EXPECT_NEAR(tissue.contact.largest_n_per_m, 500, kRounding);
}

/// Two regions of all models that overlap each other and the rest.
void addOverlappingRegions(FlatTissue& tissue, ContactModel first, ContactModel second) {
  TissueRegion& sphere = tissue.addSphere({0.01, 0, 0}, 0.015, 0.01);
  sphere.model = first;
  sphere.stiffness_n_per_m = 900;
  sphere.lower_stiffness_n_per_m = 1500;
  TissueRegion& box = tissue.addBox({-0.005, 0.01, 0}, {0.012, 0.01, 0.01}, 0.008);
  box.model = second;
  box.stiffness_n_per_m = 250;
  box.lower_stiffness_n_per_m = 1200;
  box.layer_m = 0.003;
}

/// Returns the work of the force along a closed path of the HIP, by the trapezoidal rule.
double workAround(FlatTissue& tissue, const Vec3& middle, double turn) {
  constexpr int kSteps = 200'000;
  const auto place = [&middle, turn](int i) {
    const double angle = 2 * std::numbers::pi * i / kSteps;
    return middle + Vec3{0.02 * std::cos(angle), 0.02 * std::sin(angle + turn),
                         -0.005 + 0.004 * std::sin(2 * angle + turn)};
  };
  double work_j = 0;
  Vec3 before = tissue.freshForce(place(0));
  for (int i = 1; i <= kSteps; ++i) {
    const Vec3 force = tissue.freshForce(place(i));
    work_j += dot(before + force, place(i) - place(i - 1)) / 2;
    before = force;
  }
  return work_j;
}

TEST(TissueContact, GivesNoEnergyOnClosedPathsOverBorders) {
  for (const ContactModel first : {ContactModel::linear, ContactModel::layered}) {
    for (const ContactModel second : {ContactModel::hunt_crossley, ContactModel::layered}) {
      FlatTissue tissue;
      addOverlappingRegions(tissue, first, second);
      for (const double turn : {0.0, 0.7, 1.9}) EXPECT_NEAR(workAround(tissue, {}, turn), 0, 1e-9);
    }
  }
}

TEST(TissueContact, StoresTheEnergyThatTheForceTakes) {
  FlatTissue tissue;
  addOverlappingRegions(tissue, ContactModel::linear, ContactModel::hunt_crossley);
  constexpr int kSteps = 20'000;
  double work_j = 0;
  Vec3 before;
  Vec3 last;
  for (int i = 1; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    const Vec3 hip{0.03 * share, 0.01 * share, -0.007 * share};
    const Vec3 force = tissue.freshForce(hip);
    work_j -= dot(before + force, hip - last) / 2;
    before = force;
    last = hip;
    if (i % 1000 == 0) {
      EXPECT_NEAR(tissue.contact.energy_j, work_j, 1e-8);
    }
  }
}

// The bound is what the core takes as explained by the displacement alone.
TEST(TissueContact, ChangesNoFasterThanStated) {
  FlatTissue tissue;
  addOverlappingRegions(tissue, ContactModel::linear, ContactModel::hunt_crossley);
  Vec3 before;
  double steepest = 0;
  constexpr double kStep_m = 2e-5;
  for (int i = 0; i < 4000; ++i) {
    const double angle = 0.01 * i;
    const Vec3 hip{-0.04 + kStep_m * i, 0.01 * std::sin(angle), -0.004};
    const Vec3 force = tissue.freshForce(hip);
    if (i > 0) {
      const double displacement = std::hypot(kStep_m, 0.01 * (std::sin(angle) - std::sin(angle - 0.01)));
      ASSERT_LE(norm(force - before),
                1.001 * std::max(steepest, tissue.contact.steepest_n_per_m) * displacement + kRounding);
    }
    steepest = tissue.contact.steepest_n_per_m;
    before = force;
  }
}

TEST(TissueContact, DoesNotStiffenBeforeTheContactEnds) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.stiffness_n_per_m = 400;
  const Vec3 pressed{0, 0, -0.005};
  tissue.at(pressed);
  region.stiffness_n_per_m = 1000;
  tissue.map->generation += 1;
  for (int i = 0; i < 5000; ++i) ASSERT_NEAR(tissue.at(pressed).force_n_in_world.z, 2, kRounding);
  tissue.at({0, 0, 0.001});
  EXPECT_NEAR(tissue.at(pressed).force_n_in_world.z, 5, kRounding);
}

TEST(TissueContact, SoftensByAtMostOneKilonewtonPerMetreAndSecond) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.stiffness_n_per_m = 1000;
  const Vec3 pressed{0, 0, -0.005};
  tissue.at(pressed);
  region.stiffness_n_per_m = 400;
  tissue.map->generation += 1;
  for (int i = 1; i <= 700; ++i) {
    const double expected = std::max(400.0, 1000 - 1000 * i * FlatTissue::kPeriod_s);
    ASSERT_NEAR(tissue.at(pressed).force_n_in_world.z, 0.005 * expected, kRounding);
  }
}

TEST(TissueContact, KeepsARegionThatAppearsInContactAsSoftAsWhatWasThere) {
  FlatTissue tissue;
  tissue.addSphere({0.5, 0, 0}, 0.02, 0.01);
  const Vec3 pressed{0, 0, -0.005};
  tissue.at(pressed);
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.model = ContactModel::layered;
  region.stiffness_n_per_m = 1500;
  region.lower_stiffness_n_per_m = 2000;
  for (int i = 0; i < 100; ++i) ASSERT_NEAR(tissue.at(pressed).force_n_in_world.z, 2.5, kRounding);
  tissue.at({0, 0, 0.001});
  EXPECT_GT(tissue.at(pressed).force_n_in_world.z, 7);
}

TEST(TissueContact, FollowsARegionToItsNewPlaceInTheMap) {
  FlatTissue tissue;
  tissue.addSphere({0.5, 0, 0}, 0.02, 0.01);
  tissue.addSphere({}, 0.02, 0.01).stiffness_n_per_m = 400;
  const Vec3 pressed{0, 0, -0.005};
  tissue.at(pressed);
  tissue.map->regions[0] = tissue.map->regions[1];
  tissue.map->regions[0].stiffness_n_per_m = 1000;
  tissue.map->count = 1;
  tissue.map->generation += 1;
  EXPECT_NEAR(tissue.at(pressed).force_n_in_world.z, 2, kRounding);
}

TEST(TissueContact, BlendsTheFrictionOfTheRegions) {
  FlatTissue tissue;
  tissue.parameters.contact.friction = 0.1;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.friction = 0.5;
  region.stiffness_n_per_m = 1000;
  tissue.at({0, 0, -0.004});
  EXPECT_NEAR(tissue.contact.friction, 0.5, kRounding);
  // The law holds friction times the depth by springs of k_s, half as stiff as the region.
  EXPECT_NEAR(tissue.tissue.frictionOfLaw(tissue.parameters.contact), 1, kRounding);
  tissue.at({0.02, 0, -0.004});
  EXPECT_NEAR(tissue.contact.friction, 0.3, kRounding);
  tissue.at({0.1, 0, -0.004});
  EXPECT_NEAR(tissue.tissue.frictionOfLaw(tissue.parameters.contact), 0.1, kRounding);
}

TEST(TissueContact, PassesTheCueByTheShareOfTheRegion) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.cue_force_n = 0.2;
  region.cue_hz = 80;
  tissue.at({0, 0, -0.004});
  EXPECT_NEAR(tissue.contact.cue_force_n, 0.2, kRounding);
  EXPECT_EQ(tissue.contact.cue_hz, 80);
  tissue.at({0.02, 0, -0.004});
  EXPECT_NEAR(tissue.contact.cue_force_n, 0.1, kRounding);
  tissue.at({0, 0, 0.004});
  EXPECT_EQ(tissue.contact.cue_force_n, 0);
}

}  // namespace
}  // namespace hapticd::rt
