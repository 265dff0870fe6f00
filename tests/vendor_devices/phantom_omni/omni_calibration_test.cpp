// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>

#include "tests/support/temporary_folder.h"
#include "tests/vendor_devices/phantom_omni/emulated_omni.h"
#include "tests/vendor_devices/phantom_omni/omni_under_test.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"

namespace hapticd::test {

// The file with the calibration of a Phantom Omni.
namespace {

namespace omni = tools::phantom_omni;

constexpr const char* kSerial = "41023100321";

std::string contentOf(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class OmniCalibrationFile : public ::testing::Test {
 protected:
  omni::OmniCalibration calibration() { return {kSerial, randomOmniGains(random_), true}; }
  std::string whatIsWrongWith(const std::string& content) {
    const auto read = omni::readCalibration(folder_.write("calibration.json", content), kSerial);
    return read ? "" : read.error().text();
  }

  std::mt19937 random_{11};
  TemporaryFolder folder_{memoryFolder()};
  std::filesystem::path file_ = folder_.path() / "new" / "calibration.json";
};

TEST_F(OmniCalibrationFile, IsReadAsItWasStored) {
  for (int round = 0; round < 50; ++round) {
    omni::OmniCalibration stored = calibration();
    stored.releases_without_packets = round % 2 == 0;
    ASSERT_TRUE(omni::storeCalibration(file_, stored));
    const auto read = omni::readCalibration(file_, kSerial);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_TRUE(*read);
    EXPECT_EQ((*read)->n_m_per_count, stored.n_m_per_count);
    EXPECT_EQ((*read)->releases_without_packets, stored.releases_without_packets);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(file_.parent_path()), {}), 1)
      << "no draft is left";
}

TEST_F(OmniCalibrationFile, MayBeMissing) {
  const auto read = omni::readCalibration(file_, kSerial);
  ASSERT_TRUE(read);
  EXPECT_FALSE(*read);
}

TEST_F(OmniCalibrationFile, OfAnotherDeviceIsRefused) {
  ASSERT_TRUE(omni::storeCalibration(file_, calibration()));
  const auto read = omni::readCalibration(file_, "10000000001");
  ASSERT_FALSE(read);
  EXPECT_NE(
      read.error().text().find("belongs to the device with serial number 41023100321, not to 10000000001"),
      std::string::npos)
      << read.error().text();
}

TEST_F(OmniCalibrationFile, ThatIsCutShortIsRefused) {
  ASSERT_TRUE(omni::storeCalibration(file_, calibration()));
  const std::string whole = contentOf(file_);
  ASSERT_EQ(whatIsWrongWith(whole), "");
  for (std::size_t length = 0; length + 2 < whole.size(); ++length) {
    const std::string wrong = whatIsWrongWith(whole.substr(0, length));
    EXPECT_NE(wrong.find("is not a JSON object"), std::string::npos) << length << ": " << wrong;
    EXPECT_NE(wrong.find("calibrate the device again"), std::string::npos);
  }
}

TEST_F(OmniCalibrationFile, WithAnImplausibleMemberIsRefused) {
  const auto withMembers = [](const std::string& format, const std::string& gains,
                              const std::string& releases) {
    return R"({"format": ")" + format + R"(", "serial": "41023100321", "nMPerCount": )" + gains +
           R"(, "releasesWithoutPackets": )" + releases + "}";
  };
  const std::string format = "haptic-vendor-bridge calibration phantom-omni 1";
  const std::string gains = "[3e-4, -3e-4, 3e-4]";
  EXPECT_EQ(whatIsWrongWith(withMembers(format, gains, "true")), "");
  EXPECT_NE(whatIsWrongWith(withMembers("other", gains, "true")), "");
  EXPECT_NE(whatIsWrongWith(withMembers(format, gains, "1")), "");
  for (const char* bad : {"[3e-4, 3e-4]", "[3e-4, 3e-4, 0]", "[3e-4, 3e-4, 2e-3]", "[3e-4, 3e-4, 1e-6]", "7",
                          "null", "[3e-4, 3e-4, null]", "[3e-4, 3e-4, \"3e-4\"]", "[3e-4, 3e-4, 1e300]"})
    EXPECT_NE(whatIsWrongWith(withMembers(format, bad, "true")), "") << bad;
}

TEST_F(OmniCalibrationFile, IsWhereServicesOrPeopleKeepTheirState) {
  ::unsetenv("STATE_DIRECTORY");
  ::unsetenv("XDG_STATE_HOME");
  ::setenv("HOME", "/home/a", 1);
  EXPECT_EQ(*omni::calibrationFile("", "7"), "/home/a/.local/state/haptic-vendor-bridge/phantom-omni-7.json");
  ::setenv("XDG_STATE_HOME", "/state", 1);
  EXPECT_EQ(*omni::calibrationFile("", "7"), "/state/haptic-vendor-bridge/phantom-omni-7.json");
  ::setenv("STATE_DIRECTORY", "/var/lib/bridge:/var/lib/other", 1);
  EXPECT_EQ(*omni::calibrationFile("", "7"), "/var/lib/bridge/phantom-omni-7.json");
  EXPECT_EQ(*omni::calibrationFile("/a/b.json", "7"), "/a/b.json");
  ::unsetenv("STATE_DIRECTORY");
  ::unsetenv("XDG_STATE_HOME");
  ::unsetenv("HOME");
  const auto nowhere = omni::calibrationFile("", "7");
  ASSERT_FALSE(nowhere);
  EXPECT_NE(nowhere.error().text().find("--calibration"), std::string::npos);
}

TEST_F(OmniCalibrationFile, ThatCannotBeWrittenIsAnError) {
  const auto stored = omni::storeCalibration(folder_.write("file", "") / "calibration.json", calibration());
  ASSERT_FALSE(stored);
  EXPECT_NE(stored.error().text().find("--calibration"), std::string::npos) << stored.error().text();
}

// haptic-bridge calibrate phantom-omni, with a person who does what it asks for.

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
