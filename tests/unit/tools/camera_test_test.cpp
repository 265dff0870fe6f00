// SPDX-License-Identifier: Apache-2.0
// `hapticctl camera test` with a camera that a test makes.
#include "tools/hapticctl/camera_test.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

using std::chrono::milliseconds;

/// Delivers frames of a plane, 30 in a second, within start(); it loses one.
class MadeUpCamera final : public drivers::Camera {
 public:
  explicit MadeUpCamera(std::uint32_t frames) : frames_(frames) {}

  config::Result<void> start(drivers::FrameSink& sink) override {
    const rt::DepthModelParameters model = tools::stereoCamera(160, 100, 90, 0.05, 1e-4, 0.2, 3);
    for (std::uint32_t i = 0; i < frames_; ++i) {
      sink.back() = *tools::frameOf(model, tools::tiltedPlane(model, 0.7, 0), i + 1);
      sink.back().arrival_ns = i * 1'000'000'000LL / 30;
      sink.back().device_ticks = i < 5 ? i : i + 1;
      sink.publish();
    }
    return {};
  }
  void stop() override { stopped_ = true; }
  drivers::CameraStatus status() const override {
    drivers::CameraStatus status;
    status.identity = "v4l2 123";
    if (frames_ == 0) {
      status.detail =
          looks_++ == 0 ? "looking for the camera" : "v4l2: another program uses the camera (end it)";
    }
    status.details.format = "Z16";
    status.details.rate_hz = 30;
    return status;
  }
  bool stopped() const { return stopped_; }

 private:
  std::uint32_t frames_;
  bool stopped_ = false;
  mutable int looks_ = 0;  ///< calls of status()
};

TEST(CameraTest, MeasuresRateLossAndNoise) {
  MadeUpCamera camera(20);
  const auto result = testCamera(camera, milliseconds(0), milliseconds(1000));
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_TRUE(camera.stopped());
  EXPECT_NEAR(result->rate_hz, 30, 1e-6);
  EXPECT_EQ(result->lost_frames, 1U);
  EXPECT_EQ(result->frames, 20U);
  EXPECT_EQ(result->noise.frames, 20U);
  // s / (f b) with s = 0.08 px, f = 80 px, b = 50 mm
  const nlohmann::json shown = nlohmann::json::parse(jsonOf(*result));
  EXPECT_NEAR(shown["noise"]["c2PerM"], 0.02, 0.002);
  EXPECT_EQ(shown["lostFrames"], 1);
}

TEST(CameraTest, PrintsLinesForTheConfiguration) {
  MadeUpCamera camera(20);
  const auto result = testCamera(camera, milliseconds(0), milliseconds(1000));
  ASSERT_TRUE(result);
  const std::string text = textOf(*result);
  EXPECT_NE(text.find("camera       v4l2 123, Z16 160 x 100 at 30 Hz\n"
                      "frames       20, 30.00 per second, 1 lost, 0 damaged\n"
                      "holes        0.0 % of the pixels\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("\ncamera:\n  noise_c0_m: 0.000000\n  noise_c1: 0.000000\n  noise_c2_per_m: 0.0"),
            std::string::npos)
      << text;
}

TEST(CameraTest, CountsFramesThatItHasNoTimeToMeasure) {
  MadeUpCamera camera(300);
  const auto result = testCamera(camera, milliseconds(0), milliseconds(1000));
  ASSERT_TRUE(result);
  EXPECT_EQ(result->frames, 300U);
  EXPECT_EQ(result->lost_frames, 1U);
  EXPECT_GE(result->noise.frames, 20U);
  EXPECT_LE(result->noise.frames, 300U);
  EXPECT_EQ(nlohmann::json::parse(jsonOf(*result))["measuredFrames"], result->noise.frames);
}

TEST(CameraTest, SaysThatTooFewFramesShowNoNoise) {
  MadeUpCamera camera(2);
  const auto result = testCamera(camera, milliseconds(0), milliseconds(1000));
  ASSERT_TRUE(result);
  EXPECT_NE(textOf(*result).find("noise        not measured"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(jsonOf(*result))["noise"].is_null());
}

TEST(CameraTest, ShowsTheReasonOfACameraThatDeliversNothing) {
  MadeUpCamera camera(0);
  const auto result = testCamera(camera, milliseconds(0), std::chrono::hours(1));
  ASSERT_FALSE(result);
  EXPECT_TRUE(camera.stopped());
  EXPECT_EQ(result.error().what,
            "the camera delivers no frames: v4l2: another program uses the camera (end it)");
  EXPECT_NE(result.error().remedy.find("hapticd"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools
