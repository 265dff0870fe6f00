// SPDX-License-Identifier: Apache-2.0
// The stage `law` against a second implementation of the paper over all pixels (tools/lib/oracle), and the
// stage `command`: the law's force after the safety chain, at the times of the samples.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "config/settings/settings.h"
#include "tests/support/recordings/made_up_scene.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tools/haptic-replay/replay.h"
#include "tools/lib/oracle/reference_camera.h"
#include "tools/lib/oracle/spring_oracle.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// Returns the default settings with the paper's law, whose force brute force over all points verifies.
config::Settings papersLaw() {
  config::Settings settings;
  settings.live.force.law = rt::ForceLaw::nearest_springs;
  return settings;
}

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

namespace {

// Sums of a few hundred numbers below 10 N in double precision; times of some seconds in whole nanoseconds
// make the slew limit's step uncertain by 1e-9 s * 500 N/s.
constexpr double kCommandTolerance_n = 1e-6;

config::Settings slewLimited() {
  config::Settings settings = papersLaw();
  settings.live.safety.max_slew_n_per_s = 500;
  return settings;
}

constexpr std::uint16_t kWallRaw = 760;  // 1.003 m
const Vec3 kHip{0.01, 0.02, -0.98};      // 23 mm in front of it

/// The points of the wall that the replay sees.
std::vector<Vec3> wallPoints() {
  return pointsInCamera(test::wallImage(kWallRaw));
}

/// The force that the law has at kHip, longer than the limits of the tests.
const Vec3& lawForce() {
  static const Vec3 force_n = SpringOracle(wallPoints(), kHip, {}).force_n();
  return force_n;
}

class ReplayCommand : public testing::Test {
 protected:
  /// A replay of the wall, with the image for all times.
  void openImage(const config::Settings& settings) {
    open(settings, folder_.write("wall.pgm", test::pgmBytes(test::wallImage(kWallRaw))));
  }

  void open(const config::Settings& settings, const std::filesystem::path& depth) {
    source_ = std::make_unique<DepthSource>(*DepthSource::open(depth));
    replay_ = std::make_unique<Replay>(settings, *source_, Stage::command);
  }

  Vec3 commandAt(double time_s, const Vec3& hip = kHip) {
    return replay_->feel({time_s, hip}).value().force_n_in_world;
  }

  /// Along the law's force, that long.
  static void expectAlongTheLaw(const Vec3& command, double length_n, double time_s) {
    const Vec3& law = lawForce();
    const double factor = length_n / norm(law);
    EXPECT_NEAR(command.x, factor * law.x, kCommandTolerance_n) << time_s;
    EXPECT_NEAR(command.y, factor * law.y, kCommandTolerance_n) << time_s;
    EXPECT_NEAR(command.z, factor * law.z, kCommandTolerance_n) << time_s;
  }

  test::TemporaryFolder folder_;
  std::unique_ptr<DepthSource> source_;
  std::unique_ptr<Replay> replay_;
};

TEST_F(ReplayCommand, RisesAtTheSlewLimitToTheLargestForceAndStaysThere) {
  ASSERT_GT(norm(lawForce()), 4.5);  // beyond the limit of 4 N
  openImage(slewLimited());
  for (int sample = 0; sample < 20; ++sample) {
    const double time_s = 0.001 * sample;
    // 500 N/s for one millisecond are 0.5 N
    expectAlongTheLaw(commandAt(time_s), std::min(0.5 * (sample + 1), 4.0), time_s);
  }
}

TEST_F(ReplayCommand, MeasuresTheSlewLimitByTheTimeBetweenTheSamples) {
  openImage(slewLimited());
  // The first sample counts as one period of the loop, 1 ms.
  expectAlongTheLaw(commandAt(5), 0.5, 5);
  expectAlongTheLaw(commandAt(5.002), 1.5, 5.002);
  expectAlongTheLaw(commandAt(5.0025), 1.75, 5.0025);
  expectAlongTheLaw(commandAt(5.0025), 1.75, 5.0025);
  expectAlongTheLaw(commandAt(5.0055), 3.25, 5.0055);
}

TEST_F(ReplayCommand, IsTheBareLawWhereNoLimitActs) {
  config::Settings settings = papersLaw();
  settings.live.safety.max_force_n = 40;
  settings.live.safety.max_slew_n_per_s = 20000;
  openImage(settings);
  expectAlongTheLaw(commandAt(0), norm(lawForce()), 0);
}

/// Limits far away.
config::Settings unlimited(config::Settings settings) {
  settings.live.safety.max_force_n = 40;
  settings.live.safety.continuous_force_n = 40;
  settings.live.safety.max_slew_n_per_s = 20000;
  settings.live.safety.passivity_control = false;
  return settings;
}

// A plane 1.003 m away; the HIP comes nearer at 0.1 m/s, 1 ms per sample, 4 mm deep at the end. The spring
// gives 500 N/m * depth, the damping 1.75 * 500 N/m * (0.5 ms + delay) * 0.1 m/s.
TEST_F(ReplayCommand, DampsByTheVelocityOfTheSamples) {
  for (const double delay_s : {0.0, 0.004}) {
    config::Settings settings = unlimited(config::Settings{});
    settings.live.force.law = rt::ForceLaw::proxy;
    settings.handle.driver = "udp";
    const auto lengthWith = [&](rt::ContactDamping damping) {
      settings.live.safety.contact_damping = damping;
      source_ = std::make_unique<DepthSource>(
          *DepthSource::open(folder_.write("wall.pgm", test::pgmBytes(test::wallImage(kWallRaw)))));
      replay_ = std::make_unique<Replay>(settings, *source_, Stage::command, delay_s);
      Vec3 last;
      for (int sample = 0; sample <= 600; ++sample) {
        last = commandAt(0.001 * sample, {0.01, 0.02, -1.003 + 0.056 - 1e-4 * sample});
      }
      return norm(last);
    };
    const double bare_n = lengthWith(rt::ContactDamping::off);
    const double damped_n = lengthWith(rt::ContactDamping::automatic);
    EXPECT_NEAR(bare_n, 2, 0.5) << "pressed in by 4 mm, and the wall is where raw units round it to";
    // the estimator is exact at constant velocity but for rounding of 1e-12 m in 1 ms
    EXPECT_NEAR(damped_n - bare_n, 1.75 * 500 * (0.0005 + delay_s) * 0.1, 1e-6) << delay_s;
  }
}

// A loop that lags feeds a swing: passivity control must see the motion to damp it.
TEST_F(ReplayCommand, BooksTheEnergyThatTheHandGets) {
  config::Settings settings = unlimited(config::Settings{});
  settings.live.force.law = rt::ForceLaw::proxy;
  settings.live.safety.contact_damping = rt::ContactDamping::off;
  const auto swing = [&](bool controlled) {
    settings.live.safety.passivity_control = controlled;
    source_ = std::make_unique<DepthSource>(
        *DepthSource::open(folder_.write("wall.pgm", test::pgmBytes(test::wallImage(kWallRaw)))));
    replay_ = std::make_unique<Replay>(settings, *source_, Stage::command, 0.01);
    std::vector<Vec3> forces;
    for (int sample = 0; sample <= 1000; ++sample) {  // 20 Hz, to and fro over 4 mm
      const double out_m = 0.002 * std::sin(2 * 3.14159265 * 0.02 * sample);
      forces.push_back(commandAt(0.001 * sample, {0.01, 0.02, -1.003 - 0.002 + out_m}));
    }
    return forces;
  };
  EXPECT_NE(swing(true), swing(false));
}

TEST_F(ReplayCommand, IsZeroWhereNoForceIsPermitted) {
  config::Settings settings = papersLaw();
  settings.live.safety.max_force_n = 0;
  openImage(settings);
  for (int sample = 0; sample < 10; ++sample) EXPECT_EQ(commandAt(0.001 * sample), (Vec3{}));
}

TEST_F(ReplayCommand, NeverStepsBeyondTheSlewLimitNorTheLargestForceWhereverTheHipJumps) {
  openImage(slewLimited());
  const auto points = wallPoints();
  Vec3 last;
  double time_s = 0;
  for (const Vec3& hip : test::positionsNear(points, 300, 5)) {
    const Vec3 command = commandAt(time_s, hip);
    EXPECT_LE(norm(command - last), 0.5 + kCommandTolerance_n);  // 500 N/s for 1 ms
    EXPECT_LE(norm(command), 4 + kCommandTolerance_n);
    last = command;
    time_s += 0.001;
  }
}

TEST_F(ReplayCommand, FallsToZeroWhenTheRecordingHasEndedForLongerThanTheDepthTimeout) {
  test::ScratchRecording recording;
  const auto image = recording.addBytes(test::pgmBytes(test::wallImage(kWallRaw)), "1500000000.000000", 1000);
  recording.addLink(image, "1500000000.100000", 2000);
  recording.writeIndex();
  config::Settings settings = papersLaw();
  settings.live.safety.depth_timeout_s = 0.3;
  settings.live.safety.depth_ramp_s = 0.01;
  settings.live.safety.max_slew_n_per_s = 50;
  open(settings, recording.path());

  for (int sample = 0; sample <= 60; ++sample) {
    const double time_s = 0.01 * sample;
    const Vec3 command = commandAt(time_s);
    // 50 N/s for 10 ms are 0.5 N; the first sample counts as 1 ms. The newest frame is from 0.1 s: up to
    // 0.4 s it is fresh.
    if (sample <= 40) {
      expectAlongTheLaw(command, std::min(0.05 + 0.5 * sample, 4.0), time_s);
    } else if (sample < 48) {
      expectAlongTheLaw(command, 4.0 - 0.5 * (sample - 40), time_s);
    } else {
      EXPECT_NEAR(norm(command), 0, sample == 48 ? kCommandTolerance_n : 0) << time_s;
    }
  }
}

TEST_F(ReplayCommand, ReportsThePointsOfTheLaw) {
  openImage(papersLaw());
  EXPECT_EQ(replay_->feel({0, kHip}).value().points_used, 100U);
}

}  // namespace
}  // namespace hapticd::tools
