// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/support/temporary_folder.h"
#include "tests/vendor_devices/phantom_omni/omni_model.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"

// The file with the calibration of a Phantom Omni.
namespace hapticd::test {
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

}  // namespace
}  // namespace hapticd::test
