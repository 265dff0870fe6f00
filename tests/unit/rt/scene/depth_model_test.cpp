// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_model.h"
#include "tools/lib/oracle/reference_camera.h"

namespace hapticd::rt {
namespace {

using tools::pointByPrintedMatrix;
using tools::ReferenceCamera;

constexpr double kQuarterTurn_rad = std::numbers::pi / 2;

/// Positions are a few metres; rt/ rounds about ten times in double precision (2^-53 each).
constexpr double kRounding_m = 1e-14;

DepthModelParameters withoutLimits(double a_per_m, double b_per_m) {
  DepthModelParameters parameters;
  parameters.a_per_m = a_per_m;
  parameters.b_per_m = b_per_m;
  parameters.near_m = 0.001;
  parameters.far_m = 1000;
  return parameters;
}

void expectNear(const Vec3& actual, const Vec3& expected, double tolerance) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}

TEST(DepthModel, PutsEveryPixelWhereThePrintedMatrixDoes) {
  const DepthModelParameters parameters;
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  for (std::uint32_t raw = 271; raw <= 1003; raw += 4) {
    for (std::uint32_t row = 0; row < drivers::kKinectHeight; row += 7) {
      for (std::uint32_t column = 0; column < drivers::kKinectWidth; column += 9) {
        const Vec3 expected = pointByPrintedMatrix(parameters, column, row, raw);
        const Vec3 actual = model->pointInWorld(PackedPixel::pack(column, row, raw));
        ASSERT_LT(norm(actual - expected), kRounding_m) << column << ' ' << row << ' ' << raw;
      }
    }
  }
}

TEST(DepthModel, LooksAlongMinusZWithXToTheRightAndYUp) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const Vec3 top_left = model->pointInWorld(PackedPixel::pack(0, 0, 800));
  const Vec3 bottom_right = model->pointInWorld(PackedPixel::pack(639, 479, 800));
  EXPECT_LT(top_left.x, 0);
  EXPECT_GT(top_left.y, 0);
  EXPECT_LT(top_left.z, 0);
  EXPECT_GT(bottom_right.x, 0);
  EXPECT_LT(bottom_right.y, 0);
  EXPECT_EQ(top_left.z, bottom_right.z);
}

struct TabulatedDepth {
  std::uint16_t raw;
  double paper_m;
  double factory_m;
};

class TabulatedDepthLaw : public testing::TestWithParam<TabulatedDepth> {};

// 0.5e-4 m: the table has four decimals.
TEST_P(TabulatedDepthLaw, PaperGivesTheTabulatedDepth) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  EXPECT_NEAR(model->depth_m(GetParam().raw), GetParam().paper_m, 0.5e-4);
}

TEST_P(TabulatedDepthLaw, FactoryConstantsGiveTheTabulatedDepth) {
  // libfreenect's nominal constants: Z = 0.01 R E / (E + p (C + 0.375) - (p / 4) d)
  constexpr double C = 200;     // const_shift
  constexpr double p = 0.1052;  // ref_pix_size
  constexpr double R = 120;     // ref_dist
  constexpr double E = 7.5;     // emitter_dist
  const DepthModelParameters factory =
      withoutLimits(-p / 4 / (0.01 * R * E), (E + p * (C + 0.375)) / (0.01 * R * E));
  const auto model = std::make_unique<DepthModel>(factory, PoseParameters{});
  EXPECT_NEAR(model->depth_m(GetParam().raw), GetParam().factory_m, 0.5e-4);
}

INSTANTIATE_TEST_SUITE_P(
    Raw, TabulatedDepthLaw,
    testing::Values(TabulatedDepth{400, 0.4756, 0.4984}, TabulatedDepth{500, 0.5570, 0.5833},
                    TabulatedDepth{600, 0.6719, 0.7032}, TabulatedDepth{700, 0.8466, 0.8850},
                    TabulatedDepth{750, 0.9731, 1.0164}, TabulatedDepth{800, 1.1441, 1.1937},
                    TabulatedDepth{850, 1.3879, 1.4459}, TabulatedDepth{900, 1.7638, 1.8332},
                    TabulatedDepth{950, 2.4189, 2.5039}, TabulatedDepth{1000, 3.8484, 3.9483}),
    [](const auto& instance) { return std::to_string(instance.param.raw); });

TEST(DepthModel, KeepsExactlyTheRawValuesBetweenTheLimits) {
  struct Case {
    double near_m, far_m;
    int first, last;
  };
  // (1 / near - b) / a = 270.57 and 678.54 for the first value
  for (const Case& c : {Case{0.4, 4.0, 271, 1003}, Case{0.8, 3.5, 678, 991}}) {
    DepthModelParameters parameters;
    parameters.near_m = c.near_m;
    parameters.far_m = c.far_m;
    const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
    for (int raw = 0; raw < drivers::kKinectRawValues; ++raw) {
      const bool kept = model->depth_m(static_cast<std::uint16_t>(raw)) != 0;
      EXPECT_EQ(kept, raw >= c.first && raw <= c.last) << raw;
    }
  }
}

TEST(DepthModel, CountsTheLimitsThemselvesAsInside) {
  DepthModelParameters parameters = withoutLimits(-0x1p-10, 2);  // Z = 1 m exactly at raw 1024
  parameters.near_m = 1;
  parameters.far_m = 1.5;
  EXPECT_EQ(std::make_unique<DepthModel>(parameters, PoseParameters{})->depth_m(1024), 1);
  parameters.near_m = 0.5;
  parameters.far_m = 1;
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  EXPECT_EQ(model->depth_m(1024), 1);
  EXPECT_EQ(model->depth_m(0), 0.5);
  EXPECT_EQ(model->depth_m(1025), 0);
}

TEST(DepthModel, NeverPutsAPointBehindTheCamera) {
  // Burrus' law before rounding to Table I: its pole is at raw 1084.61
  const DepthModelParameters parameters = withoutLimits(-0.0030711016, 3.3309495161);
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  EXPECT_NEAR(model->depth_m(1084), 533.22, 0.005);  // the depth at the last raw value before the pole
  for (int raw = 1085; raw < drivers::kKinectRawValues; ++raw) {
    ASSERT_EQ(model->depth_m(static_cast<std::uint16_t>(raw)), 0) << raw;
  }
}

TEST(DepthModel, GivesNoDepthWithoutMeasurementEvenWhereTheLawHasOne) {
  const auto rising = std::make_unique<DepthModel>(withoutLimits(-0.001, 3), PoseParameters{});
  EXPECT_GT(rising->depth_m(2046), 0);
  EXPECT_EQ(rising->depth_m(2047), 0);
}

TEST(DepthModel, AcceptsALawWhoseDepthFallsWithTheRawValue) {
  DepthModelParameters parameters = withoutLimits(0x1p-9, -1);
  parameters.near_m = 0.5;
  parameters.far_m = 4;
  const ReferenceCamera camera(parameters);
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  int kept = 0;
  for (std::uint32_t raw = 0; raw < drivers::kKinectRawValues; ++raw) {
    const double depth = model->depth_m(static_cast<std::uint16_t>(raw));
    ASSERT_EQ(depth != 0, camera.accepts(raw)) << raw;
    if (depth == 0) continue;
    ++kept;
    ASSERT_NEAR(depth, 1 / (raw / 512.0 - 1), kRounding_m);
  }
  EXPECT_EQ(kept, 1536 - 640 + 1);  // 1/Z = 0.25 at raw 640, 2 at raw 1536
  EXPECT_EQ(model->wholeFrame().raw_first, 640);
  EXPECT_EQ(model->wholeFrame().raw_last, 1536);
}

/// A camera with its optical axis at pixel (320, 240) and square pixels: pixel (320 + 60, 240) at 1 m is 0.1
/// m to the right, (320, 240 - 60) 0.1 m up.
DepthModelParameters roundCamera() {
  DepthModelParameters parameters = withoutLimits(-0x1p-10, 2);
  parameters.fx_px = parameters.fy_px = 600;
  parameters.cx_px = 320;
  parameters.cy_px = 240;
  return parameters;
}

struct PoseCase {
  const char* name;
  double roll_rad, pitch_rad, yaw_rad;
  Vec3 ahead, right, up;  // directions in the world of these directions of the camera
};

class CameraPose : public testing::TestWithParam<PoseCase> {};

TEST_P(CameraPose, TurnsTheCameraAsComputedByHand) {
  const PoseCase& c = GetParam();
  const Vec3 position{0.5, -2, 3};
  const auto model = std::make_unique<DepthModel>(
      roundCamera(), PoseParameters{position, c.roll_rad, c.pitch_rad, c.yaw_rad});
  expectNear(model->pointInWorld(PackedPixel::pack(320, 240, 1024)), position + c.ahead, kRounding_m);
  expectNear(model->pointInWorld(PackedPixel::pack(380, 240, 1024)), position + c.ahead + 0.1 * c.right,
             kRounding_m);
  expectNear(model->pointInWorld(PackedPixel::pack(320, 180, 1024)), position + c.ahead + 0.1 * c.up,
             kRounding_m);
}

// Fixed axes: first roll about x, then pitch about y, then yaw about z. Any other order of two quarter turns
// would change the result of each of the last three cases.
INSTANTIATE_TEST_SUITE_P(
    QuarterTurns, CameraPose,
    testing::Values(
        PoseCase{"None", 0, 0, 0, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}},
        PoseCase{"Roll", kQuarterTurn_rad, 0, 0, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}},
        PoseCase{"Pitch", 0, kQuarterTurn_rad, 0, {-1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
        PoseCase{"Yaw", 0, 0, kQuarterTurn_rad, {0, 0, -1}, {0, 1, 0}, {-1, 0, 0}},
        PoseCase{"RollPitch", kQuarterTurn_rad, kQuarterTurn_rad, 0, {0, 1, 0}, {0, 0, -1}, {1, 0, 0}},
        PoseCase{"RollYaw", kQuarterTurn_rad, 0, kQuarterTurn_rad, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
        PoseCase{"PitchYaw", 0, kQuarterTurn_rad, kQuarterTurn_rad, {0, -1, 0}, {0, 0, -1}, {-1, 0, 0}}),
    [](const auto& instance) { return instance.param.name; });

TEST(DepthModel, AgreesWithAnIndependentPoseAtOddAngles) {
  const DepthModelParameters parameters;
  const PoseParameters pose{{0.3, -1.2, 2.5}, 0.3, -1.1, 2.4};
  const ReferenceCamera camera(parameters, pose);
  const auto model = std::make_unique<DepthModel>(parameters, pose);
  for (std::uint32_t raw = 271; raw <= 1003; raw += 61) {
    for (std::uint32_t row = 0; row < drivers::kKinectHeight; row += 53) {
      for (std::uint32_t column = 0; column < drivers::kKinectWidth; column += 71) {
        expectNear(model->pointInWorld(PackedPixel::pack(column, row, raw)),
                   camera.pointInWorld(column, row, raw), kRounding_m);
      }
    }
  }
}

TEST(DepthModel, BoundsHoldEveryPointAndAreTouched) {
  const PoseParameters pose{{0.3, -1.2, 2.5}, 0.3, -1.1, 2.4};
  const DepthModelParameters parameters;
  const ReferenceCamera camera(parameters, pose);
  const DepthModel::Bounds bounds = std::make_unique<DepthModel>(parameters, pose)->bounds();
  Vec3 low{1e9, 1e9, 1e9};
  Vec3 high{-1e9, -1e9, -1e9};
  for (const std::uint32_t raw : {271U, 1003U}) {
    for (std::uint32_t row = 0; row < drivers::kKinectHeight; ++row) {
      for (std::uint32_t column = 0; column < drivers::kKinectWidth; column += row % 479 == 0 ? 1U : 639U) {
        const Vec3 p = camera.pointInWorld(column, row, raw);
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
      }
    }
  }
  // Raw 271 and 1003 are up to one raw step (48 mm at 4 m, times the ray's slope) inside the limits.
  constexpr double kStep_m = 0.048 * 1.3;
  EXPECT_LE(bounds.lowest_m_in_world.x, low.x);
  EXPECT_LE(bounds.lowest_m_in_world.y, low.y);
  EXPECT_LE(bounds.lowest_m_in_world.z, low.z);
  EXPECT_GE(bounds.highest_m_in_world.x, high.x);
  EXPECT_GE(bounds.highest_m_in_world.y, high.y);
  EXPECT_GE(bounds.highest_m_in_world.z, high.z);
  expectNear(bounds.lowest_m_in_world, low, kStep_m);
  expectNear(bounds.highest_m_in_world, high, kStep_m);
}

TEST(PackedPixel, RestoresPackedValuesAndSortsInImageOrder) {
  std::uint32_t last = 0;
  for (std::uint32_t row = 0; row < drivers::kKinectHeight; ++row) {
    for (std::uint32_t column = 0; column < drivers::kKinectWidth; ++column) {
      const std::uint32_t raw = (row * 977 + column * 131) % drivers::kKinectRawValues;
      const std::uint32_t packed = PackedPixel::pack(column, row, raw);
      ASSERT_EQ(PackedPixel::column(packed), column);
      ASSERT_EQ(PackedPixel::row(packed), row);
      ASSERT_EQ(PackedPixel::raw(packed), raw);
      ASSERT_TRUE(packed > last || (row == 0 && column == 0));
      last = packed;
    }
  }
}

struct Ball {
  Vec3 centre;
  double radius;
};

class Randomness {
 public:
  explicit Randomness(std::uint32_t seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  int below(int count) { return std::uniform_int_distribution(0, count - 1)(engine_); }

 private:
  std::mt19937 engine_;
};

PoseParameters randomPose(Randomness& random) {
  const auto turn = [&random] { return random.between(-3.1, 3.1); };
  const auto shift = [&random] { return random.between(-2, 2); };
  return {{shift(), shift(), shift()}, turn(), turn(), turn()};
}

/// Returns a random ball: in view, across the image borders, beside the view, around or behind the camera.
Ball randomBall(Randomness& random, const DepthModelParameters& parameters, const ReferenceCamera& camera) {
  const double radius = random.between(0.005, 0.4);
  switch (random.below(3)) {
    case 0:  // around the camera
      return {
          camera.toWorld({random.between(-0.5, 0.5), random.between(-0.5, 0.5), random.between(-0.8, 0.8)}),
          radius};
    case 1:  // around a ray that meets the image or passes near it
      return {
          camera.toWorld(random.between(0.3, 4.3) * Vec3{random.between(-400, 400) / parameters.fx_px,
                                                         random.between(-300, 300) / parameters.fy_px, -1}),
          radius};
    default:
      return {camera.toWorld({random.between(-2, 2), random.between(-2, 2), random.between(-4.5, 0.5)}),
              radius};
  }
}

/// For a ball, the points of all raw values on a sparse lattice of pixels with a random start, and of all
/// pixels just outside the window: those in the ball must be in the window.
class WindowCheck {
 public:
  WindowCheck(const DepthModelParameters& parameters, const PoseParameters& pose)
      : camera_(parameters, pose), model_(std::make_unique<DepthModel>(parameters, pose)) {
    for (std::uint32_t raw = 0; raw < drivers::kKinectRawValues; ++raw) {
      if (!camera_.accepts(raw)) continue;
      raws_.push_back(raw);
      depths_.push_back(1 / (parameters.a_per_m * raw + parameters.b_per_m));
    }
    origin_ = camera_.toWorld({});
    across_ = 1 / parameters.fx_px * (camera_.toWorld({1, 0, 0}) - origin_);
    up_ = 1 / parameters.fy_px * (camera_.toWorld({0, 1, 0}) - origin_);
    first_ray_ = camera_.toWorld({0, 0, -1}) - origin_ - parameters.cx_px * across_ + parameters.cy_px * up_;
  }

  void check(const Ball& ball, Randomness& random) {
    const PixelWindow window = model_->windowOfBall(ball.centre, ball.radius);
    constexpr int kStep = 37;
    for (int v = random.below(kStep); v < drivers::kKinectHeight; v += kStep) {
      for (int u = random.below(kStep); u < drivers::kKinectWidth; u += kStep) checkPixel(ball, window, u, v);
    }
    if (window.empty()) return;
    for (int u = 0; u < drivers::kKinectWidth; u += 3) {
      checkPixel(ball, window, u, window.row_first - 1);
      checkPixel(ball, window, u, window.row_last + 1);
    }
    for (int v = 0; v < drivers::kKinectHeight; v += 3) {
      checkPixel(ball, window, window.column_first - 1, v);
      checkPixel(ball, window, window.column_last + 1, v);
    }
  }

  const ReferenceCamera& camera() const { return camera_; }
  std::uint64_t pointsInBalls() const { return points_in_balls_; }

 private:
  void checkPixel(const Ball& ball, const PixelWindow& window, int u, int v) {
    if (u < 0 || u >= drivers::kKinectWidth || v < 0 || v >= drivers::kKinectHeight) return;
    const Vec3 ray = first_ray_ + u * across_ - v * up_;
    const Vec3 to_camera = origin_ - ball.centre;
    const bool pixel_inside =
        u >= window.column_first && u <= window.column_last && v >= window.row_first && v <= window.row_last;
    for (std::size_t i = 0; i < depths_.size(); ++i) {
      const Vec3 d = to_camera + depths_[i] * ray;
      if (dot(d, d) > ball.radius * ball.radius) continue;
      ++points_in_balls_;
      ASSERT_TRUE(pixel_inside && raws_[i] >= window.raw_first && raws_[i] <= window.raw_last)
          << "pixel " << u << ' ' << v << " raw " << raws_[i] << " ball " << ball.centre.x << ' '
          << ball.centre.y << ' ' << ball.centre.z << " radius " << ball.radius;
    }
  }

  ReferenceCamera camera_;
  std::unique_ptr<DepthModel> model_;
  std::vector<std::uint32_t> raws_;
  std::vector<double> depths_;
  Vec3 origin_, across_, up_, first_ray_;  // in world; pixel (u, v) looks along first_ray + u across - v up
  std::uint64_t points_in_balls_ = 0;
};

TEST(DepthWindow, HoldsEveryPixelAndRawValueThatCanShowAPointOfTheBall) {
  Randomness random(1);
  std::uint64_t points = 0;
  for (int camera = 0; camera < 20; ++camera) {
    DepthModelParameters parameters;
    if (camera % 4 == 3) {  // depth falls with the raw value
      parameters.a_per_m = 0.002;
      parameters.b_per_m = -1;
    }
    WindowCheck check(parameters, randomPose(random));
    for (int i = 0; i < 25; ++i) {
      check.check(randomBall(random, parameters, check.camera()), random);
      if (HasFatalFailure()) return;
    }
    points += check.pointsInBalls();
  }
  EXPECT_GT(points, 1'000'000U);  // not all balls were out of view
}

TEST(DepthWindow, IsEmptyForABallThatTheCameraCannotSee) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  EXPECT_TRUE(model->windowOfBall({0, 0, 0.2}, 0.1).empty()) << "behind the camera";
  EXPECT_TRUE(model->windowOfBall({0, 0, -0.2}, 0.1).empty()) << "nearer than the near limit";
  EXPECT_TRUE(model->windowOfBall({0, 0, -4.2}, 0.1).empty()) << "farther than the far limit";
  EXPECT_TRUE(model->windowOfBall({2, 0, -1}, 0.1).empty()) << "right of the view";
  EXPECT_TRUE(model->windowOfBall({-2, 0, -1}, 0.1).empty()) << "left of the view";
  EXPECT_TRUE(model->windowOfBall({0, 2, -1}, 0.1).empty()) << "above the view";
  EXPECT_TRUE(model->windowOfBall({0, -2, -1}, 0.1).empty()) << "below the view";
}

TEST(DepthWindow, IsTheWholeImageForABallAroundTheCamera) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const PixelWindow window = model->windowOfBall({0.1, 0, 0}, 1);
  EXPECT_EQ(window.column_first, 0);
  EXPECT_EQ(window.column_last, 639);
  EXPECT_EQ(window.row_first, 0);
  EXPECT_EQ(window.row_last, 479);
}

/// Determines the first and last column and row whose rays meet the ball by trying all pixels.
PixelWindow pixelsThatMeet(const Ball& ball, const DepthModelParameters& m) {
  PixelWindow met{drivers::kKinectWidth, -1, drivers::kKinectHeight, -1, 0, 0};
  for (int v = 0; v < drivers::kKinectHeight; ++v) {
    for (int u = 0; u < drivers::kKinectWidth; ++u) {
      const Vec3 ray{(u - m.cx_px) / m.fx_px, (m.cy_px - v) / m.fy_px, -1};
      const Vec3 nearest = dot(ray, ball.centre) / dot(ray, ray) * ray - ball.centre;
      if (norm(nearest) > ball.radius) continue;
      met.column_first = std::min(met.column_first, u);
      met.column_last = std::max(met.column_last, u);
      met.row_first = std::min(met.row_first, v);
      met.row_last = std::max(met.row_last, v);
    }
  }
  return met;
}

TEST(DepthWindow, IsAtMostThreePixelsAndTwoRawValuesTooWideOnEachSide) {
  const DepthModelParameters parameters;
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  Randomness random(2);
  for (int i = 0; i < 40; ++i) {
    const Ball ball{
        random.between(0.6, 3.5) * Vec3{random.between(-0.35, 0.35), random.between(-0.25, 0.25), -1},
        random.between(0.03, 0.15)};
    const PixelWindow window = model->windowOfBall(ball.centre, ball.radius);
    const PixelWindow met = pixelsThatMeet(ball, parameters);
    // A ball's outline touches its extreme columns and rows at one point, which falls between pixels: at most
    // one pixel more than the lattice shows; the window itself is widened by one and rounded outwards.
    EXPECT_GE(window.column_first, met.column_first - 3);
    EXPECT_LE(window.column_last, met.column_last + 3);
    EXPECT_GE(window.row_first, met.row_first - 3);
    EXPECT_LE(window.row_last, met.row_last + 3);
    const auto rawAt = [&](double z) { return (1 / z - parameters.b_per_m) / parameters.a_per_m; };
    EXPECT_GE(window.raw_first, rawAt(-ball.centre.z - ball.radius) - 2);
    EXPECT_LE(window.raw_last, rawAt(-ball.centre.z + ball.radius) + 2);
  }
}

}  // namespace
}  // namespace hapticd::rt
