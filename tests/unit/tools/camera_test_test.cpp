// SPDX-License-Identifier: Apache-2.0
// `hapticctl camera test` with the driver v4l2 and a camera behind the system calls.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "drivers/camera/v4l2/v4l2_camera.h"
#include "tests/support/recordings/depth_images.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/video/fake_video.h"
#include "tests/support/video/made_up_sysfs.h"
#include "tools/hapticctl/camera_test.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kFrames = 20;

/// A D435 by its own description: 0.1 mm, 90 degrees, baseline of 50 mm.
rt::DepthModelParameters camera() {
  return stereoCamera(848, 480, 90, 0.05, 1e-4, 0.2, 3);
}

test::SentFrame sent(const rt::DepthFrame& frame) {
  test::SentFrame sent{.pixels = test::pixelsOf(frame)};
  sent.bytes = sent.pixels.size() * sizeof(std::uint16_t);
  return sent;
}

class CameraTestOfV4l2 : public testing::Test {
 protected:
  void SetUp() override {
    test::addNode(folder_.path(), {});
    settings_.driver = "v4l2";
  }
  void TearDown() override {
    EXPECT_EQ(video_->descriptors(), 0);
    EXPECT_EQ(video_->mappings(), 0);
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<test::FakeVideo> video_ = std::make_shared<test::FakeVideo>();
  config::CameraSettings settings_;
};

TEST_F(CameraTestOfV4l2, MeasuresTheNoiseThatTheFramesHaveAndCountsThoseThatAreLost) {
  const DepthAt plane = tiltedPlane(camera(), 0.7, 0);
  for (std::uint32_t i = 1; i <= kFrames; ++i) {
    test::SentFrame frame = sent(*frameOf(camera(), plane, i));
    if (i == kFrames / 2) frame.lost_before = 1;
    video_->send(std::move(frame));
  }
  drivers::V4l2Camera driver(settings_, video_, folder_.path());
  // The camera behind the system calls delivers as fast as the driver returns buffers.
  const auto result = testCamera(driver, milliseconds(3000), milliseconds(60'000));
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_EQ(result->status.identity, "v4l2 012345678901");
  EXPECT_GT(result->noise.frames, kFrames / 4);  // a slow machine may not take all of them in the time
  EXPECT_EQ(result->frames, kFrames);
  EXPECT_EQ(result->lost_frames, 1U);
  EXPECT_EQ(result->model.width_px, 848);
  ASSERT_FALSE(result->noise.at_depths.empty());
  const NoiseAtDepth& at =
      *std::ranges::max_element(result->noise.at_depths, std::less(), &NoiseAtDepth::pixels);
  EXPECT_NEAR(at.depth_m, 0.7, 0.05);
  // Z^2 s / (f b) with s = 0.08 px, f = 424 px, b = 50 mm
  EXPECT_NEAR(at.temporal_m, 0.7 * 0.7 * 0.08 / (424 * 0.05), 0.1 * 0.7 * 0.7 * 0.08 / (424 * 0.05));
  const std::string text = textOf(*result);
  EXPECT_NE(text.find("camera       v4l2 012345678901, Z16 848 x 480 at 30 Hz\nframes       20, "),
            std::string::npos)
      << text;
  EXPECT_NE(text.find(" per second, 1 lost, 0 damaged\n"), std::string::npos) << text;
  EXPECT_NE(text.find("\ncamera:\n  noise_c0_m: 0.0"), std::string::npos) << text;
  const nlohmann::json shown = nlohmann::json::parse(jsonOf(*result));
  EXPECT_EQ(shown["lostFrames"], 1);
  EXPECT_EQ(shown["measuredFrames"], result->noise.frames);
  // s / (f b)
  EXPECT_NEAR(shown["noise"]["c2PerM"], 0.08 / (424 * 0.05), 0.1 * 0.08 / (424 * 0.05));
}

TEST_F(CameraTestOfV4l2, SaysThatTooFewFramesShowNoNoise) {
  video_->send(sent(*frameOf(camera(), tiltedPlane(camera(), 0.7, 0), 1)));
  drivers::V4l2Camera driver(settings_, video_, folder_.path());
  const auto result = testCamera(driver, milliseconds(0), milliseconds(60'000));
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_NE(textOf(*result).find("noise        not measured"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(jsonOf(*result))["noise"].is_null());
}

TEST_F(CameraTestOfV4l2, SaysWhyACameraInUseDeliversNothing) {
  video_->change([](auto& it) { it.in_use = true; });
  drivers::V4l2Camera driver(settings_, video_, folder_.path());
  // longer than a test may take: it does not wait on once the reason is known
  const auto result = testCamera(driver, milliseconds(0), std::chrono::hours(1));
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().what.find("another program"), std::string::npos) << result.error().what;
  EXPECT_NE(result.error().what.find("fuser -v"), std::string::npos)
      << result.error().what;  // finds hapticd too
  EXPECT_EQ(result.error().remedy, "");
}

TEST_F(CameraTestOfV4l2, SaysThatACameraSendsNoFrames) {
  drivers::V4l2Camera driver(settings_, video_, folder_.path());
  const auto result = testCamera(driver, milliseconds(0), milliseconds(500));
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().what.find("delivers no frames"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools
