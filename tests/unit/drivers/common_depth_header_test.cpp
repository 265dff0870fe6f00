// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/common_depth_header.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "rt/depth/depth_model.h"

namespace hapticd::drivers {
namespace {

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

}  // namespace
}  // namespace hapticd::drivers
