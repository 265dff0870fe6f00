// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/modelling/scene_builder.h"
#include "tests/unit/rt/scene/built_scene.h"
#include "tests/unit/rt/scene/made_up_frame.h"
#include "tests/unit/rt/simd_targets.h"

namespace hapticd::rt {
namespace {

using test::FramePointer;

/// An array for a scene, followed by words that must not be written.
template <typename T>
class GuardedArray {
 public:
  explicit GuardedArray(std::size_t count) : count_(count), bytes_(count * sizeof(T) + kGuardBytes) {
    std::fill(bytes_.begin() + static_cast<std::ptrdiff_t>(count * sizeof(T)), bytes_.end(), kGuard);
  }
  T* data() { return reinterpret_cast<T*>(bytes_.data()); }
  bool isIntact() const {
    return std::all_of(bytes_.begin() + static_cast<std::ptrdiff_t>(count_ * sizeof(T)), bytes_.end(),
                       [](unsigned char byte) { return byte == kGuard; });
  }

 private:
  static constexpr std::size_t kGuardBytes = 4096;
  static constexpr unsigned char kGuard = 0xA5;
  std::size_t count_;
  std::vector<unsigned char> bytes_;  // from operator new: aligned to 16 bytes, as required by GridPoint
};

/// A scene in memory of exactly the documented size, followed by guards.
struct GuardedScene {
  GuardedScene(const GridShape& shape, std::size_t capacity)
      : occupancy(shape.words()),
        touched_words(shape.summaryWords()),
        word_rank(shape.words()),
        voxel_begin(capacity + 2),
        point(capacity + kVectorPadding) {
    scene.shape = shape;
    scene.occupancy = occupancy.data();
    scene.touched_words = touched_words.data();
    scene.word_rank = word_rank.data();
    scene.voxel_begin = voxel_begin.data();
    scene.point = point.data();
  }
  bool isIntact() const {
    return occupancy.isIntact() && touched_words.isIntact() && word_rank.isIntact() &&
           voxel_begin.isIntact() && point.isIntact();
  }

  GuardedArray<std::uint64_t> occupancy, touched_words;
  GuardedArray<std::uint32_t> word_rank, voxel_begin;
  GuardedArray<GridPoint> point;
  Scene scene;
};

/// A long lens: the whole image is within 8 cm of the point 1 m ahead.
DepthModelParameters longLens() {
  DepthModelParameters parameters;
  parameters.fx_px = parameters.fy_px = 5000;
  parameters.cx_px = 319.5;
  parameters.cy_px = 239.5;
  test::spreadRawValuesOver(0.99, 1.01, parameters);
  return parameters;
}

class PointCapacity : public test::EachSimdTarget {};

TEST_P(PointCapacity, KeepsTheFirstPointsOfTheImageAndCountsTheRest) {
  const auto model = std::make_unique<DepthModel>(longLens(), PoseParameters{});
  const FramePointer frame = test::randomFrame(1, 0, 2046);
  for (std::uint32_t i = 0; i < drivers::kKinectPixels; i += 3) frame->raw[i] = drivers::kKinectNoMeasurement;
  constexpr std::uint32_t kValid = drivers::kKinectPixels - drivers::kKinectPixels / 3;
  for (const int capacity :
       {1, 2, 17, 1024, 1025, 65536, int{kValid} - 1, int{kValid}, int{drivers::kKinectPixels}}) {
    SCOPED_TRACE(capacity);
    GridParameters grid;
    grid.point_capacity = capacity;
    SceneBuilder builder(*model, grid);
    ASSERT_EQ(builder.pointCapacity(), static_cast<std::size_t>(capacity));
    GuardedScene guarded(builder.shape(), builder.pointCapacity());
    Scene& scene = guarded.scene;
    builder.build(*frame, {0, 0, -1}, 1, scene);

    const std::uint32_t kept = std::min(kValid, static_cast<std::uint32_t>(capacity));
    ASSERT_EQ(scene.points, kept);
    EXPECT_EQ(scene.points_over_capacity, kValid - kept);
    EXPECT_TRUE(guarded.isIntact());
    test::expectVoxelsToHoldTheirPoints(scene);
    std::vector<std::uint32_t> pixels(kept);
    for (std::uint32_t i = 0; i < kept; ++i) pixels[i] = scene.point[i].pixel >> PackedPixel::kRawBits;
    std::sort(pixels.begin(), pixels.end());
    std::uint32_t next = 0;
    for (std::uint32_t i = 0; next < kept; ++i) {
      if (i % 3 == 0) continue;
      ASSERT_EQ(pixels[next++],
                i / drivers::kKinectWidth << PackedPixel::kColumnBits | i % drivers::kKinectWidth);
    }
  }
}

TEST_P(PointCapacity, IsEnoughForEveryPixelInAVoxelOfItsOwn) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  GridParameters grid;
  grid.extent = ModelExtent::frame;
  grid.frame_voxel_edge_m = 0.01;
  SceneBuilder builder(*model, grid);
  GuardedScene guarded(builder.shape(), builder.pointCapacity());
  for (const FramePointer& frame :
       {test::randomFrame(2, 271, 1003), test::frameOf(1003), test::frameOf(271)}) {
    builder.build(*frame, {}, 0, guarded.scene);
    EXPECT_EQ(guarded.scene.points, drivers::kKinectPixels);
    EXPECT_TRUE(guarded.isIntact());
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(PointCapacity);

}  // namespace
}  // namespace hapticd::rt
