// SPDX-License-Identifier: Apache-2.0
// A synthetic session with a known surface, and judgements of synthetic series.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "tools/hapticbench/disparity.h"
#include "tools/hapticbench/engine/sequences.h"
#include "tools/hapticbench/recordings.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr int kFrames = 40;
constexpr double kWall_m = 1.1;
constexpr double kArm_m = 0.8;

/// Raw disparity of a plane 1.1 m away that is turned about the vertical, at a pixel.
double wallRaw(const rt::DepthModelParameters& camera, int column) {
  const double slope = (column - camera.cx_px) / camera.fx_px;
  const double depth_m = kWall_m / (1 - 0.2 * slope);
  return (1 / depth_m - camera.b_per_m) / camera.a_per_m;
}

double rawAt(const rt::DepthModelParameters& camera, double depth_m) {
  return (1 / depth_m - camera.b_per_m) / camera.a_per_m;
}

/// The wall with white noise, and an arm 120 columns wide before it in frames 20 to 29.
BenchSequence madeUpSession() {
  const rt::DepthModelParameters camera;
  BenchSequence session{"made up", {}};
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.4);
  for (int i = 0; i < kFrames; ++i) {
    session.frames.push_back(std::make_unique<rt::DepthFrame>());
    rt::DepthFrame& frame = *session.frames.back();
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        const bool arm = i >= 20 && i < 30 && column >= 300 && column < 420;
        const double exact = arm ? rawAt(camera, kArm_m) : wallRaw(camera, column);
        frame.raw[row * drivers::kKinectWidth + column] =
            static_cast<std::uint16_t>(std::lround(exact + noise(random)));
      }
    }
    frame.sequence = static_cast<std::uint64_t>(i) + 1;
    frame.device_ticks = static_cast<std::uint32_t>(i) * 2002155U;
  }
  return session;
}

const CameraDisparity& kinect() {
  static const CameraDisparity camera{rt::DepthModelParameters{}};
  return camera;
}

const BenchSequence& session() {
  static const BenchSequence made_up = madeUpSession();
  return made_up;
}

TEST(PlayedSession, GoesForwardsAndBackwardsWithoutAJump) {
  PlayedSession played(session());
  const int last = kFrames - 1;
  for (int index = 0; index < 5 * kFrames; ++index) {
    EXPECT_EQ(std::abs(played.frameOfSession(index + 1) - played.frameOfSession(index)), 1) << index;
    const long period = played.arrivalTick(index + 1) - played.arrivalTick(index);
    EXPECT_EQ(period, 33) << index;  // 2002155 ticks of 60 MHz
    EXPECT_EQ(played.frame(index).sequence, static_cast<std::uint64_t>(index) + 1);
  }
  EXPECT_EQ(played.frameOfSession(last), last);
  EXPECT_EQ(played.frameOfSession(2 * last), 0);
}

TEST(PlayedSession, KeepsTheGapsOfFramesThatWereLost) {
  BenchSequence gap{"gap", {}};
  for (const std::uint32_t ticks :
       {4294000000U, 1034859U, 5039169U}) {  // the counter wraps, then two periods
    gap.frames.push_back(std::make_unique<rt::DepthFrame>());
    gap.frames.back()->device_ticks = ticks;
  }
  EXPECT_EQ(arrivalTicks(gap), (std::vector<long>{0, 33, 100}));
}

TEST(RobustFit, FindsAQuadraticBelowATenthOfOutliers) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.3);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<DisparitySample> samples;
  const auto truth = [](double u, double v) {
    return 800 + 0.05 * u - 0.02 * v + 2e-4 * u * u - 1e-4 * u * v + 3e-4 * v * v;
  };
  for (int v = -50; v <= 50; ++v) {
    for (int u = -50; u <= 50; ++u) {
      const double outlier = share(random) < 0.1 ? 40 : 0;
      samples.push_back({300.0 + u, 200.0 + v, truth(u, v) + noise(random) + outlier});
    }
  }
  const auto fit = fitDisparity(samples, 300, 200, 50);
  ASSERT_TRUE(fit);
  // standard error of six terms from 9000 samples of 0.3 raw: 0.3 sqrt(6 / 9000) = 0.008, at corners three
  // times that; four of these
  for (const int u : {-50, 0, 50}) {
    for (const int v : {-50, 0, 50}) EXPECT_NEAR(fit->quadratic.at(300 + u, 200 + v), truth(u, v), 0.1);
  }
  EXPECT_NEAR(fit->residual_raw, 0.3, 0.05);
  EXPECT_NEAR(fit->outlier_share, 0.1, 0.01);
}

TEST(RobustFit, KnowsTheNormalOfAPlane) {
  const rt::DepthModelParameters camera;
  std::vector<DisparitySample> samples;
  for (int v = 200; v < 260; v += 2) {
    for (int u = 300; u < 360; u += 2)
      samples.push_back({static_cast<double>(u), static_cast<double>(v), wallRaw(camera, u)});
  }
  const auto fit = fitDisparity(samples, 330, 230, 30);
  ASSERT_TRUE(fit);
  const SurfacePoint point = surfacePoint(kinect(), fit->quadratic, 345, 215);
  // Z = 1.1 / (1 - 0.2 x / Z), so Z - 0.2 x = 1.1; outward is towards smaller Z and larger x
  const double length = std::hypot(1.0, 0.2);
  EXPECT_NEAR(point.normal.x, 0.2 / length, 1e-6);
  EXPECT_NEAR(point.normal.y, 0, 1e-6);
  EXPECT_NEAR(point.normal.z, 1 / length, 1e-6);
  EXPECT_NEAR(-point.position_m.z - 0.2 * point.position_m.x, kWall_m, 1e-6);
}

/// Unit variance, the same for pixels of a box of 9 x 9.
TEST(FitError, IsTheErrorOfFitsToAStaticPattern) {
  constexpr int kSide = 108;
  constexpr int kBox = 9;
  constexpr int kTrials = 60;
  std::mt19937 random(11);
  std::normal_distribution<double> white(0, 1);
  double squares = 0;
  double predicted_squares = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    constexpr int kWide = kSide + kBox;
    std::vector<double> field(kWide * kWide);
    for (double& value : field) value = white(random);
    std::vector<DisparitySample> samples;
    for (int v = 0; v < kSide; ++v) {
      for (int u = 0; u < kSide; ++u) {
        double sum = 0;
        for (int y = 0; y < kBox; ++y) {
          for (int x = 0; x < kBox; ++x) sum += field[static_cast<std::size_t>((v + y) * kWide + u + x)];
        }
        samples.push_back({static_cast<double>(u), static_cast<double>(v), sum / kBox});
      }
    }
    const auto fit = fitDisparity(samples, kSide / 2.0, kSide / 2.0, kSide / 2.0);
    ASSERT_TRUE(fit);
    double trial_squares = 0;
    for (const DisparitySample& sample : samples)
      trial_squares += std::pow(fit->quadratic.at(sample.column, sample.row), 2);
    squares += trial_squares / (kSide * kSide);
    predicted_squares += std::pow(fitError(fit->residual_raw, kSide * kSide, 6, kBox), 2);
  }
  // A mean over 60 trials of a sum of six squares of normal numbers: s.d. sqrt(2 / 360) = 7.5 % of the
  // square; the border makes the outermost samples share less. Four s.d. of the root are 15 %.
  EXPECT_NEAR(std::sqrt(predicted_squares / squares), 1, 0.15);
}

const std::vector<RestingSurface>& surfacesOfSession() {
  static const std::vector<RestingSurface> surfaces =
      restingSurfaces(pixelStatistics(session(), kinect()), kFrames, kinect(), {.sizes_m = {0.16}});
  return surfaces;
}

TEST(RestingSurfaces, AreFoundWhereNothingPassesAndLieOnTheTruth) {
  const rt::DepthModelParameters camera;
  ASSERT_FALSE(surfacesOfSession().empty());
  for (const RestingSurface& surface : surfacesOfSession()) {
    EXPECT_TRUE(surface.column + surface.half_px < 300 || surface.column - surface.half_px >= 420);
    EXPECT_NEAR(surface.fit.at(surface.column, surface.row),
                wallRaw(camera, static_cast<int>(surface.column)), 0.05);
  }
}

TEST(SurfaceStroke, StaysEightMillimetresBehindTheSurface) {
  ASSERT_FALSE(surfacesOfSession().empty());
  const auto ticks = handleSurface(surfacesOfSession().front(), kinect(), Handling::along_row, 500);
  std::size_t pressing = 0;
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    if (!ticks[i].presses) continue;
    ++pressing;
    EXPECT_NEAR(norm(ticks[i].true_force_n), 4, 1e-9);
    EXPECT_NEAR(norm(ticks[i].hip_m - ticks[i - 1].hip_m), 1e-4, 5e-6);
    // from the true plane Z - 0.2 x = 1.1; the fit is within 0.05 raw of 3.7 mm
    const double behind_m = (-ticks[i].hip_m.z - 0.2 * ticks[i].hip_m.x - kWall_m) / std::hypot(1.0, 0.2);
    EXPECT_NEAR(behind_m, 0.008, 2e-4);
  }
  EXPECT_EQ(pressing, 1000U);
}

StrokeTick pressedTick(bool still) {
  return {.hip_m = {},
          .true_force_n = {0, 0, 4},
          .normal = {0, 0, 1},
          .along = still ? Vec3{} : Vec3{1, 0, 0},
          .presses = true};
}

TEST(JudgeSurface, FindsLostContactAndForceAlongTheStroke) {
  const std::vector<StrokeTick> ticks(101, pressedTick(false));
  std::vector<Vec3> forces(101, Vec3{0, 0, 4});
  for (std::size_t i = 1; i <= 25; ++i) forces[i] = {};
  for (std::size_t i = 51; i <= 75; ++i) forces[i] = {0.3, 0, 4};
  const SurfaceError error = judgeSurface(ticks, forces, std::vector<bool>(101, true));
  EXPECT_EQ(error.error_n.size(), 100U);
  EXPECT_EQ(error.lost, 25U);
  EXPECT_EQ(error.zero, 25U);
  EXPECT_NEAR(rootMeanSquare(error.along_n), 0.15, 1e-12);
  EXPECT_NEAR(rootMeanSquare(error.error_n), std::sqrt((16.0 + 0.09) / 4), 1e-12);
  EXPECT_TRUE(error.new_frame_n.empty());  // it strokes
}

TEST(JudgeSurface, TakesTheChangeAtNewFramesAlone) {
  const std::vector<StrokeTick> ticks(4, pressedTick(true));
  const std::vector<Vec3> forces{{0, 0, 4}, {0, 0, 4.1}, {0, 0, 4.2}, {0, 0, 4.5}};
  const SurfaceError error = judgeSurface(ticks, forces, {true, false, true, false});
  ASSERT_EQ(error.new_frame_n.size(), 1U);
  EXPECT_NEAR(error.new_frame_n.front(), 0.1, 1e-12);
}

TEST(PassedPlaces, AreWhereSomethingPassesAndKnowWhen) {
  const rt::DepthModelParameters camera;
  const auto pixels = pixelStatistics(session(), kinect());
  const auto places = passedPlaces(session(), restingBackground(session(), pixels, kinect()), kinect(), 10);
  ASSERT_EQ(places.size(), 10U);
  for (const PassedPlace& place : places) {
    EXPECT_NEAR(place.surface.at(place.column, place.row), wallRaw(camera, static_cast<int>(place.column)),
                0.3);
    for (int frame = 0; frame < kFrames; ++frame)
      EXPECT_EQ(place.covered[static_cast<std::size_t>(frame)], frame >= 20 && frame < 30) << frame;
  }
}

TEST(PassedPlaces, MeasureWhatIsNearTheHip) {
  const auto pixels = pixelStatistics(session(), kinect());
  const auto places = passedPlaces(session(), restingBackground(session(), pixels, kinect()), kinect(), 1);
  ASSERT_EQ(places.size(), 1U);
  const PassedPlace& place = places.front();
  const Vec3 hip = place.point.position_m + 0.03 * place.point.normal;
  const Vec3 at_arm = (kArm_m / -place.point.position_m.z) * place.point.position_m;
  // the wall is 30 mm away, less noise of 0.4 raw of 3.7 mm; the arm 0.3 m
  EXPECT_FALSE(measuresNear(*session().frames[0], kinect(), place, hip, 0.02, -1));
  EXPECT_TRUE(measuresNear(*session().frames[0], kinect(), place, hip, 0.035, -1));
  EXPECT_FALSE(measuresNear(*session().frames[25], kinect(), place, hip, 0.02, -1));
  EXPECT_TRUE(measuresNear(*session().frames[25], kinect(), place, at_arm, 0.02, -1));
}

TEST(JudgePassing, SeparatesTheSensorsErrorFromWhatThePassageChanges) {
  std::vector<PassingTick> ticks(1000, {.force_n = {0, 0, 2}, .true_n = {0, 0, 3}});
  for (std::size_t i = 300; i < 500; ++i) ticks[i].covered = true;
  for (std::size_t i = 400; i < 450; ++i) ticks[i].force_n = {};
  const PassingError error = judgePassing(ticks);
  EXPECT_EQ(error.error.longest, 200U);
  EXPECT_EQ(error.change.longest, 50U);
  EXPECT_EQ(error.calm.longest, 0U);
  EXPECT_EQ(error.ghost.ticks, 0U);
}

TEST(JudgePassing, LeavesOutWhatMayTouchTheHip) {
  std::vector<PassingTick> ticks(1000);
  for (std::size_t i = 100; i < 200; ++i) {
    ticks[i].force_n = {0, 0, 1};
    ticks[i].left_out = i < 180;
    ticks[i].covered = true;
  }
  const PassingError error = judgePassing(ticks);
  EXPECT_EQ(error.left_out, 80U);
  EXPECT_EQ(error.ghost.ticks, 920U);
  EXPECT_EQ(error.ghost.above, 20U);
  EXPECT_DOUBLE_EQ(error.ghost_covered.percent(), 100);
}

}  // namespace
}  // namespace hapticd::tools
