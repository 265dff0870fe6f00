// SPDX-License-Identifier: Apache-2.0
// The stage `law` against a second implementation of the paper over all pixels (tools/lib/oracle).

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/recordings/made_up_scene.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/unit/tools/replay/papers_law.h"
#include "tools/haptic-replay/replay.h"
#include "tools/lib/oracle/reference_camera.h"
#include "tools/lib/oracle/spring_oracle.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

// Both sides compute in double precision: some 100 terms below 20 N leave 1e-12 N, and the direction to a
// point 1e-9 m away, where eq. (10) still counts, is uncertain by 1e-7 of a term of 0.2 N.
constexpr double kTolerance_n = 1e-6;

constexpr std::size_t kPositions = 400;

/// A replay of one depth frame.
class ImageReplay {
 public:
  ImageReplay(const config::Settings& settings, const std::vector<std::uint16_t>& raw)
      : source_(*DepthSource::open(folder_.write("image.pgm", test::pgmBytes(raw)))),
        replay_(settings, source_, Stage::law) {}

  ReplayedForce feel(const Vec3& hip) { return replay_.feel({0, hip}).value(); }

 private:
  test::TemporaryFolder folder_;
  DepthSource source_;
  Replay replay_;
};

/// Compares at kPositions positions; returns how many of them had a force.
std::size_t expectBruteForce(const config::Settings& settings, const rt::SpringParameters& law) {
  const std::vector<std::uint16_t> raw = test::sceneImage(0);
  const std::vector<Vec3> points = pointsInCamera(raw);
  ImageReplay replay(settings, raw);
  std::size_t with_force = 0;
  for (const Vec3& hip : test::positionsNear(points, kPositions, 1)) {
    const SpringOracle expected(points, hip, law);
    const ReplayedForce replayed = replay.feel(hip);
    EXPECT_LT(expected.error_n(replayed.force_n_in_world), kTolerance_n)
        << hip.x << ' ' << hip.y << ' ' << hip.z;
    EXPECT_EQ(replayed.points_used, expected.pointsUsed());
    if (expected.pointsUsed() > 0) ++with_force;
  }
  return with_force;
}

TEST(ReplayLaw, FollowsTheFourParametersOfThePaper) {
  config::Settings settings = papersLaw();
  settings.live.force = {{.stiffness_n_per_m = 1234, .radius_m = 0.02, .min_points = 40, .max_points = 70},
                         settings.live.force.law};
  const std::size_t with_force = expectBruteForce(
      settings, {.stiffness_n_per_m = 1234, .radius_m = 0.02, .min_points = 40, .max_points = 70});
  EXPECT_GT(with_force, 50U);               // so that N_max is tested
  EXPECT_LT(with_force, kPositions - 50U);  // and N_min
}

TEST(ReplayLaw, TurnsAndMovesWithTheCamera) {
  config::Settings settings = papersLaw();
  settings.camera.setPose({{0.3, -1.2, 0.7}, 0.2, -0.5, 1.1});
  const double cr = std::cos(0.2), sr = std::sin(0.2), cp = std::cos(-0.5), sp = std::sin(-0.5),
               cy = std::cos(1.1), sy = std::sin(1.1);
  // Rz(yaw) Ry(pitch) Rx(roll), multiplied out by hand.
  const double rotation[3][3] = {{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
                                 {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
                                 {-sp, cp * sr, cp * cr}};
  const auto turned = [&rotation](const Vec3& v) {
    const auto row = [&v](const double(&r)[3]) { return r[0] * v.x + r[1] * v.y + r[2] * v.z; };
    return Vec3{row(rotation[0]), row(rotation[1]), row(rotation[2])};
  };

  const std::vector<std::uint16_t> raw = test::sceneImage(0);
  const std::vector<Vec3> points_in_camera = pointsInCamera(raw);
  std::vector<Vec3> points;
  for (const Vec3& point : points_in_camera) {
    points.push_back(turned(point) + Vec3{0.3, -1.2, 0.7});
  }
  ImageReplay replay(settings, raw);
  const std::vector<Vec3> hips = test::positionsNear(points, kPositions, 3);
  for (std::size_t i = 0; i < kPositions; ++i) {
    if (i % 4 == 0) continue;  // on a point, where the rotation's rounding would decide the direction
    const Vec3& hip = hips[i];
    const SpringOracle expected(points, hip, {});
    const ReplayedForce replayed = replay.feel(hip);
    EXPECT_LT(expected.error_n(replayed.force_n_in_world), kTolerance_n);
    EXPECT_EQ(replayed.points_used, expected.pointsUsed());
  }
}

TEST(ReplayLaw, HasNoForceWhereNothingIsNear) {
  ImageReplay replay(papersLaw(), test::sceneImage(0));
  for (const Vec3& hip : {Vec3{0, 0, 0}, Vec3{0, 0, 1}, Vec3{9, 9, -9}}) {
    const ReplayedForce replayed = replay.feel(hip);
    EXPECT_EQ(replayed.force_n_in_world, (rt::Vec3{}));
    EXPECT_EQ(replayed.points_used, 0U);
  }
}

TEST(ReplayLaw, FeelsTheFrameOfEachTimeInWhateverOrderTheTimesCome) {
  test::ScratchRecording recording;
  std::vector<std::vector<Vec3>> points;
  for (std::uint32_t frame = 0; frame < 4; ++frame) {
    const auto raw = test::sceneImage(3 * frame);
    points.push_back(pointsInCamera(raw));
    recording.addBytes(test::pgmBytes(raw), "1500000000." + std::to_string(100 + 33 * frame), frame);
  }
  recording.writeIndex();
  const DepthSource source = *DepthSource::open(recording.path());
  Replay replay(papersLaw(), source, Stage::law);
  for (const std::size_t frame : {0U, 2U, 1U, 3U, 0U, 3U, 3U, 2U}) {
    const Vec3 hip = test::positionsNear(points[2], 2, frame).back();
    const auto replayed = replay.feel({0.033 * static_cast<double>(frame) + 0.001, hip});
    ASSERT_TRUE(replayed) << replayed.error().text();
    EXPECT_EQ(replayed->frame, frame);
    EXPECT_LT(SpringOracle(points[frame], hip, {}).error_n(replayed->force_n_in_world), kTolerance_n);
  }
}

}  // namespace
}  // namespace hapticd::tools
