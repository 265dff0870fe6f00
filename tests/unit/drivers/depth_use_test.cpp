// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>

#include "drivers/camera/common_depth_header.h"
#include "drivers/camera/depth_use.h"
#include "drivers/camera/scene_source.h"
#include "rt/depth/depth_model.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::drivers {
namespace {

using Frame = std::unique_ptr<rt::DepthFrame>;

DepthUse useOf(const rt::DepthFrame& frame) {
  return DepthUse::of(frame, rt::DepthModel(frame.camera, {}));
}

void swapBytes(rt::DepthFrame& frame) {
  for (std::uint16_t& raw : frame.image()) {
    if (raw != frame.camera.raw_no_measurement) raw = static_cast<std::uint16_t>(raw << 8 | raw >> 8);
  }
}

/// Independent of the vectorised count.
std::size_t usablePixelsOf(const rt::DepthFrame& frame) {
  const rt::DepthModel model(frame.camera, {});
  std::size_t count = 0;
  for (int row = 0; row < model.height_px(); ++row) {
    for (int column = 0; column < model.width_px(); ++column) {
      const int at = row * model.stride_px() + column;
      const std::uint16_t raw = frame.raw[at];
      count += raw != frame.camera.raw_no_measurement && model.depth_m(raw) > 0;
    }
  }
  return count;
}

TEST(DepthUse, CountsThePixelsWithADepth) {
  std::mt19937 random(1);
  for (rt::DepthModelParameters camera :
       {tools::kinectWithNoise(), tools::stereoCamera(424, 240, 69, 0.05, 0.001, 0.3, 4),
        tools::stereoCamera(200, 100, 69, 0.05, 0.0001, 0.07, 0.5), tools::timeOfFlightCamera(640, 576)}) {
    const Frame frame = tools::frameOf(camera, tools::tiltedPlane(camera, 0.5, 0.8), 3);
    for (int i = 0; i < 5000; ++i) {
      const std::size_t row = random() % static_cast<unsigned>(camera.height_px),
                        column = random() % static_cast<unsigned>(camera.width_px);
      frame->raw[row * static_cast<std::size_t>(rt::strideOf(camera.width_px)) + column] =
          static_cast<std::uint16_t>(random() % camera.raw_values);
    }
    EXPECT_EQ(useOf(*frame).usable, usablePixelsOf(*frame));
  }
}

/// Scenes at random distances, near and beyond the limits, with and without noise; depth units of all kinds.
TEST(DepthUse, TellsSwappedBytesFromDepthThatIsOnlyTooFarOrTooNear) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> distance_m(0.2, 8), tilt_rad(-1.2, 1.2);
  int in_range = 0;
  for (unsigned i = 0; i < 240; ++i) {
    const double unit_m = i % 3 == 0 ? 0.001 : i % 3 == 1 ? 0.00025 : 0.0002;
    const auto camera = tools::stereoCamera(424, 240, 69, 0.05, unit_m, 0.3, i % 2 == 0 ? 1.5 : 4);
    const double z_m = distance_m(random);
    const Frame frame =
        i % 4 == 0 ? tools::frameOf(camera, tools::ball(camera, {0, 0, -z_m}, z_m / 3), i % 7)
                   : tools::frameOf(camera, tools::tiltedPlane(camera, z_m, tilt_rad(random)), i % 7);
    const DepthUse right = useOf(*frame);
    EXPECT_FALSE(right.looks_swapped) << i << ": " << z_m << " m";
    // of a scene out of range nobody knows, and too few pixels say nothing
    if (right.usable < right.measured * 9 / 10 || right.measured < 5000) continue;
    ++in_range;
    swapBytes(*frame);
    const DepthUse swapped = useOf(*frame);
    EXPECT_TRUE(swapped.looks_swapped) << i << ": " << z_m << " m, unit " << unit_m;
    EXPECT_EQ(swapped.if_swapped, right.usable);
  }
  EXPECT_GT(in_range, 20);
}

TEST(DepthUse, FindsSwappedBytesOfAnImageWhoseRowsHaveNoSteps) {
  const auto camera = tools::stereoCamera(424, 240, 69, 0.05, 0.001, 0.3, 4);
  for (const double tilt_rad : {-0.5, -0.3, 0.0, 0.1, 0.3, 0.5}) {  // 0: 1000 everywhere
    const Frame frame = tools::frameOf(camera, tools::tiltedPlane(camera, 1, tilt_rad));
    EXPECT_FALSE(useOf(*frame).looks_swapped) << tilt_rad;
    swapBytes(*frame);
    EXPECT_TRUE(useOf(*frame).looks_swapped) << tilt_rad;
  }
}

TEST(DepthUse, NoiseIsNotTakenForSwappedBytes) {
  std::mt19937 random(3);
  const auto camera = tools::stereoCamera(424, 240, 69, 0.05, 0.001, 0.3, 4);
  const Frame frame = tools::frameOf(camera, tools::tiltedPlane(camera, 1, 0));
  for (std::uint16_t& raw : frame->image()) raw = static_cast<std::uint16_t>(random());
  EXPECT_FALSE(useOf(*frame).looks_swapped);
  for (std::uint16_t& raw : frame->image()) raw = camera.raw_no_measurement;
  EXPECT_FALSE(useOf(*frame).looks_swapped);
  EXPECT_EQ(useOf(*frame).measured, 0U);
}

TEST(DepthUseWatch, SaysAfterTenFramesThatNoneHasAUsablePixel) {
  DepthUseWatch watch;
  EXPECT_EQ(watch.newest(), "");
  EXPECT_EQ(watch.all(), "");
  for (std::uint64_t frame = 1; frame <= 9; ++frame) {
    watch.add({.frame = frame, .measured = 100});
    EXPECT_EQ(watch.newest(), "");
  }
  watch.add({.frame = 10, .measured = 100});
  EXPECT_NE(watch.newest().find("no pixel of 10 frames lies between camera.near_m and camera.far_m"),
            std::string::npos)
      << watch.newest();
  EXPECT_NE(watch.all(), "");
  watch.add({.frame = 11, .measured = 100, .usable = 1});
  EXPECT_EQ(watch.newest(), "") << "it has passed";
  EXPECT_EQ(watch.all(), "");
  for (std::uint64_t frame = 12; frame <= 21; ++frame) watch.add({.frame = frame});
  EXPECT_NE(watch.newest().find("nothing was measured in 10 frames"), std::string::npos) << watch.newest();
}

TEST(DepthUseWatch, NamesAFrameWithSwappedBytes) {
  DepthUseWatch watch;
  watch.add({.frame = 1, .measured = 100, .usable = 100});
  watch.add({.frame = 2, .measured = 100, .usable = 7, .looks_swapped = true, .if_swapped = 99});
  EXPECT_NE(watch.newest().find("frame 2 seem to be swapped: 7 % of what it measured"), std::string::npos)
      << watch.newest();
  watch.add({.frame = 3, .measured = 100, .usable = 100});
  EXPECT_EQ(watch.newest(), "");
  EXPECT_NE(watch.all().find("frame 2 seem"), std::string::npos) << watch.all();
}

config::CameraSettings tiltedCamera() {
  config::CameraSettings camera;
  camera.depth_law = config::DepthLaw::factory;
  camera.setPose({{0.3, -0.2, 1.1}, 0.4, -0.7, 1.9});
  return camera;
}

/// Computes a point from the header alone, as described in the schema of /hapticd/depth.
rt::Vec3 pointBySchema(const rt::DepthFrameHeader& header, double column, double row, double raw) {
  const auto& c = header.depth_law_coefficients;
  const double depth = 1 / (c[0] * raw + c[1]);
  const double camera[3] = {depth * (column - header.cx_px) / header.fx_px,
                            -depth * (row - header.cy_px) / header.fy_px, -depth};
  double world[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    world[axis] = header.position_m_in_world[axis];
    for (std::size_t i = 0; i < 3; ++i) {
      world[axis] += header.rotation_world_camera[3 * axis + i] * camera[i];
    }
  }
  return {world[0], world[1], world[2]};
}

TEST(CommonDepthHeader, ContainsEverythingNeededToConvertARawValueToAPoint) {
  const config::CameraSettings camera = tiltedCamera();
  const rt::DepthFrameHeader header = commonDepthHeader(camera, "");
  const rt::DepthModel model(camera.effectiveDepthModel(), camera.pose());
  for (const std::uint32_t raw : {500U, 700U, 900U}) {
    for (const std::uint32_t column : {0U, 320U, 639U}) {
      for (const std::uint32_t row : {0U, 200U, 479U}) {
        const rt::Vec3 expected = model.pointInWorld(rt::PackedPixel::pack(column, row, raw));
        const rt::Vec3 point = pointBySchema(header, column, row, raw);
        EXPECT_LT(rt::norm(point - expected), 1e-12) << column << " " << row << " " << raw;  // rounding
      }
    }
  }
}

TEST(CommonDepthHeader, NamesTheCameraThatIsConfiguredOrElseFound) {
  const auto serialOf = [](const config::CameraSettings& camera, const char* identity) {
    const auto serial = commonDepthHeader(camera, identity).serial;
    return std::string(serial.begin(), std::ranges::find(serial, 0));
  };
  config::CameraSettings camera;
  EXPECT_EQ(serialOf(camera, "freenect"), "");
  EXPECT_EQ(serialOf(camera, "recorded /var/desk"), "");
  EXPECT_EQ(serialOf(camera, "freenect A00362907000042A"), "A00362907000042A");
  camera.serial = "B1";
  EXPECT_EQ(serialOf(camera, "freenect A00362907000042A"), "B1");
  camera.serial = std::string(100, 'x');
  EXPECT_EQ(serialOf(camera, ""), std::string(31, 'x')) << "it ends with a zero";
}

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
