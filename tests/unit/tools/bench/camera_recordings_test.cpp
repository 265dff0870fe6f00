// SPDX-License-Identifier: Apache-2.0
// What the studies read of folders of recordings, and what `hapticbench recordings` makes of sessions of
// cameras that deliver depth.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>

#include "tests/support/recordings/depth_recording.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticbench/disparity.h"
#include "tools/hapticbench/engine/sequences.h"
#include "tools/hapticbench/recordings.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr int kFrames = 24;
constexpr double kWall_m = 1;
constexpr double kTilt_rad = 0.2;
constexpr double kArm_m = 0.7;
constexpr int kFirstArm_px = 300;  // columns
constexpr int kLastArm_px = 380;
constexpr int kFirstArmFrame = 17;
constexpr int kLastArmFrame = 20;

rt::DepthModelParameters stereo() {
  return stereoCamera(848, 480, 90, 0.05, 1e-4, 0.4, 4);
}
rt::DepthModelParameters timeOfFlight() {
  return timeOfFlightCamera(640, 576);
}

/// A tilted wall, and an arm before it in some of the frames.
BenchSequence sessionOf(const rt::DepthModelParameters& camera) {
  const DepthAt wall = tiltedPlane(camera, kWall_m, kTilt_rad);
  FrameSequence free(camera, wall, 3);
  FrameSequence passed(
      camera,
      [wall](double column, double row) {
        return column >= kFirstArm_px && column <= kLastArm_px ? kArm_m : wall(column, row);
      },
      3);
  BenchSequence session{"made up", {}};
  for (int i = 0; i < kFrames; ++i) {
    auto of_wall = free.next();
    auto of_arm = passed.next();
    const bool is_passed = i >= kFirstArmFrame && i <= kLastArmFrame;
    session.frames.push_back(std::move(is_passed ? of_arm : of_wall));
    session.frames.back()->arrival_ns = i * 33'333'333LL;
  }
  return session;
}

struct Made {
  BenchSequence session;
  CameraDisparity camera;
  std::vector<PixelStatistics> pixels;

  explicit Made(const rt::DepthModelParameters& parameters)
      : session(sessionOf(parameters)),
        camera(cameraWithNoise(session)),
        pixels(pixelStatistics(session, camera)) {}
  std::vector<RestingSurface> surfaces() const {
    return restingSurfaces(pixels, session.frames.size(), camera, {.sizes_m = {0.16, 0.32}});
  }
};

/// Distance of the fit from the true wall along its normal, root mean square over the square.
double error_m(const Made& made, const RestingSurface& surface) {
  constexpr int kSteps = 8;
  const Vec3 normal{0, -std::sin(kTilt_rad), std::cos(kTilt_rad)};
  double squares = 0;
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      const double column = surface.column + surface.half_px * double(i) / kSteps;
      const double row = surface.row + surface.half_px * double(j) / kSteps;
      const Vec3 point = made.camera.pointOf(column, row, surface.fit.at(column, row));
      squares += std::pow(dot(point - Vec3{0, 0, -kWall_m}, normal), 2);
    }
  }
  return std::sqrt(squares) / (2 * kSteps + 1);
}

class SessionOfACamera : public testing::TestWithParam<rt::DepthModelParameters> {
 protected:
  static const Made& made() {
    static std::map<int, std::unique_ptr<Made>> all;  // by the width of the images
    auto& one = all[GetParam().width_px];
    if (!one) one = std::make_unique<Made>(GetParam());
    return *one;
  }
};

TEST_P(SessionOfACamera, HasRestingSurfacesThatLieOnTheTruth) {
  const std::vector<RestingSurface> surfaces = made().surfaces();
  ASSERT_GE(surfaces.size(), 4U);
  const rt::DepthNoiseParameters& noise = GetParam().noise;
  for (const RestingSurface& surface : surfaces) {
    // the arm is before it in 4 of 24 frames
    EXPECT_TRUE(surface.column + surface.half_px < kFirstArm_px + 8 ||
                surface.column - surface.half_px > kLastArm_px - 8)
        << surface.column;
    EXPECT_NEAR(surface.distance_m, 1, 0.3);
    // The error has six degrees of freedom: a factor of 3 is a chi-squared of 54, of which the share above is
    // 1e-9.
    EXPECT_GT(surface.fit_error_m, 0);
    EXPECT_LT(error_m(made(), surface), 3 * surface.fit_error_m);
    // The mean image has the standing part and a 24th of the changing one. The deviation of a square of 0.16
    // m has a standard error of 5 %, half as much again because it is robust, and the flattest are chosen.
    const double expected_m = noise.sigma_m(surface.distance_m) *
                              std::sqrt(noise.standing_share + (1 - noise.standing_share) / kFrames);
    const double unit_m = made().camera.unit_m(surface.distance_m);
    EXPECT_NEAR(surface.residual_raw * unit_m / expected_m, 1, 0.3);
  }
}

TEST_P(SessionOfACamera, KnowsWhatPassesAndWhen) {
  const CameraDisparity& camera = made().camera;
  const auto places =
      passedPlaces(made().session, restingBackground(made().session, made().pixels, camera), camera, 5);
  ASSERT_EQ(places.size(), 5U);
  for (const PassedPlace& place : places) {
    const double truth_m = tiltedPlane(GetParam(), kWall_m, kTilt_rad)(place.column, place.row);
    EXPECT_NEAR(place.distance_m, truth_m, GetParam().noise.sigma_m(truth_m));
    for (int frame = 0; frame < kFrames; ++frame) {
      EXPECT_EQ(place.covered[static_cast<std::size_t>(frame)],
                frame >= kFirstArmFrame && frame <= kLastArmFrame)
          << frame;
    }
    const Vec3 hip = place.point.position_m + 0.03 * place.point.normal;
    const Vec3 at_arm = (kArm_m / place.distance_m) * place.point.position_m;
    EXPECT_FALSE(measuresNear(*made().session.frames[0], camera, place, at_arm, 0.02, -1));
    EXPECT_TRUE(measuresNear(*made().session.frames[kFirstArmFrame], camera, place, at_arm, 0.02, -1));
    EXPECT_TRUE(measuresNear(*made().session.frames[0], camera, place, hip, 0.05, -1));
  }
}

TEST_P(SessionOfACamera, FindsTheSameWhereTheCameraDoesNotStateItsNoise) {
  rt::DepthModelParameters silent = GetParam();
  silent.noise = {};
  BenchSequence session = sessionOf(GetParam());
  for (auto& frame : session.frames) frame->camera = silent;
  const rt::DepthModelParameters measured = cameraWithNoise(session);
  // a share of the pixels is that of the arm for some frames: they do not rest, but are few
  EXPECT_NEAR(measured.noise.sigma_m(1) / GetParam().noise.sigma_m(1), 1, 0.2);
  EXPECT_NEAR(measured.noise.correlation_px, GetParam().noise.correlation_px, 1);
  const CameraDisparity camera(measured);
  const auto surfaces = restingSurfaces(pixelStatistics(session, camera), session.frames.size(), camera,
                                        {.sizes_m = {0.16, 0.32}});
  EXPECT_EQ(surfaces.size(), made().surfaces().size());
}

INSTANTIATE_TEST_SUITE_P(Kinds, SessionOfACamera, testing::Values(stereo(), timeOfFlight()),
                         [](const auto& camera) { return std::string(rt::wordOf(camera.param.principle)); });

// Means of five frames differ by 0.63 deviations of a pixel, and the limit is four times that.
TEST(PixelStatistics, RestInAShortSessionWhoseNoiseIsAnotherInEachFrame) {
  rt::DepthModelParameters parameters = timeOfFlight();
  parameters.noise.standing_share = 0;
  FrameSequence frames(parameters, tiltedPlane(parameters, kWall_m, kTilt_rad), 7);
  BenchSequence session{"short", {}};
  for (int i = 0; i < 10; ++i) session.frames.push_back(frames.next());
  const CameraDisparity camera(parameters);
  const auto pixels = pixelStatistics(session, camera);
  EXPECT_EQ(pixels.size(), std::size_t{640} * 576);
  const auto at_rest =
      std::ranges::count_if(pixels, [](const PixelStatistics& pixel) { return rests(pixel, 10); });
  EXPECT_GT(static_cast<double>(at_rest), 0.999 * static_cast<double>(pixels.size()));
}

TEST(PlayedSession, KeepsTheTimesOfArrivalOfOtherCameras) {
  BenchSequence session{"gap", {}};
  for (const std::int64_t ms : {5, 16, 50, 66}) {
    session.frames.push_back(std::make_unique<rt::DepthFrame>());
    session.frames.back()->camera = timeOfFlight();
    session.frames.back()->arrival_ns = ms * 1'000'000;
    session.frames.back()->device_ticks = static_cast<std::uint32_t>(ms);  // in a unit that is not known
  }
  EXPECT_EQ(arrivalTicks(session), (std::vector<long>{0, 11, 45, 61}));
}

TEST(CameraDisparity, IsTheRawValueOfAKinect) {
  const CameraDisparity camera(rt::DepthModelParameters{});
  for (std::uint16_t raw = 0; raw < 2047; ++raw) EXPECT_EQ(camera.of(raw), static_cast<float>(raw));
  for (const int raw : {2047, 2048, 65535})
    EXPECT_TRUE(std::isnan(camera.of(static_cast<std::uint16_t>(raw)))) << raw;
  EXPECT_EQ(camera.noiseScale(700), 1);
}

TEST(CameraDisparity, IsTheCoresWithoutItsRounding) {
  const CameraDisparity camera(stereo());
  EXPECT_TRUE(std::isnan(camera.of(0)));
  for (std::uint32_t raw = 4000; raw <= 40000; raw += 7) {
    const auto value = static_cast<std::uint16_t>(raw);
    ASSERT_NEAR(double{camera.of(value)}, camera.model().disparityOf(value), 0.501) << raw;
    // a step of single precision at 8190 is 0.0005; one raw disparity at 4 m is 4.9 mm
    ASSERT_NEAR(camera.depth_m(double{camera.of(value)}), raw * 1e-4, 3e-6) << raw;
  }
  EXPECT_TRUE(camera.isNearer(double{camera.of(5000)}, double{camera.of(5001)}));
  EXPECT_FALSE(camera.isNearer(double{camera.of(5001)}, double{camera.of(5000)}));
  EXPECT_NEAR(camera.noiseScale(camera.ofDepth(2)), camera.model().noiseScale(2), 1e-9);
}

TEST(CameraDisparity, KnowsWhatIsNearerWhereDisparityRisesWithIt) {
  rt::DepthModelParameters rising;
  rising.a_per_m = 0.003;
  rising.b_per_m = 0;
  const CameraDisparity camera(rising);
  EXPECT_TRUE(camera.isNearer(600, 500));
  EXPECT_NEAR(camera.depth_m(500), 1 / 1.5, 1e-12);
}

rt::DepthModelParameters smallStereoCamera() {
  return stereoCamera(424, 240, 90, 0.05, 1e-4, 0.4, 4);
}

void writeRecording(const std::filesystem::path& folder, std::optional<double> near_m = {}) {
  const rt::DepthModelParameters camera = smallStereoCamera();
  test::writeDepthRecording(folder, camera, tiltedPlane(camera, 1, 0), 3, near_m);
}

/// The error of reading a folder that holds `folder`; empty without one.
std::string errorOf(const std::filesystem::path& folder) {
  const auto sequences = recordedSequences(folder.parent_path(), 10);
  return sequences ? "" : sequences.error().text();
}

TEST(RecordedSequences, AreOfTheCameraThatTheyDescribe) {
  const test::TemporaryFolder folder;
  writeRecording(folder.path() / "b plain");
  writeRecording(folder.path() / "a near", 0.07);
  std::filesystem::create_directory(folder.path() / "c empty");
  const auto sequences = recordedSequences(folder.path(), 2);
  ASSERT_TRUE(sequences) << sequences.error().text();
  ASSERT_EQ(sequences->size(), 2U);
  rt::DepthModelParameters camera = smallStereoCamera();
  EXPECT_EQ(sequences->at(1).name, "b plain");
  EXPECT_EQ(sequences->at(1).frames.size(), 2U);
  EXPECT_EQ(sequences->at(1).camera(), camera);
  EXPECT_FALSE(isKinect(sequences->at(1).camera()));
  camera.near_m = 0.07;
  EXPECT_EQ(sequences->at(0).name, "a near");
  EXPECT_EQ(sequences->at(0).camera(), camera);
}

TEST(RecordedSequences, AreOfAKinectByDefault) {
  EXPECT_TRUE(isKinect(syntheticScene().camera()));
}

TEST(RecordedSequences, NameTheFolderThatIsNoRecording) {
  const test::TemporaryFolder parent;
  const std::filesystem::path folder = parent.path() / "broken";
  writeRecording(folder);
  EXPECT_EQ(errorOf(folder), "");

  std::ofstream(folder / "INDEX.txt") << "d-1.0-1.pgm\n";
  EXPECT_NE(errorOf(folder).find((folder).string()), std::string::npos) << errorOf(folder);
  EXPECT_NE(errorOf(folder).find("holds both"), std::string::npos) << errorOf(folder);
  std::filesystem::remove(folder / "INDEX.txt");

  std::filesystem::remove(folder / "frames.csv");
  EXPECT_NE(errorOf(folder).find((folder / "frames.csv").string()), std::string::npos) << errorOf(folder);

  std::ofstream(folder / "camera.yaml") << "camera: {width_px: 7}\n";
  EXPECT_NE(errorOf(folder).find((folder / "camera.yaml").string()), std::string::npos) << errorOf(folder);
}

}  // namespace
}  // namespace hapticd::tools
