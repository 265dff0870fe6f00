// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>

#include "tests/unit/rt/scene/built_scene.h"
#include "tests/unit/rt/scene/made_up_frame.h"
#include "tests/unit/rt/simd_targets.h"
#include "tools/lib/oracle/reference_camera.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;
using test::wholeFrameGrid;
using tools::PointCloud;
using tools::ReferenceCamera;

struct Setting {
  const char* name;
  DepthModelParameters model;
  PoseParameters pose;
};

Setting farAndWide() {
  Setting setting{"far and wide", {}, {{10, -10, 10}, 1, 2, 3}};
  setting.model.fx_px = setting.model.fy_px = 300;
  setting.model.far_m = 10;
  return setting;
}

const Setting kSettings[] = {
    {"identity", {}, {}},
    {"turned", {}, {{0.3, -1.2, 2.5}, 0.3, -1.1, 2.4}},
    {"turned otherwise", {}, {{-5, 4, -3}, -2.0, 0.7, -0.4}},
    farAndWide(),
};

/// Returns the largest distance between the grid's positions and those of eq. (1)-(2).
double largestError_m(const Scene& scene, const ReferenceCamera& camera) {
  double largest = 0;
  for (std::uint32_t i = 0; i < scene.points; ++i) {
    const GridPoint& p = scene.point[i];
    const Vec3 exact = camera.pointInWorld(PackedPixel::column(p.pixel), PackedPixel::row(p.pixel),
                                           PackedPixel::raw(p.pixel));
    largest = std::max(largest, norm(scene.origin_m_in_world + Vec3{p.x_m, p.y_m, p.z_m} - exact));
  }
  return largest;
}

class SinglePrecision : public test::EachSimdTarget {};

TEST_P(SinglePrecision, ErrsLessThanItsBoundWhereTheWholeFrameIsModelled) {
  for (const Setting& setting : kSettings) {
    SCOPED_TRACE(setting.name);
    const ReferenceCamera camera(setting.model, setting.pose);
    const auto model = std::make_unique<DepthModel>(setting.model, setting.pose);
    BuiltScene built(*model, wholeFrameGrid());
    const double largest = std::max(largestError_m(built.build(*test::randomFrame(1, 271, 1060)), camera),
                                    largestError_m(built.build(*test::frameOf(1003)), camera));
    EXPECT_LE(largest, model->singlePrecisionError_m());
    // A bound far above the true error would cost speed: every point closer than it to a limit is evaluated
    // twice.
    EXPECT_GE(largest, model->singlePrecisionError_m() / 50);
  }
}

TEST_P(SinglePrecision, ErrsLessThanItsBoundWhereOnlyTheReachIsModelled) {
  for (const Setting& setting : kSettings) {
    SCOPED_TRACE(setting.name);
    const ReferenceCamera camera(setting.model, setting.pose);
    const auto model = std::make_unique<DepthModel>(setting.model, setting.pose);
    BuiltScene built(*model, GridParameters{});
    const test::FramePointer frame = test::randomFrame(3, 271, 1060);
    std::uint32_t points = 0;
    for (std::uint32_t i = 0; i < 60; ++i) {
      const std::uint32_t raw = 271 + i * 12;
      const Vec3 centre = camera.pointInWorld(i * 37 % 640, i * 59 % 480, raw);
      const Scene& scene = built.build(*frame, centre);
      points += scene.points;
      ASSERT_LE(largestError_m(scene, camera), model->singlePrecisionError_m());
    }
    EXPECT_GT(points, 10000U);
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(SinglePrecision);

}  // namespace
}  // namespace hapticd::rt
