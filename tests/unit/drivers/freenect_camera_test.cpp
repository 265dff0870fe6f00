// SPDX-License-Identifier: Apache-2.0
// The driver `freenect` with the real libfreenect, without a camera.

#include "drivers/camera/freenect/freenect_camera.h"

#include <gtest/gtest.h>

#include "frame_collector.h"

namespace hapticd::drivers {
namespace {

TEST(FreenectCamera, IsAbsentAndSuggestsARemedyWhereNoCameraIsConnected) {
  test::FrameCollector frames;
  FreenectCamera camera("no-camera-has-this-serial-number");
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(test::eventually([&] { return camera.status().detail.find('(') != std::string::npos; }));
  const CameraStatus status = camera.status();
  EXPECT_EQ(status.state, CameraState::absent);
  EXPECT_EQ(status.identity, "freenect no-camera-has-this-serial-number");
  EXPECT_TRUE(status.detail.starts_with("libfreenect: ")) << status.detail;
  camera.stop();
  EXPECT_EQ(frames.count(), 0U);
}

TEST(FreenectCamera, StopsAndStartsAgainWithoutACamera) {
  test::FrameCollector frames;
  FreenectCamera camera("no-camera-has-this-serial-number");
  camera.stop();
  ASSERT_TRUE(camera.start(frames));
  EXPECT_FALSE(camera.start(frames)) << "it is running";
  camera.stop();
  camera.stop();
  ASSERT_TRUE(camera.start(frames));
}

}  // namespace
}  // namespace hapticd::drivers
