// SPDX-License-Identifier: Apache-2.0
// Fixtures, regions and frames as part of a configuration, in the form of the force loop, and what follows
// from them for the force law.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "config/settings/fixture_settings.h"
#include "config/settings/law_choice.h"
#include "config/settings/parameter_table.h"
#include "config/settings_summary.h"
#include "config/yaml_loader.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

constexpr const char* kStandoff = "fixtures: [{name: nerve, kind: standoff, clearance_m: 0.005}]\n";

Settings settingsOf(const std::string& yaml) {
  const auto settings = settingsFromText(yaml, "a.yaml");
  EXPECT_TRUE(settings) << settings.error().front().text();
  return settings.value_or(Settings{});
}

TEST(AdditionsInSettings, StandBesideTheParameters) {
  const Settings settings = settingsOf("force: {law: surface}\n" + std::string(kStandoff) +
                                       "label_image: labels.pgm\n"
                                       "regions:\n"
                                       "  - {name: bone, place: label, label: 2}\n"
                                       "trace:\n"
                                       "  at_start: true\n");
  ASSERT_EQ(settings.additions.fixtures.size(), 1U);
  EXPECT_EQ(settings.additions.fixtures[0].clearance_m, 0.005);
  ASSERT_EQ(settings.additions.regions.size(), 1U);
  EXPECT_EQ(settings.additions.label_image, "labels.pgm");
  EXPECT_EQ(settings.live.force.law, rt::ForceLaw::surface);
  EXPECT_TRUE(settings.trace.at_start);
}

TEST(AdditionsInSettings, AreCountedInTheSummary) {
  const test::TemporaryFolder folder;
  const auto text = [&folder](const std::string& yaml) {
    const auto loaded = loadConfiguration(folder.write("a.yaml", yaml), {}, base::FileKind::regular);
    return loaded ? summaryOf(*loaded).text() : loaded.error().front().text();
  };
  EXPECT_EQ(text(kStandoff), "0 parameters set, 1 fixture, none differs from the defaults");
  EXPECT_EQ(
      text("regions: [{name: a, shape: sphere, position_m: [0, 0, 0], radius_m: 1}, {name: b, shape: sphere, "
           "position_m: [0, 0, 0], radius_m: 1}]\nforce: {min_points: 11}\n"),
      "1 parameter set, 2 tissue regions, 1 differs from the defaults: force.min_points = 11 (default 10)");
}

TEST(AdditionsInSettings, ArePartOfProfilesButNotOfOtherParts) {
  const auto any = [](const Parameter&) { return true; };
  const auto part = partFromText("fixtures: []\nforce: {min_points: 11}\n", "part.yaml", any);
  ASSERT_TRUE(part) << part.error().front().text();
  EXPECT_EQ(part->assignments.size(), 1U);
  EXPECT_TRUE(part->additions.fixtures);
  EXPECT_FALSE(part->additions.regions);
  SceneAdditions additions{{{.name = "a"}}, {{.name = "b"}}, "c"};
  part->additions.applyTo(additions);
  EXPECT_TRUE(additions.fixtures.empty());
  EXPECT_EQ(additions.regions.size(), 1U);
  EXPECT_EQ(additions.label_image, "c");

  const auto refused = assignmentsFromText("fixtures: []\n", "part.yaml", any);
  ASSERT_FALSE(refused);
  EXPECT_EQ(
      refused.error().front().text(),
      "part.yaml:1: fixtures: is not part of this file (remove it; it belongs in hapticd.yaml or a profile)");
}

TEST(Standoff, MakesAutoChooseTheSurface) {
  const Settings settings = settingsOf(
      "fixtures:\n"
      "  - {name: nerve, kind: standoff, clearance_m: 0.005}\n"
      "  - {name: vein, kind: standoff, clearance_m: 0.02}\n"
      "  - {name: gone, kind: standoff, clearance_m: 0.04, enabled: false}\n"
      "force: {max_error_n: 10}\n");
  const LawDecision decision = chooseLaw(settings, asSeenBy({}, 1));
  EXPECT_EQ(decision.law, rt::ForceLaw::surface);
  EXPECT_FALSE(decision.filtered);
  EXPECT_TRUE(decision.within);
  EXPECT_GT(decision.error_n, 0);
  EXPECT_EQ(decision.reason, "the only law that the stand-off fixture vein can act with");
  EXPECT_EQ(liveWith(settings, decision).standoff_clearance_m, 0.02);
  EXPECT_EQ(settings.effectiveLive().standoff_clearance_m, 0.02);
  for (const rt::LiveParameters& live : lawsThatMayAct(settings)) {
    EXPECT_EQ(live.law, rt::ForceLaw::surface);
    EXPECT_EQ(live.standoff_clearance_m, 0.02);
  }
  const Settings soft = settingsOf(
      "fixtures: [{name: nerve, kind: standoff, clearance_m: 0.02},"
      " {name: vein, kind: standoff, clearance_m: 0.015, soft_m: 0.01}]\n");
  EXPECT_EQ(soft.effectiveLive().standoff_clearance_m, 0.025) << "from where the soft layer begins";
}

TEST(Standoff, ChangesNothingWhereThereIsNone) {
  Settings settings;
  settings.live.force.max_error_n = 10;
  for (const double distance_m : {0.6, 1.0, 2.0, 3.5}) {
    const SurfaceAsSeen seen = asSeenBy({}, distance_m);
    const LawDecision with = chooseLaw(settings, seen);
    const LawDecision without = chooseLaw(10, settings.live.force.stiffness_n_per_m, seen);
    EXPECT_EQ(with.law, without.law) << distance_m;
    EXPECT_EQ(with.reason, without.reason) << distance_m;
  }
  EXPECT_EQ(settings.effectiveLive().standoff_clearance_m, 0);
}

// Frames that move, and fixtures in them, as people write them.

const std::string kSphere =
    "{name: a, kind: sphere, position_m: [0.1, 0, 0], radius_m: 0.02, frame: phantom}";

SceneAdditions read(const std::string& text) {
  const auto additions = additionsFromText(text, "f.yaml");
  if (additions) return *additions;
  ADD_FAILURE() << additions.error().front().error.text();
  return {};
}

TEST(FrameSettings, HaveDefaultsAndReadBackAsTheyAre) {
  const SceneAdditions defaults = read("frames: [{name: phantom}]");
  ASSERT_EQ(defaults.frames.size(), 1U);
  EXPECT_EQ(defaults.frames[0].on_loss, rt::OnFrameLoss::fade);
  EXPECT_EQ(defaults.frames[0].timeout_s, 0.2);
  EXPECT_TRUE(defaults.frames[0].keepalive);
  const SceneAdditions all = read(
      "frames:\n  - {name: tool, on_loss: stop, timeout_s: 0.5, keepalive: false, max_speed_m_per_s: 0.1}\n"
      "fixtures: [" +
      kSphere + "]");
  EXPECT_EQ(all.frames[0].on_loss, rt::OnFrameLoss::stop);
  EXPECT_FALSE(all.frames[0].keepalive);
  EXPECT_EQ(all.fixtures[0].frame, "phantom");
  EXPECT_EQ(read(textOf(all)), all);
}

TEST(FrameSettings, AddNothingToATextWithoutThem) {
  EXPECT_EQ(textOf(SceneAdditions{}).find("frames"), std::string::npos);
}

TEST(FrameSettings, AConfigurationMustHaveTheFramesOfItsFixtures) {
  const std::string fixtures = "fixtures: [" + kSphere + "]\n";
  const auto without = settingsFromText("force:\n" + fixtures, "f.yaml");
  ASSERT_FALSE(without);
  EXPECT_NE(without.error().front().text().find("there is no frame \"phantom\""), std::string::npos)
      << without.error().front().text();
  EXPECT_TRUE(settingsFromText("force:\nframes: [{name: phantom}]\n" + fixtures, "f.yaml"));
}

TEST(FrameSettings, BecomeRulesAndPlacesOfTheForceLoop) {
  const SceneAdditions additions = read(
      "frames: [{name: tool, on_loss: hold}, {name: phantom, timeout_s: 0.4, max_speed_m_per_s: 0.2}]\n"
      "fixtures: [" +
      kSphere +
      ", {name: b, kind: sphere, position_m: [0, 0, 0], radius_m: 0.1}, "
      "{name: c, kind: sphere, position_m: [0, 0, 0], radius_m: 0.1, frame: gone}]");
  const rt::PoseParameters camera{.position_m = {1, 2, 3}, .roll_rad = 0, .pitch_rad = 0, .yaw_rad = 1};
  auto set = std::make_unique<rt::FixtureSet>();
  toFixtureSet(additions.fixtures, {}, {camera, additions.frames, {}}, *set);
  ASSERT_EQ(set->frame_count, 2U);
  EXPECT_EQ(set->frames[0].on_loss, rt::OnFrameLoss::hold);
  EXPECT_EQ(set->frames[1].timeout_s, 0.4);
  EXPECT_EQ(set->frames[1].max_speed_m_per_s, 0.2);
  EXPECT_EQ(set->frames[1].identity, frameIdentity("phantom"));
  EXPECT_EQ(set->fixtures[0].frame, 1);
  EXPECT_EQ(set->fixtures[0].shape.position_m_in_world, (rt::Vec3{0.1, 0, 0})) << "as it is in its frame";
  EXPECT_EQ(set->fixtures[1].frame, -1);
  EXPECT_GE(set->fixtures[2].frame, static_cast<std::int32_t>(rt::kMaxFrames)) << "a frame without a place";
}

// Fixtures and regions in the form of the force loop.

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
