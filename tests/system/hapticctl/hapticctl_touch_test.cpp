// SPDX-License-Identifier: Apache-2.0
// Fixtures and the camera's pose by touch: a person at a terminal, a hand at a device, and files of points.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "drivers/handle/udp/udp_settings.h"
#include "drivers/handle/udp/udp_socket.h"
#include "rt/base/vec3.h"
#include "tests/support/file_content.h"
#include "tests/system/support/bridge_log.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/terminal_program.h"
#include "tools/lib/bridge/bridge.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::test {
namespace {

using nlohmann::json;
using rt::Vec3;

/// A hand that is where the test puts it, at a device behind haptic-bridge.
class PlacedHand : private tools::Device {
 public:
  /// It begins where `start_m` is.
  explicit PlacedHand(const rt::Vec3& start_m);
  ~PlacedHand() override;

  /// What a configuration has to contain for a daemon that this hand shall reach.
  static std::string yaml();
  /// Glides to a place, rests there, and waits until the daemon has it there.
  bool reaches(Daemon& daemon, const rt::Vec3& position_m);
  void holdButton(bool held) { button_ = held; }
  /// Goes to and fro by this much along x until it glides to another place.
  void tremble(double metres) { tremble_m_ = metres; }

 private:
  tools::DeviceReading read() override;
  void exert(const tools::DeviceCommand& /*command*/) override {}
  tools::DeviceLimits limits() const override { return {.force_n = 10}; }

  std::mutex mutex_;
  rt::Vec3 position_m_;
  rt::Vec3 aim_m_;
  std::atomic<bool> button_ = false;
  std::atomic<double> tremble_m_ = 0;
  std::uint64_t readings_ = 0;
  drivers::udp::UdpSocket socket_;
  tools::Bridge bridge_;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

constexpr int kDaemonPort = 47800;
constexpr int kHandPort = 47801;
/// Between two readings, which are a millisecond apart: slower than what counts as a leap.
constexpr double kStep_m = 0.0005;

drivers::Ipv4Endpoint endpoint(int host, int port) {
  return *drivers::ipv4EndpointFrom(fmt::format("{}:{}", ownLoopback(host), port));
}

drivers::udp::UdpSocket openSocket() {
  auto socket = drivers::udp::UdpSocket::boundTo(endpoint(2, kHandPort));
  if (!socket) throw std::runtime_error(socket.error().text());
  return std::move(*socket);
}

tools::BridgeOptions optionsOf() {
  tools::BridgeOptions options;
  options.peer = endpoint(1, kDaemonPort);
  options.local = endpoint(2, kHandPort);
  return options;
}

PlacedHand::PlacedHand(const rt::Vec3& start_m)
    : position_m_(start_m),
      aim_m_(start_m),
      socket_(openSocket()),
      bridge_(optionsOf(), socket_, *this, nullptr),
      thread_([this] { bridge_.run([this](double) { return ends_.load(); }); }) {}

PlacedHand::~PlacedHand() {
  ends_ = true;
  thread_.join();
}

std::string PlacedHand::yaml() {
  return fmt::format("handle: {{driver: udp}}\nudp_handle: {{address: {}, peer: '{}:{}'}}\n", ownLoopback(1),
                     ownLoopback(2), kHandPort);
}

bool PlacedHand::reaches(Daemon& daemon, const rt::Vec3& position_m) {
  {
    const std::lock_guard lock(mutex_);
    aim_m_ = position_m;
    tremble_m_ = 0;
  }
  return daemon.reaches([&](const nlohmann::json& status) {
    return status.at("handle").at("state") == "present" &&
           rt::norm(vectorOf(status.at("tick").at("hipMInWorld")) - position_m) < 1e-6;
  });
}

tools::DeviceReading PlacedHand::read() {
  const std::lock_guard lock(mutex_);
  const rt::Vec3 to_aim_m = aim_m_ - position_m_;
  const double distance_m = rt::norm(to_aim_m);
  position_m_ = distance_m <= kStep_m ? aim_m_ : position_m_ + (kStep_m / distance_m) * to_aim_m;
  tools::DeviceReading reading;
  reading.position_m = position_m_;
  constexpr int kHalfPeriod = 100;
  if (++readings_ / kHalfPeriod % 2 == 0) reading.position_m.x += tremble_m_;
  reading.buttons = button_ ? 2 : 0;
  return reading;
}

/// A wall 1 m before a camera that stands 0.5 m along x of the world's origin.
const std::string kYaml = PlacedHand::yaml() +
                          "camera: {driver: synthetic, position_x_m: 0.5}\n"
                          "synthetic: {scene: plane, noise: off, distance_m: 1}\n";

class HapticctlTouch : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(daemon.answers()); }

  /// An answer at the terminal: Enter, once the hand rests at the place.
  struct Touch {
    std::string asked;  ///< part of the question
    Vec3 place_m;
    std::function<void()> before_enter = [] {};
    std::function<void()> after_enter = [] {};
  };

  /// Where this machine holds the hand's packets up for 100 ms, the handle counts as lost; then a command
  /// runs again.
  static constexpr int kMaxRuns = 10;
  static bool isLost(const std::string& said) { return said.find("the handle is lost") != std::string::npos; }

  /// Runs a command at a terminal, answers its questions and returns what it said.
  std::string answered(const std::vector<std::string>& arguments, const std::vector<Touch>& touches) {
    for (int run = 0; run < kMaxRuns; ++run) {
      TerminalProgram command(home.controlCommand(arguments), {}, 24, 200);
      for (const Touch& touch : touches) {
        EXPECT_TRUE(becomesTrue([&] {
          const std::string& said = command.output();
          return said.find(touch.asked) != std::string::npos || isLost(said);
        })) << command.output();
        if (isLost(command.output())) break;
        EXPECT_TRUE(hand.reaches(daemon, touch.place_m));
        touch.before_enter();
        command.press('\r');
        touch.after_enter();
      }
      const Ending ending = command.wait();
      if (isLost(command.output())) continue;
      EXPECT_EQ(ending, exitedWith(0)) << command.output();
      return command.output();
    }
    ADD_FAILURE() << "the handle is lost again and again";
    return {};
  }
  std::string refusal(const std::vector<std::string>& arguments, const std::string& input = "") const {
    Finished refused = home.controlWithInput(input, arguments);
    for (int run = 1; run < kMaxRuns && isLost(refused.errors); ++run)
      refused = home.controlWithInput(input, arguments);
    EXPECT_EQ(refused.ending, exitedWith(1)) << refused.output;
    return refused.errors;
  }
  json fixture(const std::string& name) const {
    return json::parse(home.control({"--json", "fixture", "show", name}).output).at("definition");
  }

  const DaemonHome home;
  Daemon daemon{home, kYaml};
  PlacedHand hand{{0.5, 0, -0.9}};
};

constexpr const char* kModel =
    "fixtures:\n"
    "  - {name: bone, kind: box, position_m: [0.1, 0, 0], size_m: [0.02, 0.04, 0.06]}\n"
    "  - {name: entry, kind: plane, position_m: [0, 0, 0], normal: [1, 0, 0]}\n"
    "landmarks:\n"
    "  - {name: tip, position_m: [0, 0, 0]}\n"
    "  - {name: left, position_m: [0.1, 0, 0]}\n"
    "  - {name: top, position_m: [0, 0.1, 0]}\n";

/// Where the model's landmarks are after a quarter turn about z, 1 m before the camera.
constexpr std::array<Vec3, 3> kTurned_m{Vec3{0, 0, -1}, Vec3{0, 0.1, -1}, Vec3{-0.1, 0, -1}};

TEST_F(HapticctlTouch, AModelIsMovedToWhereItsLandmarksAreTouchedAndTheyAreKept) {
  const std::string model = home.write("model.yaml", kModel);
  const std::string kept = home.path() / "kept.yaml";
  const std::string said = answered(
      {"fixture", "import", model, "--landmarks", model, "--save-measured", kept},
      {{"touch 'tip'", kTurned_m[0]}, {"touch 'left'", kTurned_m[1]}, {"touch 'top'", kTurned_m[2]}});
  EXPECT_TRUE(contains(said, "expected error at the centre"));
  EXPECT_TRUE(contains(said, "imported 2 fixtures"));
  const json bone = fixture("bone");
  EXPECT_NEAR(bone["position_m"][1].get<double>(), 0.1, 1e-6);
  EXPECT_NEAR(bone["position_m"][2].get<double>(), -1, 1e-6);
  EXPECT_NEAR(bone["rotation_deg"][2].get<double>(), 90, 1e-3);
  EXPECT_NEAR(fixture("entry")["normal"][1].get<double>(), 1, 1e-6);

  EXPECT_EQ(home.control({"fixture", "import", model, "--landmarks", model, "--measured", kept, "--replace"})
                .ending,
            exitedWith(0));
}

TEST_F(HapticctlTouch, APlaneIsTouched) {
  const std::string said = answered(
      {"fixture", "touch", "wall", "--kind", "plane", "--points", "3", "--stiffness-n-per-m", "400"},
      {{"point 1 of 3", {0.5, 0, -1}}, {"point 2 of 3", {0.6, 0, -1}}, {"point 3 of 3", {0.5, 0.1, -1}}});
  EXPECT_TRUE(contains(said, "root mean square"));
  const json wall = fixture("wall");
  EXPECT_NEAR(wall["normal"][2].get<double>(), 1, 1e-6) << "towards the camera";
  EXPECT_EQ(wall["stiffness_n_per_m"], 400);
}

TEST_F(HapticctlTouch, APathIsStrokedWhileAButtonIsHeld) {
  const auto stroke = [this] {
    hand.holdButton(true);
    EXPECT_TRUE(hand.reaches(daemon, {0.6, 0, -0.9}));
    EXPECT_TRUE(hand.reaches(daemon, {0.6, 0.1, -0.9}));
    hand.holdButton(false);
  };
  const std::string said =
      answered({"fixture", "touch", "cut", "--kind", "path"},
               {{.asked = "hold a button", .place_m = {0.5, 0, -0.9}, .after_enter = stroke}});
  EXPECT_TRUE(contains(said, "simplified within 1.00 mm"));
  // how often it reads the hand depends on this machine, but each point of the path was read
  const json points = fixture("cut")["points_m"];
  ASSERT_GE(points.size(), 2U) << points;
  for (const json& point : points) {
    const double off_first_m = std::abs(point[1].get<double>());
    const double off_second_m = std::abs(point[0].get<double>() - 0.6);
    EXPECT_LT(std::fmin(off_first_m, off_second_m), 1e-3) << point;
  }
}

// --- the camera's pose

constexpr const char* kMarks = "name,column_px,row_px\na,100,100\nb,500,100\nc,300,400\n";

/// What a landmark of the picture is on the wall, in the world.
Vec3 onTheWall(double column_px, double row_px) {
  return {0.5 + (column_px - 339.307810) / 594.214342, -(row_px - 242.739138) / 591.040537, -1};
}

TEST_F(HapticctlTouch, TheCameraIsFoundByTouchingWhatItSeesAndAMovingHandTouchesAgain) {
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["camera"]["state"] == "streaming"; }));
  const std::string said = answered({"register", "--landmarks", home.write("marks.csv", kMarks)},
                                    {{"touch 'a'", onTheWall(100, 100)},
                                     {.asked = "touch 'b'",
                                      .place_m = onTheWall(500, 100),
                                      .before_enter = [this] { hand.tremble(0.008); }},
                                     {"touch it again", onTheWall(500, 100)},
                                     {"touch 'c'", onTheWall(300, 400)}});
  EXPECT_TRUE(contains(said, "the handle moved by "));
  EXPECT_TRUE(contains(said, "mm within a second, at most 2 mm are allowed"));
  const json pose = json::parse(home.control({"--json", "register", "--show"}).output)["calibration"];
  // the picture's steps of depth are about 3 mm at 1 m
  EXPECT_NEAR(pose["waiting"]["xM"].get<double>(), 0.5, 0.005) << pose;
  EXPECT_NEAR(pose["waiting"]["yM"].get<double>(), 0, 0.005) << pose;
  EXPECT_NEAR(pose["waiting"]["zM"].get<double>(), 0, 0.005) << pose;
}

TEST_F(HapticctlTouch, ARegistrationThatIsGivenUpOrOfOnePlaceChangesNothing) {
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["camera"]["state"] == "streaming"; }));
  const std::vector<std::string> command{"register", "--landmarks", home.write("marks.csv", kMarks)};
  EXPECT_TRUE(contains(refusal(command, "\nq\n"), "given up"));
  EXPECT_TRUE(contains(refusal(command, ""), "given up"));
  EXPECT_TRUE(contains(refusal(command, "\n\n\n"), "the world's points lie on a line: 0.0 mm across it"));
  const json pose = json::parse(home.control({"--json", "register", "--show"}).output)["calibration"];
  EXPECT_TRUE(pose["waiting"].is_null()) << pose;
}

TEST(HapticctlTouchWithoutDepth, NamesTheLandmarksThatHaveNone) {
  const DaemonHome home;
  Daemon daemon(home, kWallYaml, {"synthetic.distance_m=5"});
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["camera"]["frames"] > 0; }));
  const std::string marks = home.write("marks.csv", "name,column_px,row_px\na,100,0\nb,500,100\nc,300,400\n");
  const Finished unseen = home.control({"register", "--landmarks", marks});
  EXPECT_EQ(unseen.ending, exitedWith(1));
  for (const char* name : {"a: 0 of 15", "b: 0 of 25", "c: 0 of 25"})
    EXPECT_TRUE(contains(unseen.errors, name));
}

TEST(HapticctlTouchWithoutAHand, NamesTheHandleThatIsAbsentAndTheLandmarksWithoutDepth) {
  const DaemonHome home;
  Daemon daemon(home, kYaml);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["camera"]["state"] == "streaming"; }));
  const Finished absent =
      home.controlWithInput("\n", {"register", "--landmarks", home.write("marks.csv", kMarks)});
  EXPECT_EQ(absent.ending, exitedWith(1));
  EXPECT_TRUE(contains(absent.errors, "nothing can be touched with it"));
}

}  // namespace
}  // namespace hapticd::test
