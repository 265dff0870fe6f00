// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/any_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "rt/depth/depth_model.h"
#include "rt/depth/disparity_image.h"
#include "rt/modelling/occlusion_memory.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/oracle/spring_oracle.h"

namespace hapticd::rt {
namespace {

using tools::NamedCamera;

/// Cameras that people can buy, in small and in their largest modes.
std::vector<NamedCamera> cameras() {
  return {{"D405at424x240", tools::stereoCamera(424, 240, 87, 0.018, 1e-4, 0.07, 1.0)},
          {"D405at1280x720", tools::stereoCamera(1280, 720, 87, 0.018, 1e-4, 0.07, 1.0)},
          {"D435at848x480", tools::stereoCamera(848, 480, 90, 0.050, 1e-4, 0.2, 4.0)},
          {"D435inMillimetres", tools::stereoCamera(640, 480, 74, 0.050, 1e-3, 0.2, 2.2)},
          {"Gemini1280x800", tools::stereoCamera(1280, 800, 90, 0.050, 1e-3, 0.2, 2.2)},
          {"Femto640x576", tools::timeOfFlightCamera(640, 576)}};
}

class AnyCamera : public testing::TestWithParam<NamedCamera> {
 protected:
  const DepthModelParameters& camera() const { return GetParam().camera; }
  /// A distance at which the camera is used.
  double distance_m() const { return std::max(0.3, 2.5 * camera().near_m); }
};

std::vector<Vec3> pointsOf(const DepthFrame& frame) {
  const DepthModelParameters& camera = frame.camera;
  std::vector<Vec3> points_m;
  for (int row = 0; row < camera.height_px; ++row) {
    for (int column = 0; column < camera.width_px; ++column) {
      const std::uint16_t raw = frame.raw[row * strideOf(camera.width_px) + column];
      const double depth = camera.unit_m * raw;
      if (raw == camera.raw_no_measurement || depth < camera.near_m || depth > camera.far_m) continue;
      points_m.push_back({(column - camera.cx_px) / camera.fx_px * depth,
                          (camera.cy_px - row) / camera.fy_px * depth, -depth});
    }
  }
  return points_m;
}

TEST_P(AnyCamera, HasNoFault) {
  EXPECT_EQ(faultOf(camera()), CameraFault::none);
}

TEST_P(AnyCamera, ConvertsItsRawValuesToDisparitiesAndBackWithinAUnit) {
  const DepthModel model(camera(), {});
  for (std::uint32_t raw = 0; raw < 65536; raw += 7) {
    const auto value = static_cast<std::uint16_t>(raw);
    const std::uint16_t disparity = model.disparityOf(value);
    ASSERT_EQ(disparity == kNoRawDisparity, model.depth_m(value) == 0) << raw;
    if (disparity == kNoRawDisparity) continue;
    const double depth = 1 / model.disparity().inverseDepth_per_m(disparity);
    ASSERT_NEAR(depth, model.depth_m(value),
                0.51 * model.disparity().unit_m(depth) * (depth / model.depth_m(value) + 0.1))
        << raw;
    const double back = model.depth_m(model.rawOfDisparity(disparity));
    if (back > 0) {
      ASSERT_NEAR(back, depth, 0.51 * camera().unit_m) << raw;
    }
  }
}

TEST_P(AnyCamera, DisparityImageEqualsTheConversionOfEachPixel) {
  const DepthModel model(camera(), {});
  const auto frame = tools::frameOf(camera(), tools::tiltedPlane(camera(), distance_m(), 0.4), 3);
  DisparityImage image(model);
  PixelWindow window = model.wholeFrame();
  image.convert(*frame, window);
  const DisparityFrame disparity = image.of(*frame);
  int other = 0;
  for (std::size_t i = 0; i < frame->pixels(); ++i) {
    const int expected = model.disparityOf(frame->raw[i]);
    ASSERT_LE(std::abs(expected - disparity.raw[i]), 1) << i;
    other += expected != disparity.raw[i] ? 1 : 0;
  }
  // single precision decides differently only for values halfway between two
  EXPECT_LE(other, static_cast<int>(frame->pixels() / 200));
}

TEST_P(AnyCamera, BoundsItsNoiseAtEveryDisparity) {
  const DepthModel model(camera(), {});
  for (double depth = camera().near_m; depth <= camera().far_m; depth += 0.01) {
    const double bound = model.noiseBound().at(model.disparity().rawOf(depth));
    ASSERT_GE(bound, model.noiseScale(depth) - 1e-9) << depth;
  }
}

TEST_P(AnyCamera, RemembersWhatAnOccluderHidesAtEveryDepth) {
  const DepthModel model(camera(), {});
  OcclusionMemory memory(model);
  DisparityImage image(model);
  DepthFrame frame{};
  frame.camera = camera();
  const PixelWindow all = model.wholeFrame();
  const auto show = [&](double depth_m) {
    std::ranges::fill(frame.image(), static_cast<std::uint16_t>(std::lround(depth_m / camera().unit_m)));
    ++frame.sequence;
    frame.arrival_ns += 33'333'333;
    image.convert(frame, all);
    memory.update(image.of(frame), all);
  };
  for (double wall_m = 2 * camera().near_m; wall_m < camera().far_m; wall_m *= 1.3) {
    // six standard deviations of the noise, which must not look like an occluder, and more than the shell
    const double gap_m = OcclusionMemory::kShell_m + 6 * camera().noise.sigma_m(wall_m) + 0.005;
    if (wall_m - gap_m < camera().near_m) continue;
    memory.forget();
    show(wall_m);
    show(wall_m - gap_m);
    const std::uint16_t hidden = memory.hidden()[model.pixels() / 2 + 7];
    ASSERT_NE(hidden, kNoRawDisparity) << wall_m;
    EXPECT_NEAR(1 / model.disparity().inverseDepth_per_m(hidden), wall_m,
                camera().unit_m + model.disparity().unit_m(wall_m))
        << wall_m;
  }
}

TEST_P(AnyCamera, TheExactLawEqualsAnExhaustiveSearch) {
  const auto frame = tools::frameOf(camera(), tools::tiltedPlane(camera(), distance_m(), 0.5), 5);
  const std::vector<Vec3> points_m = pointsOf(*frame);
  ASSERT_GT(points_m.size(), 10000U);
  for (const ModelExtent extent : {ModelExtent::reach, ModelExtent::frame}) {
    const bool fits = (camera().far_m - camera().near_m) / camera().unit_m < PackedPixel::kRawRange;
    if (extent == ModelExtent::frame && !fits) continue;
    GridParameters grid;
    grid.extent = extent;
    grid.point_capacity = 400000;
    tools::OfflineBox box(camera(), {}, grid);
    box.parameters().law = ForceLaw::nearest_springs;
    SpringParameters& springs = box.parameters().force;
    box.show(*frame);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1, 1);
    int in_contact = 0;
    for (int i = 0; i < 60; ++i) {
      springs.radius_m = 0.02 + 0.02 * std::abs(unit(random));
      const double x = 0.2 * distance_m() * unit(random);
      const double y = 0.2 * distance_m() * unit(random);
      const double depth = distance_m() / (1 + y / distance_m() * std::tan(0.5));
      const Vec3 hip{x, y, -depth + 0.03 * unit(random)};
      const tools::SpringOracle oracle(points_m, hip, springs);
      const Vec3 force = box.lawForce(hip).force_n_in_world;
      if (oracle.radiusMargin_m() < 1e-9) continue;
      ASSERT_LE(oracle.error_n(force), 1e-4) << "HIP " << i;
      in_contact += oracle.pointsUsed() > 0 ? 1 : 0;
    }
    EXPECT_GT(in_contact, 30);
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, AnyCamera, testing::ValuesIn(cameras()),
                         [](const auto& instance) { return instance.param.name; });

/// RMS error of the position of a plane under the law `surface`, in the camera's own standard deviation.
double planeErrorInSigma(const DepthModelParameters& camera, double distance_m) {
  constexpr int kFrames = 6;
  double squares = 0;
  int count = 0;
  for (std::uint32_t seed = 1; seed <= kFrames; ++seed) {
    const auto frame = tools::frameOf(camera, tools::tiltedPlane(camera, distance_m, 0), seed);
    tools::OfflineBox box(camera, {}, {});
    box.parameters().law = ForceLaw::surface;
    box.show(*frame);
    for (int i = 0; i < 24; ++i) {
      const Vec3 above{0.03 * (i % 6 - 2.5), 0.03 * (i / 6 - 1.5), -distance_m + 0.02};
      const Vec3 hip = above - Vec3{0, 0, 0.023};
      box.core().release();
      for (int step = 0; step <= 23; ++step) box.lawForce(above + (step / 23.0) * (hip - above));
      const double depth_m = box.lawForce(hip).force_n_in_world.z / box.parameters().force.stiffness_n_per_m;
      squares += (depth_m - 0.003) * (depth_m - 0.003);
      ++count;
    }
  }
  return std::sqrt(squares / count) / camera.noise.sigma_m(distance_m);
}

TEST(SurfaceOfOtherCameras, ErrsInUnitsOfTheNoiseNoMoreThanWithAKinect) {
  double kinect = 0;
  for (const double distance_m : {0.6, 0.8, 1.0})
    kinect = std::max(kinect, planeErrorInSigma(tools::kinectWithNoise(), distance_m));
  RecordProperty("kinect", std::to_string(kinect));
  const NamedCamera others[] = {{"D405 at 0.3 m", tools::stereoCamera(848, 480, 87, 0.018, 1e-4, 0.07, 1.0)},
                                {"D435 at 0.5 m", tools::stereoCamera(848, 480, 90, 0.050, 1e-4, 0.2, 4.0)},
                                {"Femto at 0.8 m", tools::timeOfFlightCamera(640, 576)}};
  const double distances_m[] = {0.3, 0.5, 0.8};
  for (int i = 0; i < 3; ++i) {
    const double other = planeErrorInSigma(others[i].camera, distances_m[i]);
    std::printf("%s: %.2f sigma, Kinect: up to %.2f sigma\n", others[i].name.c_str(), other, kinect);
    EXPECT_LE(other, kinect) << others[i].name;
  }
}

/// RMS error of the force in JND (7 % of it, at least 0.1 N) over HIPs at a depth in a surface, for frames
/// with noise of the camera. `at(i)`: a place on the surface; `normal(i)`: towards the free side.
template <typename Depth, typename At, typename Normal>
double errorInJnd(const DepthModelParameters& camera, const Depth& depth, double pressed_m, const At& at,
                  const Normal& normal) {
  constexpr int kFrames = 6;
  constexpr int kPlaces = 24;
  double squares = 0;
  for (std::uint32_t seed = 1; seed <= kFrames; ++seed) {
    const auto frame = tools::frameOf(camera, depth, seed);
    tools::OfflineBox box(camera, {}, {});
    box.parameters().law = ForceLaw::surface;
    box.show(*frame);
    for (int i = 0; i < kPlaces; ++i) {
      box.core().release();
      constexpr int kSteps = 30;
      constexpr double kAbove_m = 0.01;
      Vec3 force;
      for (int step = 0; step <= kSteps; ++step) {
        const double height = kAbove_m - (kAbove_m + pressed_m) * step / kSteps;
        force = box.lawForce(at(i) + height * normal(i)).force_n_in_world;
      }
      const Vec3 truth = pressed_m * box.parameters().force.stiffness_n_per_m * normal(i);
      const double jnd = std::max(0.1, 0.07 * norm(truth));
      squares += dot(force - truth, force - truth) / (jnd * jnd);
    }
  }
  return std::sqrt(squares / (kFrames * kPlaces));
}

TEST(NearCamera, LetsAPlaneAndASmallBallBeFeltBelowOneJnd) {
  const DepthModelParameters d405 = tools::stereoCamera(848, 480, 87, 0.018, 1e-4, 0.07, 1.0);
  const auto onPlane = [](double distance_m) {
    return [distance_m](int i) { return Vec3{0.02 * (i % 6 - 2.5), 0.02 * (i / 6 - 1.5), -distance_m}; };
  };
  const auto forwards = [](int) { return Vec3{0, 0, 1}; };
  for (const double distance_m : {0.1, 0.2, 0.3}) {
    const double error =
        errorInJnd(d405, tools::tiltedPlane(d405, distance_m, 0), 0.008, onPlane(distance_m), forwards);
    std::printf("plane at %.2f m: %.2f JND\n", distance_m, error);
    EXPECT_LT(error, 1) << distance_m;
  }
  constexpr double kRadius_m = 0.01;
  for (const double distance_m : {0.1, 0.15}) {
    const Vec3 centre{0, 0, -distance_m};
    const auto ball = tools::ball(d405, centre, kRadius_m);
    const auto scene = [&](double u, double v) {
      const double depth = ball(u, v);
      return depth > 0 ? depth : distance_m + 0.06;
    };
    const auto outwards = [](int i) {
      const double angle = 0.5 * (i % 6) / 6;
      const double turn = i / 6 * 1.5708;
      return Vec3{std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle)};
    };
    const double error = errorInJnd(
        d405, scene, 0.002, [&](int i) { return centre + kRadius_m * outwards(i); }, outwards);
    std::printf("ball of 10 mm at %.2f m: %.2f JND\n", distance_m, error);
    EXPECT_LT(error, 1) << distance_m;
  }
}

TEST(FaultOfACamera, NamesWhatIsWrong) {
  const DepthModelParameters good = tools::stereoCamera(848, 480, 90, 0.05, 1e-4, 0.2, 4.0);
  const auto with = [&good](auto change) {
    DepthModelParameters camera = good;
    change(camera);
    return faultOf(camera);
  };
  EXPECT_EQ(with([](auto& c) { c.width_px = 0; }), CameraFault::size);
  EXPECT_EQ(with([](auto& c) { c.width_px = kMaxFrameWidth + 1; }), CameraFault::size);
  EXPECT_EQ(with([](auto& c) { c.height_px = kMaxFrameHeight + 1; }), CameraFault::size);
  EXPECT_EQ(with([](auto& c) { c.fx_px = 0; }), CameraFault::intrinsics);
  EXPECT_EQ(with([](auto& c) { c.cy_px = NAN; }), CameraFault::intrinsics);
  EXPECT_EQ(with([](auto& c) { c.near_m = 0; }), CameraFault::limits);
  EXPECT_EQ(with([](auto& c) { c.far_m = c.near_m; }), CameraFault::limits);
  EXPECT_EQ(with([](auto& c) { c.unit_m = -1e-3; }), CameraFault::depth_law);
  EXPECT_EQ(with([](auto& c) { c.near_m = 7, c.far_m = 8; }), CameraFault::depth_law);
  EXPECT_EQ(with([](auto& c) { c.noise.c2_per_m = -1; }), CameraFault::noise);
  EXPECT_EQ(with([](auto& c) { c.noise.standing_share = 2; }), CameraFault::noise);
  EXPECT_EQ(faultOf(DepthModelParameters{}), CameraFault::none);
}

}  // namespace
}  // namespace hapticd::rt
