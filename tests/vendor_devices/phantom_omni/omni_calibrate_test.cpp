// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <random>

#include "tests/vendor_devices/phantom_omni/omni_under_test.h"

// haptic-bridge calibrate phantom-omni, with a person who does what it asks for.
namespace hapticd::test {
namespace {

constexpr double kMass_kg = 0.12;

OmniModelSettings randomSettings(unsigned int seed) {
  std::mt19937 random(seed);
  OmniModelSettings settings;
  settings.n_m_per_count = randomOmniGains(random);
  return settings;
}

class OmniCalibrate : public ::testing::Test {
 protected:
  void start(const std::vector<std::string>& more = {}) {
    ASSERT_EQ(::mkfifo(fifo_.c_str(), 0600), 0);
    keyboard_ = ::open(fifo_.c_str(), O_RDWR | O_CLOEXEC);
    ASSERT_GE(keyboard_, 0);
    std::vector<std::string> command{"/bin/sh",
                                     "-c",
                                     "exec \"$0\" \"$@\" < " + fifo_.string(),
                                     HAPTIC_BRIDGE_PROGRAM,
                                     "calibrate",
                                     "phantom-omni",
                                     "--mass",
                                     fmt::format("{}", kMass_kg)};
    command.insert(command.end(), more.begin(), more.end());
    program_.emplace(command, ProgramOptions{.environment = omni_.environment()});
  }
  ~OmniCalibrate() override {
    if (keyboard_ >= 0) ::close(keyboard_);
  }

  /// Whether it asks for something that begins so; then that is done, and Enter pressed.
  bool does(const std::string& request, const std::function<void(OmniModel&)>& change) {
    const bool asked = becomesTrue(
        [&] { return program_->output().find("\n" + request) != std::string::npos || !program_->running(); });
    if (!asked || !program_->running()) return false;
    omni_.omni().change(change);
    return ::write(keyboard_, "\n", 1) == 1;
  }
  bool liesDown() {
    omni_.omni().holdAt({0, 0, 0});
    if (!becomesTrue([&] { return omni_.omni().hasArrived(); })) return false;
    omni_.omni().letGo();
    return true;
  }
  bool hangsTheMass() {
    return does("Hang", [](OmniModel& model) { model.settings.hanging_kg = kMass_kg; });
  }
  bool takesTheMassOff() {
    return does("Take the mass off", [](OmniModel& model) {
      model.settings.hanging_kg = 0;
      model.angles_rad[0] = 0;
    });
  }
  bool pullsToTheRight() {
    return does("Lead", [](OmniModel& model) { model.settings.pull_right_kg = kMass_kg; });
  }
  bool doesAll() {
    return becomesTrue([&] { return program_->output().find("\nTake everything") != std::string::npos; }) &&
           liesDown() && does("Take everything", [](OmniModel&) {}) && hangsTheMass() && takesTheMassOff() &&
           pullsToTheRight();
  }

  const OmniModelSettings settings_ = randomSettings(42);
  OmniUnderTest omni_{settings_};
  TemporaryFolder folder_{memoryFolder()};
  std::filesystem::path fifo_ = folder_.path() / "keyboard";
  int keyboard_ = -1;
  std::optional<Program> program_;
};

TEST_F(OmniCalibrate, StoresTheHiddenGainsAndTheForceIsRightFromThenOn) {
  start();
  ASSERT_TRUE(doesAll()) << program_->output() << program_->errors();
  ASSERT_EQ(program_->wait(), exitedWith(0)) << program_->output() << program_->errors();
  EXPECT_TRUE(omni_.isOff());
  EXPECT_EQ(omni_.memory().channels_taken, 0U);
  const auto read = tools::phantom_omni::readCalibration(omni_.calibrationFile(), kOmniSerial);
  ASSERT_TRUE(read && *read) << program_->output();
  // a clock that a busy computer holds up makes speeds unsteady, beyond the 1 % of OmniGains
  constexpr double kTolerance = 0.05;
  for (std::size_t joint = 0; joint < 3; ++joint)
    EXPECT_NEAR((*read)->n_m_per_count[joint] / settings_.n_m_per_count[joint], 1, kTolerance) << joint;
  EXPECT_TRUE((*read)->releases_without_packets);

  omni_.omni().change([](OmniModel& model) { model.settings.pull_right_kg = 0; });
  omni_.omni().dock();
  omni_.start();
  ASSERT_TRUE(omni_.becomesReady()) << omni_.program().errors();
  ASSERT_TRUE(omni_.bringTo({0.3, 0.6, 0.4}));
  const rt::Vec3 force_n{0.5, -1, 0.7};
  omni_.peer().command({.force_n = force_n});
  // three gains, each within kTolerance, of joints that are not at right angles
  EXPECT_TRUE(becomesTrue([&] {
    return norm(omni_.omni().force_n() - force_n) < 3 * kTolerance * norm(force_n);
  })) << norm(omni_.omni().force_n() - force_n);
}

TEST_F(OmniCalibrate, StoresThatADeviceKeepsItsTorqueAndSaysThatItIsOfUseWithoutForces) {
  omni_.omni().keepsTorque();
  start();
  ASSERT_TRUE(doesAll()) << program_->output() << program_->errors();
  EXPECT_EQ(program_->wait(), exitedWith(69)) << program_->output();
  EXPECT_NE(program_->errors().find("keeps its torque when packets stop"), std::string::npos)
      << program_->errors();
  const auto read = tools::phantom_omni::readCalibration(omni_.calibrationFile(), kOmniSerial);
  ASSERT_TRUE(read && *read);
  EXPECT_FALSE((*read)->releases_without_packets);
  EXPECT_TRUE(omni_.isOff());
}

TEST_F(OmniCalibrate, StoresNothingWhenItIsInterrupted) {
  start();
  ASSERT_TRUE(becomesTrue([&] { return program_->output().find("\nTake everything") != std::string::npos; }));
  ASSERT_TRUE(liesDown() && does("Take everything", [](OmniModel&) {}));
  ASSERT_TRUE(becomesTrue([&] { return omni_.omni().isExerting(); }));
  program_->signal(SIGINT);
  EXPECT_EQ(program_->wait(), exitedWith(69));
  EXPECT_NE(program_->errors().find("was given up"), std::string::npos) << program_->errors();
  EXPECT_TRUE(omni_.isOff()) << "by a packet";
  EXPECT_FALSE(omni_.memory().streams);
  EXPECT_FALSE(std::filesystem::exists(omni_.calibrationFile()));
}

TEST_F(OmniCalibrate, StoresNothingWhenTheDeviceIsLost) {
  start();
  ASSERT_TRUE(becomesTrue([&] { return program_->output().find("\nTake everything") != std::string::npos; }));
  ASSERT_TRUE(liesDown() && does("Take everything", [](OmniModel&) {}));
  ASSERT_TRUE(becomesTrue([&] { return omni_.omni().isExerting(); }));
  omni_.omni().resetBus();
  EXPECT_EQ(program_->wait(), exitedWith(69));
  EXPECT_NE(program_->errors().find("the FireWire bus was reset"), std::string::npos) << program_->errors();
  EXPECT_TRUE(becomesTrue([&] { return !omni_.omni().isExerting(); }));
  EXPECT_FALSE(std::filesystem::exists(omni_.calibrationFile()));
}

TEST_F(OmniCalibrate, HasItsMotorsOffWhileItWaitsForThePerson) {
  start();
  ASSERT_TRUE(becomesTrue([&] { return program_->output().find("\nTake everything") != std::string::npos; }));
  const std::uint64_t packets = omni_.memory().packets;
  ASSERT_TRUE(becomesTrue([&] { return omni_.memory().packets > packets + 100; })) << "packets go on";
  EXPECT_TRUE(omni_.isOff());
  program_->signal(SIGTERM);
  EXPECT_EQ(program_->wait(), exitedWith(69));
}

TEST_F(OmniCalibrate, TakesOnlyAMassThatItsMotorsBear) {
  for (const char* mass : {"0.019", "0.21", "nan", "-1", "0"}) {
    const Finished refused = runToEnd({HAPTIC_BRIDGE_PROGRAM, "calibrate", "phantom-omni", "--mass", mass});
    EXPECT_EQ(refused.ending, exitedWith(64)) << mass;
  }
}

}  // namespace
}  // namespace hapticd::test
