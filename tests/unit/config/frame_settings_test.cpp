// SPDX-License-Identifier: Apache-2.0
// Frames that move, and fixtures in them, as people write them.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "config/settings/fixture_settings.h"
#include "config/yaml_loader.h"

namespace hapticd::config {
namespace {

const std::string kSphere =
    "{name: a, kind: sphere, position_m: [0.1, 0, 0], radius_m: 0.02, frame: phantom}";

SceneAdditions read(const std::string& text) {
  const auto additions = additionsFromText(text, "f.yaml");
  if (additions) return *additions;
  ADD_FAILURE() << additions.error().front().error.text();
  return {};
}
std::string refusal(const std::string& text) {
  const auto additions = additionsFromText(text, "f.yaml");
  return additions ? "" : additions.error().front().error.text();
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

TEST(FrameSettings, AreRefusedByName) {
  const auto expect = [](const std::string& list, const std::string& part) {
    const std::string text = refusal("frames: [" + list + "]");
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect("{name: world}", "frame world: name: world is the name of a frame that rests");
  expect("{name: camera}", "camera is the name of a frame that rests");
  expect("{name: a b}", "is not a valid name");
  expect("{on_loss: hold}", "is missing");
  expect("{name: a}, {name: a}", "an earlier frame has the same name");
  expect("{name: a, on_loss: freeze}", "one of: hold, fade, stop");
  expect("{name: a, timeout_s: 0.01}", "0.05..10 s");
  expect("{name: a, timeout_s: .nan}", "frame a: timeout_s");
  expect("{name: a, max_speed_m_per_s: 0.6}", "0.01..0.5 m/s");
  expect("{name: a, keepalive: 1}", "is not a truth value");
  std::string nine;
  for (char c = 'a'; c <= 'i'; ++c) nine += std::string("{name: ") + c + "},";
  expect(nine, "9 frames, and 8 are possible");
}

TEST(FrameSettings, GuidanceAndTissueCannotMove) {
  EXPECT_NE(refusal("fixtures: [{name: a, kind: point, position_m: [0, 0, 0], frame: phantom}]")
                .find("phantom moves, and guidance along a point cannot move"),
            std::string::npos);
  EXPECT_NE(refusal("fixtures: [{name: a, kind: path, points_m: [[0, 0, 0], [1, 0, 0]], frame: phantom}]")
                .find("set frame to world or camera"),
            std::string::npos);
  EXPECT_NE(
      refusal("regions: [{name: a, shape: sphere, position_m: [0, 0, 0], radius_m: 0.1, frame: phantom}]")
          .find("one of: world, camera"),
      std::string::npos);
  EXPECT_NE(refusal("fixtures: [{name: a, kind: standoff, clearance_m: 0.01, frame: phantom}]")
                .find("is not a member of a fixture of kind standoff"),
            std::string::npos);
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

}  // namespace
}  // namespace hapticd::config
