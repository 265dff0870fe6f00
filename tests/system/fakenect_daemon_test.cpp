// SPDX-License-Identifier: Apache-2.0
// The main job: hapticd on a recording that the real libfreenect's player delivers, controlled with
// hapticctl.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>

#include "tests/support/recordings/depth_images.h"
#include "tests/support/recordings/made_up_scene.h"
#include "tests/support/recordings/recording.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/system/support/daemon_under_test.h"
#include "tools/lib/oracle/reference_camera.h"
#include "tools/lib/oracle/spring_oracle.h"

namespace hapticd {
namespace {

using nlohmann::json;
using rt::Vec3;
using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;
using test::Finished;

constexpr std::uint16_t kWallRaw = 760;    // 1.003 m
constexpr double kCoreTolerance_n = 1e-4;  // required of the core

test::ProgramOptions fakenect(const std::filesystem::path& recording) {
  const std::string player = HAPTICD_FAKENECT_FOLDER;
  EXPECT_TRUE(std::filesystem::exists(player + "/libfreenect.so.0.5"))
      << "libfreenect's player is part of the Debian package libfreenect0.5";
  return {.environment = {"LD_LIBRARY_PATH=" + player, "FAKENECT_PATH=" + recording.string()}};
}

/// Host seconds of image `number` when there are `rate_hz` in a second.
std::string hostSeconds(std::uint32_t number, std::uint32_t rate_hz) {
  const std::uint32_t thousandths = number * 1000 / rate_hz;
  const std::string fraction = std::to_string(1000 + thousandths % 1000).substr(1);
  return std::to_string(1'500'000'000 + thousandths / 1000) + "." + fraction;
}

/// A recording of a wall that ends after `images` at 10 Hz.
class WallRecording : public test::ScratchRecording {
 public:
  explicit WallRecording(std::uint32_t images) {
    const auto first = addBytes(test::pgmBytes(test::wallImage(kWallRaw)), hostSeconds(0, 10), 0);
    for (std::uint32_t image = 1; image < images; ++image) addLink(first, hostSeconds(image, 10), image);
    writeIndex();
  }
};
constexpr std::uint32_t kLongerThanATest = 1200;  // 2 minutes; linked, so that the disk holds one image

/// hapticd on a wall, played by the real libfreenect.
class FakenectDaemon : public testing::Test {
 protected:
  bool start(const std::vector<std::string>& set = {}) {
    std::vector<std::string> all{"camera.driver=freenect"};
    all.insert(all.end(), set.begin(), set.end());
    daemon_ = std::make_unique<Daemon>(home_, test::kWallYaml, all, fakenect(recording_.path()));
    return daemon_->answers() && daemon_->reaches([](const json& status) {
      return status.at("camera").at("state") == "streaming" && status.at("tick").at("pointsUsed") == 100;
    });
  }

  Finished control(const std::vector<std::string>& arguments) const { return home_.control(arguments); }

  json value(const std::string& parameter) const {
    const Finished finished = control({"--json", "get", parameter});
    EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
    return json::parse(finished.output).at("parameters").at(0).at("value");
  }

  /// Expects that the law's force in `status` is that of the paper at its HIP, with that stiffness.
  void expectPaperForce(const json& status, double stiffness_n_per_m) const {
    const json& tick = status.at("tick");
    const tools::SpringOracle expected(points_, test::vectorOf(tick.at("hipMInWorld")),
                                       {.stiffness_n_per_m = stiffness_n_per_m});
    EXPECT_EQ(tick.at("pointsUsed"), expected.pointsUsed());
    EXPECT_LT(expected.error_n(test::vectorOf(tick.at("lawForceNInWorld"))), kCoreTolerance_n) << tick.dump();
    EXPECT_GT(norm(expected.force_n()), 0.1);  // there is something to compare
  }

  const WallRecording recording_{kLongerThanATest};
  const std::vector<Vec3> points_ = tools::pointsInCamera(test::wallImage(kWallRaw));
  const DaemonHome home_;
  std::unique_ptr<Daemon> daemon_;
};

TEST_F(FakenectDaemon, StreamsTicksAndFeelsTheRecordedWall) {
  ASSERT_TRUE(start());
  const json before = daemon_->status();
  EXPECT_TRUE(daemon_->reaches([&before](const json& status) {
    return status.at("loop").at("counters").at("ticks") > before.at("loop").at("counters").at("ticks") &&
           status.at("camera").at("frames") > before.at("camera").at("frames") &&
           status.at("scene").at("frames") > before.at("scene").at("frames") &&
           status.at("tick").at("sceneFrame") > before.at("tick").at("sceneFrame");
  }));
  expectPaperForce(before, 500);
  expectPaperForce(daemon_->status(), 500);
  EXPECT_EQ(daemon_->terminate(), exitedWith(0));
  EXPECT_EQ(home_.entries(), std::vector<std::string>{"hapticd.yaml"});
}

TEST_F(FakenectDaemon, AParameterThatIsSetIsSeenInItsValueAndInTheForce) {
  ASSERT_TRUE(start());
  expectPaperForce(daemon_->status(), 500);
  const Finished finished = control({"set", "force.stiffness_n_per_m=250"});
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(contains(finished.output, "force.stiffness_n_per_m: 500 -> 250 N/m"));
  EXPECT_EQ(value("force.stiffness_n_per_m"), 250);
  // The answer came after the force loop had taken the value: no tick from here on has the old one.
  expectPaperForce(daemon_->status(), 250);
}

TEST_F(FakenectDaemon, ForceComesWithEngageAndGoesWithDisengage) {
  ASSERT_TRUE(start());
  const json idle = daemon_->status();
  EXPECT_EQ(idle.at("mode"), "idle");
  EXPECT_EQ(test::lengthOf(idle.at("tick").at("commandForceNInWorld")), 0);

  EXPECT_EQ(control({"engage"}).ending, exitedWith(0));
  double largest_n = 0;
  EXPECT_TRUE(daemon_->reaches([&largest_n](const json& status) {
    const double force_n = test::lengthOf(status.at("tick").at("commandForceNInWorld"));
    largest_n = std::max(largest_n, force_n);
    return status.at("mode") == "engaged" && force_n > 1;
  }));
  EXPECT_LE(largest_n, 4 + 1e-9);  // safety.max_force_n, and the rounding of a double

  EXPECT_EQ(control({"disengage"}).ending, exitedWith(0));
  EXPECT_TRUE(daemon_->reaches([](const json& status) {
    return status.at("mode") == "idle" && test::lengthOf(status.at("tick").at("commandForceNInWorld")) == 0;
  }));
  // The hand is in contact, but no force is commanded any more.
  expectPaperForce(daemon_->status(), 500);
}

TEST(FakenectDaemonAtTheEnd, ShowsTheCameraAsLostHoldsWithoutForceAndLivesOn) {
  const WallRecording recording(20);
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml,
                {"camera.driver=freenect", "control.engage_at_start=true", "safety.depth_timeout_s=0.5"},
                fakenect(recording.path()));
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const json& status) {
    return status.at("camera").at("state") == "lost" && status.at("mode") == "holding" &&
           status.at("cause") == "depth_stale" &&
           test::lengthOf(status.at("tick").at("commandForceNInWorld")) == 0;
  }));
  const json status = daemon.status();
  EXPECT_EQ(status.at("camera").at("frames"), 20);
  EXPECT_TRUE(contains(status.at("warnings").dump(), "camera lost"));
  EXPECT_TRUE(contains(home.control({"status"}).output, "lost"));
  EXPECT_TRUE(daemon.ticks());
  EXPECT_EQ(home.control({"set", "force.stiffness_n_per_m=300"}).ending, exitedWith(0));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  EXPECT_FALSE(daemon.leftProcesses());
  EXPECT_EQ(home.entries(), std::vector<std::string>{"hapticd.yaml"});
}

std::vector<std::filesystem::path> imagesOf(const test::Recording& recording) {
  std::vector<std::filesystem::path> images;
  std::ifstream index(recording.path() / "INDEX.txt");
  for (std::string name; std::getline(index, name);) {
    if (name.starts_with("d-")) images.push_back(recording.path() / name);
  }
  return images;
}

/// A point of the first image with many others around it, whatever the later images show there.
Vec3 denseSurfacePoint(const std::vector<Vec3>& points) {
  for (const Vec3& candidate : test::positionsNear(points, 400, 11)) {
    if (tools::SpringOracle(points, candidate, {}).pointsUsed() == 100) return candidate;
  }
  throw std::runtime_error("no surface");
}

TEST(FakenectDaemonOnARecording, FeelsThePaperForceOfTheFrameThatItNames) {
  const test::Recording recording("03_raw11_room_static/room_static.tar.xz");
  const auto images = imagesOf(recording);
  ASSERT_FALSE(images.empty());
  test::ScratchRecording slow;  // over and over, at 10 Hz, so that there is time to ask
  for (std::uint32_t i = 0; i < kLongerThanATest; ++i) {
    slow.addLink(images[i % images.size()], hostSeconds(i, 10), i);
  }
  slow.writeIndex();

  const Vec3 hip = denseSurfacePoint(tools::pointsInCamera(test::rawPixelsOf(images.front())));
  const auto start = [](const char* axis, double metres) {
    return std::string("simulated_handle.start_") + axis + "_m=" + std::to_string(metres);
  };
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml,
                {"camera.driver=freenect", start("x", hip.x), start("y", hip.y), start("z", hip.z)},
                fakenect(slow.path()));
  ASSERT_TRUE(daemon.answers());
  std::size_t compared = 0;
  EXPECT_TRUE(daemon.reaches([&](const json& status) {
    const json& tick = status.at("tick");
    if (tick.at("sceneFrame") == 0 || tick.at("pointsUsed") == 0) return false;
    const std::size_t frame = tick.at("sceneFrame").get<std::size_t>() - 1;
    const auto points = tools::pointsInCamera(test::rawPixelsOf(images.at(frame % images.size())));
    const tools::SpringOracle expected(points, test::vectorOf(tick.at("hipMInWorld")), {});
    EXPECT_EQ(tick.at("pointsUsed"), expected.pointsUsed());
    EXPECT_LT(expected.error_n(test::vectorOf(tick.at("lawForceNInWorld"))), kCoreTolerance_n) << tick.dump();
    return ++compared == 10;
  }));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

}  // namespace
}  // namespace hapticd
