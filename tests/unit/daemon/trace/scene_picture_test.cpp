// SPDX-License-Identifier: Apache-2.0
// What viewers draw of a box. That the messages mean this, decoders of others show: tests/ros,
// tests/foxglove.
#include "daemon/trace/ros/scene_picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

namespace hapticd::trace::ros {
namespace {

rt::Tick tickInContact() {
  rt::Tick tick;
  tick.law = rt::ForceLaw::surface;
  tick.hip_m_in_world = {0.1, 0.2, 0.3};
  tick.proxy_m_in_world = {0.1, 0.2, 0.35};
  tick.command_force_n_in_world = {0, 0, 2};
  return tick;
}

/// The markers by name and id, all of them.
std::map<std::string, Marker> sceneOf(const rt::Tick& tick) {
  SceneRadii radii;
  radii.set("force.radius_m", "0.0625");
  radii.set("contact.proxy_radius_m", "0.03125");
  radii.set("force.stiffness_n_per_m", "0.5");  // none of the radii
  std::map<std::string, Marker> markers;
  for (const Marker& marker : sceneMarkers(tick, radii, {{1, 2, 3}, 0.5}))
    markers[marker.name + std::to_string(marker.id)] = marker;
  EXPECT_EQ(markers.size(), 5U) << "each must replace the earlier one";
  return markers;
}

bool isShown(const Marker& marker) {
  return marker.action == Marker::Action::show;
}

void expectBall(const Marker& ball, const rt::Vec3& centre_m, double radius_m) {
  EXPECT_TRUE(isShown(ball)) << ball.name;
  EXPECT_EQ(ball.kind, Marker::Kind::sphere) << ball.name;
  EXPECT_EQ(ball.T_frame_marker, (rt::RigidPose{centre_m, {}})) << ball.name;
  EXPECT_EQ(ball.scale_m, (rt::Vec3{2 * radius_m, 2 * radius_m, 2 * radius_m})) << ball.name;
}

TEST(ScenePicture, ShowsTheSpheresOfTheLawAtTheirRadii) {
  auto with_proxy = sceneOf(tickInContact());
  expectBall(with_proxy["hip0"], {0.1, 0.2, 0.3}, 0.03125);
  expectBall(with_proxy["proxy0"], {0.1, 0.2, 0.35}, 0.03125);
  expectBall(with_proxy["reach0"], {1, 2, 3}, 0.5);
  rt::Tick springs = tickInContact();
  springs.law = rt::ForceLaw::nearest_springs;
  auto without_proxy = sceneOf(springs);
  expectBall(without_proxy["hip0"], {0.1, 0.2, 0.3}, 0.0625);
  EXPECT_FALSE(isShown(without_proxy["proxy0"]));
}

TEST(ScenePicture, ShowsTheForceAsAnArrowFromTheHandWithItsNumber) {
  auto scene = sceneOf(tickInContact());
  const Marker& arrow = scene["force0"];
  EXPECT_EQ(arrow.kind, Marker::Kind::arrow);
  ASSERT_EQ(arrow.points_m.size(), 2U);
  EXPECT_EQ(arrow.points_m[0], (rt::Vec3{0.1, 0.2, 0.3}));
  EXPECT_NEAR(rt::norm(arrow.points_m[1] - arrow.points_m[0] - rt::Vec3{0, 0, 2 * 0.04}), 0, 1e-15);
  EXPECT_LT(arrow.scale_m.x, arrow.scale_m.y) << "the head is wider than the shaft";
  EXPECT_LE(arrow.scale_m.z, 2 * 0.04) << "the head is no longer than the arrow";
  EXPECT_EQ(scene["force1"].kind, Marker::Kind::text);
  EXPECT_EQ(scene["force1"].text, "2.00 N");
  EXPECT_EQ(scene["force1"].T_frame_marker.position_m_in_world, arrow.points_m[1]);
  rt::Tick faint = tickInContact();
  faint.command_force_n_in_world = {0.02, 0, 0};
  EXPECT_LE(sceneOf(faint)["force0"].scale_m.z, 0.02 * 0.04);
}

TEST(ScenePicture, ShowsNoArrowWithoutForceAndNothingThatIsNotFinite) {
  rt::Tick without = tickInContact();
  without.command_force_n_in_world = {};
  auto scene = sceneOf(without);
  EXPECT_FALSE(isShown(scene["force0"]) || isShown(scene["force1"]));
  EXPECT_TRUE(isShown(scene["hip0"]));
  rt::Tick broken = tickInContact();
  broken.hip_m_in_world.y = broken.proxy_m_in_world.x = std::nan("");
  for (const auto& [name, marker] : sceneOf(broken)) EXPECT_EQ(isShown(marker), name == "reach0") << name;
  broken = tickInContact();
  broken.command_force_n_in_world.x = HUGE_VAL;
  EXPECT_FALSE(isShown(sceneOf(broken)["force0"]));
}

TEST(ScenePicture, HasTheOpticalFrameHalfATurnFromTheCameras) {
  const auto frames = cameraFrames("left/", {{1, 2, 3}, {0, 0, 1, 0}});
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0], (FixedFrame{"left/world", "left/camera", {{1, 2, 3}, {0, 0, 1, 0}}}));
  EXPECT_EQ(frames[1].parent + " " + frames[1].name, "left/camera left/camera_optical");
  // down is -y of the camera, forward -z
  const rt::Quaternion& turn = frames[1].T_parent_frame.orientation;
  EXPECT_EQ(rt::rotated(turn, {1, 0, 0}), (rt::Vec3{1, 0, 0}));
  EXPECT_EQ(rt::rotated(turn, {0, 1, 0}), (rt::Vec3{0, -1, 0}));
  EXPECT_EQ(rt::rotated(turn, {0, 0, 1}), (rt::Vec3{0, 0, -1}));
}

}  // namespace
}  // namespace hapticd::trace::ros
