// SPDX-License-Identifier: Apache-2.0
// The precedence of file, registration, boot profile and overrides at the start.
#include "daemon/state/start_settings.h"

#include <gtest/gtest.h>

#include "config/base/value_text.h"
#include "daemon/state/profile_folder.h"
#include "tests/support/file_content.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

class StartSettingsTest : public testing::Test {
 protected:
  StartSettings start(const std::string& yaml, std::vector<std::string> overrides = {}) {
    overrides.push_back("state.folder=" + folder.path().string());
    const auto started = startSettings(folder.write("hapticd.yaml", yaml), overrides);
    EXPECT_TRUE(started) << textOf(started ? std::vector<base::Error>{} : started.error());
    return started.value_or(StartSettings{});
  }
  void bootProfile(const std::string& yaml) {
    std::filesystem::create_directories(folder.path() / "profiles");
    folder.write("profiles/mine.yaml", yaml);
    folder.write("profiles/boot", "mine\n");
  }
  void registerX(double x_m) {
    EXPECT_TRUE(writeRegistration(folder.path(), Registration{{{x_m, 0, 0}, 0, 0, 0}, {}, ""}));
  }
  static double stiffness(const StartSettings& start) { return start.settings.live.force.stiffness_n_per_m; }

  const test::TemporaryFolder folder;
};

TEST_F(StartSettingsTest, AreThoseOfTheFileWhereNothingElseIsThere) {
  const StartSettings started = start("force: {stiffness_n_per_m: 300}\n");
  EXPECT_EQ(stiffness(started), 300);
  EXPECT_FALSE(started.registration);
  EXPECT_FALSE(started.boot_profile);
  EXPECT_TRUE(started.notices.empty());
}

TEST_F(StartSettingsTest, FollowTheBootProfileBeforeTheFileAndTheCommandLineBeforeBoth) {
  bootProfile("force: {stiffness_n_per_m: 250, radius_m: 0.03}\n");
  const std::string yaml = "force: {stiffness_n_per_m: 300, min_points: 7}\n";
  const StartSettings started = start(yaml);
  EXPECT_EQ(started.boot_profile, "mine");
  EXPECT_EQ(stiffness(started), 250);
  EXPECT_EQ(started.settings.live.force.min_points, 7);
  const StartSettings overridden = start(yaml, {"force.stiffness_n_per_m=200"});
  EXPECT_EQ(stiffness(overridden), 200);
  EXPECT_EQ(overridden.settings.live.force.radius_m, 0.03);
}

TEST_F(StartSettingsTest, FollowTheRegistrationBeforeTheFileAndTheCommandLineBeforeBoth) {
  registerX(2);
  const std::string yaml = "camera: {position_x_m: 1, position_y_m: 1}\n";
  const StartSettings started = start(yaml);
  ASSERT_TRUE(started.registration);
  EXPECT_EQ(started.settings.camera.position_x_m, 2);
  EXPECT_EQ(started.settings.camera.position_y_m, 0);  // a registration is a whole pose
  EXPECT_EQ(started.configured_T_world_camera.position_m.x, 1);
  EXPECT_EQ(start(yaml, {"camera.position_x_m=3"}).settings.camera.position_x_m, 3);
}

TEST_F(StartSettingsTest, LeaveOutABrokenBootProfileAndSayWhy) {
  for (const char* yaml : {"force: {stiffness_n_per_m: 250, radius_m: 99}\n", "force: [\n",
                           "force: {stiffness_n_per_m: 250, of_a_newer_version: 1}\n",
                           "force: {stiffness_n_per_m: 250, max_points: 2}\n",  // below min_points
                           "camera: {near_m: 0.6}\n"}) {
    bootProfile(yaml);
    const StartSettings started = start("force: {stiffness_n_per_m: 300, min_points: 5}\n");
    EXPECT_EQ(stiffness(started), 300) << yaml;
    EXPECT_FALSE(started.boot_profile) << yaml;
    ASSERT_EQ(started.notices.size(), 1U) << yaml;
    EXPECT_NE(started.notices[0].find("the boot profile mine is not used: "), std::string::npos);
  }
}

TEST_F(StartSettingsTest, LeaveOutABootProfileThatIsGoneOrWasNeverNamed) {
  bootProfile("");
  std::filesystem::remove(folder.path() / "profiles/mine.yaml");
  EXPECT_NE(start("force:").notices.at(0).find("there is no such profile"), std::string::npos);
  folder.write("profiles/boot", "");
  EXPECT_NE(start("force:").notices.at(0).find("is not a valid profile name"), std::string::npos);
}

TEST_F(StartSettingsTest, LeaveOutABrokenRegistrationAndSayWhy) {
  folder.write("registration.yaml", "camera: {position_x_m: 2}\n");
  bootProfile("force: {stiffness_n_per_m: 250}\n");
  const StartSettings started = start("camera: {position_x_m: 1}\n");
  EXPECT_FALSE(started.registration);
  EXPECT_EQ(started.settings.camera.position_x_m, 1);
  ASSERT_EQ(started.notices.size(), 1U);
  EXPECT_NE(started.notices[0].find("the registration of the camera's pose is not used: "),
            std::string::npos);
  EXPECT_EQ(stiffness(started), 250);  // the profile is
}

TEST_F(StartSettingsTest, AreNoneWhereTheFileIsWrongWhateverElseIsThere) {
  bootProfile("force: {stiffness_n_per_m: 250}\n");
  EXPECT_FALSE(startSettings(folder.write("bad.yaml", "force: {stiffness_n_per_m: x}\n"), {}));
}

TEST_F(StartSettingsTest, SayThatABootProfileWithoutParametersIsNotUsed) {
  for (const char* nothing : {"", "{}\n", "# cut off"}) {
    bootProfile(nothing);
    const StartSettings started = start("force: {stiffness_n_per_m: 300}\n");
    EXPECT_FALSE(started.boot_profile);
    EXPECT_EQ(stiffness(started), 300);
    ASSERT_EQ(started.notices.size(), 1U);
    EXPECT_NE(started.notices[0].find("profiles/mine.yaml: names no parameter (save the profile again, or "
                                      "delete it)"),
              std::string::npos)
        << started.notices[0];
  }
}

TEST_F(StartSettingsTest, LeaveOutABootProfileOrRegistrationWhoseEndWasCutOff) {
  Registration registration;
  registration.T_world_camera.position_m.x = 1;
  ASSERT_TRUE(writeRegistration(folder.path(), registration));
  config::Settings saved;
  saved.additions.fixtures = {{.name = "nerve"}, {.name = "vessel"}};
  for (config::FixtureSettings& fixture : saved.additions.fixtures) fixture.radius_m = 0.01;
  ASSERT_TRUE(ProfileFolder(folder.path()).save("mine", saved));
  ASSERT_TRUE(ProfileFolder(folder.path()).setBoot("mine"));
  ASSERT_EQ(start("force:").settings.additions.fixtures.size(), 2U);
  for (const char* file : {"registration.yaml", "profiles/mine.yaml"}) {
    const std::string whole = test::contentOf(folder.path() / file);
    // After each line but the last, where what is left is good YAML.
    for (std::size_t end = whole.find('\n'); end + 1 < whole.size(); end = whole.find('\n', end + 1)) {
      folder.write(file, whole.substr(0, end + 1));
      EXPECT_EQ(start("force:").notices.size(), 1U) << file << ": " << whole.substr(0, end + 1);
    }
    folder.write(file, whole);
  }
  EXPECT_TRUE(start("force:").notices.empty());
}

TEST_F(StartSettingsTest, ShowNothingOfADamagedProfileOrRegistrationThatSteersATerminalOrIsLong) {
  const std::string bad = "\\e[2J\\x9b" + std::string(900, 'x');  // a name has at most 1024 bytes
  std::string profile;
  for (int i = 0; i < 40; ++i) profile += "  \"" + std::to_string(i) + bad + "\": 1\n";
  bootProfile("force:\n" + profile);
  folder.write("registration.yaml", "camera: {\"" + bad + "\": \"" + bad + "\", yaw_rad: \"" + bad + "\"}\n");
  const StartSettings started = start("force:");
  ASSERT_EQ(started.notices.size(), 2U);
  for (const std::string& notice : started.notices) {
    EXPECT_EQ(notice, base::printable(notice));
    EXPECT_NE(notice.find("\\x1b[2J"), std::string::npos) << notice;
    EXPECT_LT(notice.size(), 4000U);
  }
}

TEST_F(StartSettingsTest, WarnOfAHandleOnTheNetworkWithoutAKey) {
  const StartSettings started =
      start("handle: {driver: udp}\nudp_handle: {address: 0.0.0.0, peer: 192.0.2.10}\n");
  ASSERT_EQ(started.notices.size(), 1U);
  EXPECT_TRUE(started.notices[0].starts_with("udp_handle.key_file: is empty")) << started.notices[0];
}

TEST_F(StartSettingsTest, SumUpWhatTheFileAndTheCommandLineSet) {
  const StartSettings started = start("safety: {max_force_n: 1}\n");
  EXPECT_EQ(started.summary.set, 2U);  // and state.folder
  EXPECT_TRUE(
      started.summary.text().starts_with("2 parameters set, 2 differ from the defaults: "
                                         "safety.max_force_n = 1 (default 4), state.folder = "))
      << started.summary.text();
}

}  // namespace
}  // namespace hapticd::daemon
