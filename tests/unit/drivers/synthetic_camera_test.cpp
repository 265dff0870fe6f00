// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/synthetic_camera.h"
#include "drivers/camera/synthetic/analytic_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "drivers/driver_table.h"
#include "frame_collector.h"

namespace hapticd::drivers {
namespace {

TEST(SyntheticCamera, FilmsTheSceneAtTheTimeOfItsTicks) {
  SyntheticSettings settings;
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
  SyntheticSettings settings;
  settings.frame_rate_hz = 0;
  test::FrameCollector frames;
  SyntheticCamera camera(settings, {});
  EXPECT_FALSE(camera.start(frames));
}

TEST(MakeCamera, MakesTheDriverThatTheSettingsName) {
  config::CameraSettings settings;
  settings.driver = "synthetic";
  EXPECT_NE(dynamic_cast<SyntheticCamera*>(makeCamera(settings).get()), nullptr);
  settings.driver = "freenect";
  EXPECT_EQ(makeCamera(settings)->status().identity, "freenect");
  settings.driver = "recorded";
  settings.of<RecordedSettings>().recording = "/nowhere";
  test::FrameCollector frames;
  const auto started = makeCamera(settings)->start(frames);
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().text().find("/nowhere"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::drivers
