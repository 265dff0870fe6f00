// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/synthetic_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "drivers/make_devices.h"
#include "frame_collector.h"

namespace hapticd::drivers {
namespace {

TEST(SyntheticCamera, FilmsTheSceneAtTheTimeOfItsTicks) {
  config::SyntheticSettings settings;
  settings.frame_rate_hz = 20;
  test::FrameCollector frames;
  SyntheticCamera camera(settings, {});
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(4));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  camera.stop();

  AnalyticScene scene(settings, {});
  const auto expected = std::make_unique<rt::DepthFrame>();
  for (std::size_t index = 0; index < 4; ++index) {
    const rt::DepthFrame& frame = frames.frame(index);
    EXPECT_EQ(frame.sequence, index + 1);
    EXPECT_EQ(frame.device_ticks % 3'000'000, 0U) << "whole periods of 1/20 s at 60 MHz";
    scene.render(frame.device_ticks / 60e6, *expected);
    EXPECT_TRUE(std::ranges::equal(frame.image(), expected->image())) << index;
  }
}

TEST(SyntheticCamera, DoesNotStartWithoutAFrameRate) {
  config::SyntheticSettings settings;
  settings.frame_rate_hz = 0;
  test::FrameCollector frames;
  SyntheticCamera camera(settings, {});
  EXPECT_FALSE(camera.start(frames));
}

TEST(MakeCamera, MakesTheDriverThatTheSettingsName) {
  config::CameraSettings settings;
  config::SyntheticSettings synthetic;
  settings.driver = config::CameraDriver::synthetic;
  EXPECT_NE(dynamic_cast<SyntheticCamera*>(makeCamera(settings, synthetic).get()), nullptr);
  settings.driver = config::CameraDriver::freenect;
  EXPECT_EQ(makeCamera(settings, synthetic)->status().identity, "freenect");
  settings.driver = config::CameraDriver::recorded;
  settings.recording = "/nowhere";
  test::FrameCollector frames;
  const auto started = makeCamera(settings, synthetic)->start(frames);
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().text().find("/nowhere"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::drivers
