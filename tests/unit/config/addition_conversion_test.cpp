// SPDX-License-Identifier: Apache-2.0
// Fixtures and regions in the form of the force loop.

#include <gtest/gtest.h>

#include <cmath>

#include <algorithm>
#include <array>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "config/settings/fixture_settings.h"

namespace hapticd::config {
namespace {

using Fixtures = std::vector<FixtureSettings>;

// A quarter turn about the world's z axis: the camera's x axis is the world's y axis.
const rt::PoseParameters kCamera{
    .position_m = {1, 2, 3}, .roll_rad = 0, .pitch_rad = 0, .yaw_rad = std::numbers::pi / 2};

void expectNear(const rt::Vec3& found, const rt::Vec3& expected) {
  EXPECT_NEAR(norm(found - expected), 0, 1e-12) << found.x << ", " << found.y << ", " << found.z;
}

FixtureSettings sphere(const std::string& name) {
  return {.name = name, .kind = rt::FixtureKind::sphere, .position_m = {0, 0, 0.1}, .radius_m = 0.05};
}

struct Set {
  std::unique_ptr<rt::FixtureSet> set = std::make_unique<rt::FixtureSet>();
  Fixtures before;
  double tool_radius_m = 0;

  void take(const Fixtures& fixtures) {
    toFixtureSet(fixtures, before, {kCamera, {}, {}, tool_radius_m}, *set);
    before = fixtures;
  }
  const rt::Fixture& at(std::size_t index) const { return set->fixtures.at(index); }
};

/// The tip is a ball: what holds it off is larger by its radius, guidance leads its centre.
TEST(FixtureConversion, MakesForbiddenRegionsLargerByTheTool) {
  Set set;
  FixtureSettings ball = sphere("ball");
  ball.clearance_m = 0.004;
  ball.soft_m = 0.001;
  const Fixtures fixtures{ball, {.name = "point", .kind = rt::FixtureKind::point}};
  set.take(fixtures);
  EXPECT_DOUBLE_EQ(set.at(0).clearance_m, 0.005);
  const std::uint64_t definition = set.at(0).definition;
  const std::uint64_t guidance = set.at(1).definition;
  const std::uint32_t identity = set.at(0).identity;
  set.tool_radius_m = 0.003;
  set.take(fixtures);
  EXPECT_DOUBLE_EQ(set.at(0).clearance_m, 0.008);
  EXPECT_EQ(set.at(0).soft_m, 0.001);
  EXPECT_NE(set.at(0).definition, definition);  // it grows, and fades in
  EXPECT_EQ(set.at(0).identity, identity);
  EXPECT_EQ(set.at(1).clearance_m, 0);
  EXPECT_EQ(set.at(1).definition, guidance);
}

TEST(FixtureConversion, TurnsTheFrameOfTheCameraIntoTheWorld) {
  Set set;
  set.take({{.name = "plane",
             .kind = rt::FixtureKind::plane,
             .frame = "camera",
             .position_m = {0.5, 0, 0},
             .normal = {7, 0, 0}},
            {.name = "cone",
             .kind = rt::FixtureKind::cone,
             .frame = "camera",
             .axis = {0, 3, 0},
             .half_angle_deg = 45},
            {.name = "capsule",
             .kind = rt::FixtureKind::capsule,
             .frame = "camera",
             .position_m = {0, 0, 0},
             .end_m = {0.2, 0, 0},
             .radius_m = 0.01}});
  ASSERT_EQ(set.set->count, 3U);
  EXPECT_EQ(set.at(0).shape.kind, rt::ShapeKind::plane);
  expectNear(set.at(0).shape.position_m_in_world, {1, 2.5, 3});
  expectNear(set.at(0).shape.axis_in_world, {0, 1, 0});
  expectNear(set.at(1).shape.axis_in_world, {-1, 0, 0});
  EXPECT_DOUBLE_EQ(set.at(1).shape.half_angle_sine, std::sqrt(0.5));
  EXPECT_DOUBLE_EQ(set.at(1).shape.half_angle_cosine, std::sqrt(0.5));
  expectNear(set.at(2).shape.axis_in_world, {0, 1, 0});
  EXPECT_DOUBLE_EQ(set.at(2).shape.length_m, 0.2);
  EXPECT_EQ(set.at(2).shape.radius_m, 0.01);
}

TEST(FixtureConversion, ComposesTheRotationOfABoxWithThatOfTheCamera) {
  Set set;
  set.take({{.name = "box",
             .kind = rt::FixtureKind::box,
             .frame = "camera",
             .size_m = {0.2, 0.4, 0.6},
             .rotation_deg = {90, 0, 0}}});
  const rt::Shape& shape = set.at(0).shape;
  expectNear(shape.half_size_m, {0.1, 0.2, 0.3});
  // its axes in the world, which are the columns: x is the camera's x, y the camera's z, z minus its y
  expectNear({shape.rotation[0], shape.rotation[3], shape.rotation[6]}, {0, 1, 0});
  expectNear({shape.rotation[1], shape.rotation[4], shape.rotation[7]}, {0, 0, 1});
  expectNear({shape.rotation[2], shape.rotation[5], shape.rotation[8]}, {1, 0, 0});
}

TEST(FixtureConversion, OnlyWhatNeedsDepthFadesWhenTheCameraIsLostUnlessSomethingElseIsSaid) {
  using enum OnCameraLoss;
  FixtureSettings standoff{.name = "s", .kind = rt::FixtureKind::standoff, .clearance_m = 0.01};
  FixtureSettings ball = sphere("b");
  FixtureSettings point{.name = "p", .kind = rt::FixtureKind::point};
  Set set;
  const auto fades = [&](OnCameraLoss said) {
    standoff.on_camera_loss = ball.on_camera_loss = point.on_camera_loss = said;
    set.take({standoff, ball, point});
    return std::array{set.at(0).fades_without_depth, set.at(1).fades_without_depth,
                      set.at(2).fades_without_depth};
  };
  EXPECT_EQ(fades(automatic), (std::array{true, false, false}));
  EXPECT_EQ(fades(keep), (std::array{false, false, false}));
  EXPECT_EQ(fades(fade), (std::array{true, true, true}));
  EXPECT_EQ(FixtureSettings{}.on_camera_loss, automatic);
}

/// The core's clearance is where a region begins to act.
TEST(FixtureConversion, LetsTheSoftLayerBeginBeforeTheBoundary) {
  FixtureSettings ball = sphere("b");
  ball.clearance_m = 0.003;
  ball.soft_m = 0.004;
  ball.soft_stiffness_n_per_m = 50;
  ball.warning_m = 0.02;
  ball.breach_m = 0.002;
  Set set;
  set.take({ball});
  EXPECT_DOUBLE_EQ(set.at(0).clearance_m, 0.007);
  EXPECT_EQ(set.at(0).soft_m, 0.004);
  EXPECT_EQ(set.at(0).soft_stiffness_n_per_m, 50);
  EXPECT_EQ(set.at(0).warning_m, 0.02);
  EXPECT_EQ(set.at(0).breach_m, 0.002);
  EXPECT_EQ(set.at(0).effect, rt::FixtureEffect::hold);
}

TEST(FixtureConversion, TakesOverWhatAZoneIs) {
  FixtureSettings zone = sphere("z");
  zone.effect = rt::FixtureEffect::slow;
  zone.viscosity_n_s_per_m = 12;
  zone.speed_limit_m_per_s = 0.05;
  zone.ramp_m = 0.02;
  Set set;
  set.take({zone});
  EXPECT_EQ(set.at(0).effect, rt::FixtureEffect::slow);
  EXPECT_EQ(set.at(0).viscosity_n_s_per_m, 12);
  EXPECT_EQ(set.at(0).speed_limit_m_per_s, 0.05);
  EXPECT_EQ(set.at(0).ramp_m, 0.02);
}

TEST(FixtureConversion, PutsPathsBehindEachOtherWithoutGaps) {
  const FixtureSettings path{
      .name = "p", .kind = rt::FixtureKind::path, .points_m = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}}};
  FixtureSettings second = path;
  second.name = "q";
  second.frame = "camera";
  Set set;
  set.take({path, sphere("a"), second});
  EXPECT_EQ(set.at(0).first_element, 0U);
  EXPECT_EQ(set.at(0).element_count, 3U);
  EXPECT_EQ(set.at(1).element_count, 0U);
  EXPECT_EQ(set.at(2).first_element, 3U);
  EXPECT_EQ(set.at(2).element_count, 3U);
  expectNear(set.set->elements[0].start_m_in_world, {0, 0, 0});
  expectNear(set.set->elements[3].start_m_in_world, {1, 2, 3});
  expectNear(set.set->elements[3].tangent_in_world, {0, 1, 0});
}

TEST(FixtureConversion, KeepsIdentityByNameAndDefinitionUnlessMoreThanEnabledChanges) {
  Set set;
  set.take({sphere("a"), sphere("b")});
  const rt::Fixture a = set.at(0);
  const rt::Fixture b = set.at(1);
  EXPECT_NE(a.identity, 0U);
  EXPECT_NE(a.identity, b.identity);
  EXPECT_NE(a.definition, b.definition);

  FixtureSettings disabled = sphere("b");
  disabled.enabled = false;
  set.take({disabled, sphere("a")});
  EXPECT_EQ(set.at(0).identity, b.identity);
  EXPECT_EQ(set.at(0).definition, b.definition);
  EXPECT_FALSE(set.at(0).enabled);
  EXPECT_EQ(set.at(1).identity, a.identity);

  FixtureSettings stiffer = sphere("a");
  stiffer.stiffness_n_per_m = 301;
  set.take({stiffer});
  EXPECT_EQ(set.at(0).identity, a.identity);
  EXPECT_NE(set.at(0).definition, a.definition);
}

TEST(FixtureConversion, NeverGivesAnIdentityAgain) {
  Set set;
  std::vector<std::uint32_t> identities;
  for (int i = 0; i < 100; ++i) {
    Fixtures fixtures;
    for (int j = 0; j <= i % 16; ++j) fixtures.push_back(sphere(std::to_string(i) + "-" + std::to_string(j)));
    const std::uint64_t generation = set.set->generation;
    set.take(fixtures);
    EXPECT_EQ(set.set->generation, generation + 1);
    for (std::size_t j = 0; j < fixtures.size(); ++j) identities.push_back(set.at(j).identity);
  }
  std::ranges::sort(identities);
  EXPECT_EQ(std::ranges::adjacent_find(identities), identities.end());
}

TEST(FixtureConversion, ClearsWhatIsRemoved) {
  Set set;
  set.take({sphere("a"), sphere("b")});
  set.take({});
  EXPECT_EQ(set.set->count, 0U);
  EXPECT_EQ(set.at(0).identity, 0U);
}

TEST(TissueConversion, KeepsIdentitiesAndTakesTheLabels) {
  const auto map = std::make_unique<rt::TissueMap>();
  const RegionSettings liver{.name = "liver",
                             .shape = rt::ShapeKind::box,
                             .frame = FixtureFrame::camera,
                             .position_m = {0, 0, 1},
                             .size_m = {0.1, 0.1, 0.1},
                             .stiffness_n_per_m = 250};
  const RegionSettings bone{.name = "bone", .place = rt::TissuePlace::label, .label = 200};
  LabelImage labels{848, 480, std::string(848 * 480, '\0')};
  labels.labels[5] = '\xc8';
  toTissueMap({liver, bone}, {}, labels, kCamera, *map);
  ASSERT_EQ(map->count, 2U);
  EXPECT_TRUE(map->has_labels);
  EXPECT_EQ(map->usedLabels().size(), 848U * 480U);
  EXPECT_EQ(map->labels[5], 200);
  EXPECT_EQ(map->regions[1].label, 200);
  EXPECT_EQ(map->regions[0].stiffness_n_per_m, 250);
  expectNear(map->regions[0].shape.position_m_in_world, {1, 2, 4});
  const std::uint32_t identity = map->regions[1].identity;
  EXPECT_NE(identity, map->regions[0].identity);

  RegionSettings harder = bone;
  harder.stiffness_n_per_m = 2000;
  toTissueMap({harder}, {liver, bone}, {}, kCamera, *map);
  EXPECT_EQ(map->regions[0].identity, identity);
  EXPECT_EQ(map->regions[0].stiffness_n_per_m, 2000);
  EXPECT_EQ(map->regions[1].identity, 0U);
  EXPECT_FALSE(map->has_labels);
  EXPECT_EQ(map->labels[5], 0);
  EXPECT_EQ(map->generation, 2U);
}

}  // namespace
}  // namespace hapticd::config
