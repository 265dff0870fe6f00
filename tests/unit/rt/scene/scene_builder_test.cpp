// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "rt/modelling/scene_builder.h"
#include "tests/unit/rt/scene/made_up_scene.h"
#include "tests/unit/rt/simd_targets.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;
using test::FramePointer;
using test::wholeFrameGrid;
using tools::PointCloud;
using tools::ReferenceCamera;

struct NamedFrame {
  const char* name;
  FramePointer frame;
};

std::vector<NamedFrame> allKindsOfFrames() {
  std::vector<NamedFrame> frames;
  frames.push_back({"plane and sphere", test::planeAndSphereFrame(1, {})});
  frames.push_back({"random 16-bit words", test::damagedFrame(2)});
  frames.push_back({"random raw values", test::randomFrame(3, 0, 2047)});
  frames.push_back({"no measurement", test::frameOf(drivers::kKinectNoMeasurement)});
  frames.push_back({"largest word", test::frameOf(0xFFFF)});
  frames.push_back({"zero", test::frameOf(0)});
  frames.push_back({"one value", test::frameOf(760)});
  frames.push_back({"chess board of two depths", test::checkerboardFrame(760, 800)});
  frames.push_back({"chess board with holes", test::checkerboardFrame(760, drivers::kKinectNoMeasurement)});
  return frames;
}

const PoseParameters kPoses[] = {
    {},
    {{0.3, -1.2, 2.5}, 0.3, -1.1, 2.4},
    {{-5, 4, -3}, -2.0, 0.7, -0.4},
};

class SceneOfFrame : public test::EachSimdTarget {};

TEST_P(SceneOfFrame, HoldsEveryValidPixelWhereTheWholeFrameIsModelled) {
  const std::vector<NamedFrame> frames = allKindsOfFrames();
  for (std::size_t pose = 0; pose < 2; ++pose) {
    const DepthModelParameters parameters;
    const ReferenceCamera camera(parameters, kPoses[pose]);
    const auto model = std::make_unique<DepthModel>(parameters, kPoses[pose]);
    BuiltScene built(*model, wholeFrameGrid());
    for (std::size_t i = pose; i < frames.size(); i += 2) {
      SCOPED_TRACE(frames[i].name);
      const Scene& scene = built.build(*frames[i].frame);
      const PointCloud cloud = camera.pointsOf(frames[i].frame->image());
      EXPECT_EQ(scene.points, cloud.points_m.size());
      EXPECT_EQ(scene.points_over_capacity, 0U);
      test::expectAllPointsOfTheBall(scene, cloud);
      test::expectVoxelsToHoldTheirPoints(scene);
      if (HasFatalFailure()) return;
    }
  }
}

TEST_P(SceneOfFrame, HoldsEveryPointOfTheBallWhereOnlyTheReachIsModelled) {
  const std::vector<NamedFrame> frames = allKindsOfFrames();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> shift(-0.1, 0.1);
  for (const PoseParameters& pose : kPoses) {
    const DepthModelParameters parameters;
    const ReferenceCamera camera(parameters, pose);
    const auto model = std::make_unique<DepthModel>(parameters, pose);
    GridParameters grid;
    grid.point_capacity = drivers::kKinectPixels;
    BuiltScene built(*model, grid);
    for (const NamedFrame& f : frames) {
      const PointCloud cloud = camera.pointsOf(f.frame->image());
      for (int i = 0; i < 3; ++i) {
        SCOPED_TRACE(f.name);
        Vec3 centre = camera.toWorld({0.2, 0.1, -1});
        if (cloud.points_m.size() != 0 && i != 0) {
          centre = cloud.points_m[random() % cloud.points_m.size()] +
                   Vec3{shift(random), shift(random), shift(random)};
        }
        test::expectAllPointsOfTheBall(built.build(*f.frame, centre, i == 2 ? 0.05 : 1), cloud);
        test::expectVoxelsToHoldTheirPoints(built.scene);
        if (HasFatalFailure()) return;
      }
    }
  }
}

TEST_P(SceneOfFrame, IsTheSameForEveryShapeOfWindowThatHoldsTheBall) {
  const DepthModelParameters parameters;
  const ReferenceCamera camera(parameters);
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  const FramePointer frame = test::planeAndSphereFrame(5, parameters);
  const PointCloud cloud = camera.pointsOf(frame->image());
  const Vec3 centre = cloud.points_m[cloud.points_m.size() / 2];
  for (const int cells : {8, 31, 32, 33, 64}) {
    for (const double edge : {0.005, 0.0131, 0.04}) {
      SCOPED_TRACE(cells);
      GridParameters grid;
      grid.cells_per_axis = cells;
      grid.voxel_edge_m = edge;
      grid.point_capacity = drivers::kKinectPixels;
      BuiltScene built(*model, grid);
      test::expectAllPointsOfTheBall(built.build(*frame, centre), cloud);
      test::expectVoxelsToHoldTheirPoints(built.scene);
      if (HasFatalFailure()) return;
    }
  }
}

TEST_P(SceneOfFrame, HoldsThePointsNextToEachFaceOfTheWindow) {
  const DepthModelParameters parameters;
  const ReferenceCamera camera(parameters);
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  const FramePointer frame = test::planeAndSphereFrame(7, parameters);
  BuiltScene built(*model, GridParameters{});
  // The ball's poles come nearest to the window's faces, occasionally within a few rounding errors.
  const double reach = built.builder.largestBall_m() * (1 - 1e-9);
  const Vec3 directions[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t i = 0; i < 50; ++i) {
    const std::uint32_t column = 30 + i * 577 % 580;
    const std::uint32_t row = 30 + i * 331 % 420;
    const std::uint32_t raw = frame->raw[row * drivers::kKinectWidth + column];
    const Vec3 point = camera.pointInWorld(column, row, raw);
    for (const Vec3& direction : directions) {
      const Scene& scene = built.build(*frame, point + reach * direction);
      const std::uint32_t pixel = PackedPixel::pack(column, row, raw);
      EXPECT_TRUE(std::any_of(scene.point, scene.point + scene.points,
                              [pixel](const GridPoint& p) { return p.pixel == pixel; }));
      test::expectVoxelsToHoldTheirPoints(scene);
      if (HasFatalFailure()) return;
    }
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(SceneOfFrame);

TEST(SceneBuilder, PlacesItsWindowOnWholeVoxelsAroundTheBall) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const FramePointer frame = test::frameOf(760);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> coordinate(-3, 3);
  for (const int cells : {9, 32}) {
    GridParameters grid;
    grid.cells_per_axis = cells;
    BuiltScene built(*model, grid);
    const double radius = built.builder.largestBall_m();
    EXPECT_GT(radius, grid.voxel_edge_m * (cells / 2 - 1));
    for (int i = 0; i < 200; ++i) {
      const Vec3 centre{coordinate(random), coordinate(random), coordinate(random)};
      const Scene& scene = built.build(*frame, centre);
      EXPECT_EQ(scene.ball_radius_m, radius);
      const double origin[3] = {scene.origin_m_in_world.x, scene.origin_m_in_world.y,
                                scene.origin_m_in_world.z};
      const double middle[3] = {centre.x, centre.y, centre.z};
      for (int axis = 0; axis < 3; ++axis) {
        const double voxels = origin[axis] / grid.voxel_edge_m;
        EXPECT_NEAR(voxels, std::round(voxels), 1e-9);  // a few hundred voxels, rounded to 2^-53 of that
        EXPECT_GE(middle[axis] - radius, origin[axis]);
        EXPECT_LE(middle[axis] + radius, origin[axis] + cells * grid.voxel_edge_m);
      }
    }
  }
}

TEST(SceneBuilder, CutsTheBallToWhatTheWindowHolds) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const FramePointer frame = test::frameOf(760);
  BuiltScene built(*model, GridParameters{});
  EXPECT_EQ(built.build(*frame, {}, 0.08).ball_radius_m, 0.08);
  EXPECT_EQ(built.build(*frame, {}, 5).ball_radius_m, built.builder.largestBall_m());
}

TEST(SceneBuilder, CarriesTheFramesNumberAndTime) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  FramePointer frame = test::frameOf(760);
  frame->sequence = 4711;
  frame->arrival_ns = 123456789;
  BuiltScene built(*model, GridParameters{});
  const Scene& scene = built.build(*frame, {0, 0, -1});
  EXPECT_EQ(scene.frame, 4711U);
  EXPECT_EQ(scene.frame_time_ns, 123456789);
  EXPECT_EQ(scene.depth_model, model.get());
}

TEST(SceneBuilder, ModelsTheWholeFrameWhateverTheBall) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const FramePointer frame = test::frameOf(760);
  BuiltScene built(*model, wholeFrameGrid());
  EXPECT_EQ(built.builder.largestBall_m(), std::numeric_limits<double>::infinity());
  constexpr double kHuge = std::numeric_limits<double>::max();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& centre : {Vec3{}, Vec3{9, 9, 9}, Vec3{kHuge, 0, -kHuge}, Vec3{kNaN, 0, 0}}) {
    EXPECT_EQ(built.build(*frame, centre, 0.1).points, drivers::kKinectPixels);
  }
}

TEST(SceneBuilder, ModelsNothingAroundACentreThatIsNotANumberOrFarAway) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const FramePointer frame = test::frameOf(760);
  BuiltScene built(*model, GridParameters{});
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {kNaN, kInfinity, -kInfinity, 1e300, -1e300, 1e38, 1e5}) {
    for (const Vec3& centre : {Vec3{bad, 0, -1}, Vec3{0, bad, -1}, Vec3{0, 0, bad}, Vec3{bad, bad, bad}}) {
      EXPECT_EQ(built.build(*frame, centre, 0.1).points, 0U) << bad;
      test::expectVoxelsToHoldTheirPoints(built.scene);
    }
  }
  EXPECT_GT(built.build(*frame, {0, 0, -1}, 0.1).points, 0U) << "and recovers";
}

TEST(Scene, CoversABallThatLiesWithinTheModelledOne) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  BuiltScene built(*model, GridParameters{});
  EXPECT_FALSE(built.scene.covers({}, 0)) << "nothing is modelled yet";
  const Scene& scene = built.build(*test::frameOf(760), {1, 2, 3}, 0.125);
  EXPECT_TRUE(scene.covers({1, 2, 3}, 0.125));
  EXPECT_FALSE(scene.covers({1, 2, 3}, 0.1251));
  EXPECT_TRUE(scene.covers({1.0, 2.0625, 3}, 0.0625));
  EXPECT_FALSE(scene.covers({1.0, 2.0625, 3}, 0.0626));
  EXPECT_FALSE(scene.covers({std::numeric_limits<double>::quiet_NaN(), 2, 3}, 0.01));
  BuiltScene whole(*model, wholeFrameGrid());
  EXPECT_TRUE(whole.build(*test::frameOf(760)).covers({-9, 9, 9}, 100));
}

/// One builder and one scene that are reused repeatedly, next to fresh ones.
class ReusedSceneMemory : public test::EachSimdTarget {};

TEST_P(ReusedSceneMemory, HoldsNothingOfTheScenesBefore) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  std::vector<FramePointer> frames;
  frames.push_back(test::planeAndSphereFrame(1, {}));
  frames.push_back(test::damagedFrame(2));
  frames.push_back(test::frameOf(drivers::kKinectNoMeasurement));
  frames.push_back(test::randomFrame(3, 271, 1003));
  frames.push_back(test::frameOf(800));
  for (const ModelExtent extent : {ModelExtent::reach, ModelExtent::frame}) {
    GridParameters grid;
    grid.extent = extent;
    grid.point_capacity = 20000;  // occasionally too few
    BuiltScene reused(*model, grid);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> shift(-0.4, 0.4);
    for (int i = 0; i < (extent == ModelExtent::reach ? 30 : 8); ++i) {
      const DepthFrame& frame = *frames[random() % frames.size()];
      const Vec3 centre{shift(random), shift(random), -1.1 + shift(random)};
      BuiltScene fresh(*model, grid);
      test::expectTheSameScene(reused.build(frame, centre), fresh.build(frame, centre));
      if (HasFatalFailure()) return;
    }
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(ReusedSceneMemory);

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
