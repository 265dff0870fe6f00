// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/scene_source.h"

#include <gtest/gtest.h>

#include "tools/lib/truth/any_camera.h"

namespace hapticd::drivers {
namespace {

TEST(SceneSource, FollowsTheCameraOfTheFrames) {
  const rt::DepthModelParameters stereo = tools::stereoCamera(848, 480, 90, 0.05, 1e-4, 0.2, 4.0);
  SceneSource source({}, {}, {});
  rt::Scene scene;
  source.attach(scene);
  EXPECT_TRUE(source.model().rawIsDisparity());
  ASSERT_TRUE(source.follow(stereo));
  source.attach(scene);
  EXPECT_EQ(source.model().width_px(), 848);
  const auto frame = tools::frameOf(stereo, tools::tiltedPlane(stereo, 0.5, 0));
  source.builder().build(*frame, {0, 0, -0.5}, 0.05, scene);
  EXPECT_GT(scene.points, 1000U);
  rt::DepthModelParameters bad = stereo;
  bad.fx_px = -1;
  EXPECT_FALSE(source.follow(bad));
  EXPECT_EQ(source.model().width_px(), 848) << "the camera before stays";
  const rt::DepthModel* const model = &source.model();
  ASSERT_TRUE(source.follow({}));
  ASSERT_TRUE(source.follow(stereo));
  EXPECT_EQ(&source.model(), model) << "a known camera keeps its model";
}

}  // namespace
}  // namespace hapticd::drivers
