// SPDX-License-Identifier: Apache-2.0
// The precedence of file, registration, boot profile and overrides at the start; the registration of the
// camera on the disk; reading the settings again without waiting for the disk.

#include <gtest/gtest.h>

#include <memory>

#include "config/base/value_text.h"
#include "daemon/state/profile_folder.h"
#include "daemon/state/start_settings.h"
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

namespace {

const Registration kRegistration{{{0.1, -2, 1e-7}, 0.3, -0.4, 3.1}, 0.00123, "2026-03-04T05:06:07Z"};

/// Returns the problems of the file in one text.
std::string problemsIn(const std::string& yaml) {
  const test::TemporaryFolder folder;
  folder.write("registration.yaml", yaml);
  const auto read = readRegistration(folder.path());
  return read ? "" : textOf(read.error());
}

TEST(Registration, ReadsBackWhatWasWritten) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(writeRegistration(folder.path(), kRegistration));
  const auto read = readRegistration(folder.path());
  ASSERT_TRUE(read && *read);
  EXPECT_TRUE(same((*read)->T_world_camera, kRegistration.T_world_camera));
  EXPECT_EQ((*read)->residual_m, kRegistration.residual_m);
  EXPECT_EQ((*read)->time, kRegistration.time);
}

TEST(Registration, GoesAwayWhenThereIsToBeNone) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(readRegistration(folder.path()).value());
  ASSERT_TRUE(writeRegistration(folder.path(), kRegistration));
  ASSERT_TRUE(writeRegistration(folder.path(), std::nullopt));
  EXPECT_FALSE(readRegistration(folder.path()).value());
}

TEST(Registration, ReadsAPoseThatSomebodyHasWritten) {
  const test::TemporaryFolder folder;
  folder.write("registration.yaml",
               "camera: {position_x_m: 1, position_y_m: 2, position_z_m: 3, roll_rad: 0, pitch_rad: 0, "
               "yaw_rad: 0}\n");
  const auto read = readRegistration(folder.path());
  ASSERT_TRUE(read && *read);
  EXPECT_EQ((*read)->T_world_camera.position_m.z, 3);
  EXPECT_FALSE((*read)->residual_m);
  EXPECT_EQ((*read)->time, "");
}

TEST(Registration, TakesNoTimeThatIsNone) {
  const std::string pose =
      "camera: {position_x_m: 1, position_y_m: 2, position_z_m: 3, roll_rad: 0, pitch_rad: 0, yaw_rad: 0}\n";
  for (const std::string& time :
       {std::string("yesterday"), std::string(3000, '0'), std::string("2026-03-04T05:06:07Z ")}) {
    const test::TemporaryFolder folder;
    folder.write("registration.yaml", "# time: " + time + "\n" + pose);
    const auto read = readRegistration(folder.path());
    ASSERT_TRUE(read && *read);
    EXPECT_EQ((*read)->time, "");
  }
}

TEST(Registration, NamesWhatIsWrongWithItsFile) {
  EXPECT_NE(problemsIn("camera: {position_x_m: 1}\n").find("1 of the 6 values"), std::string::npos);
  EXPECT_NE(problemsIn("").find("0 of the 6 values"), std::string::npos);
  EXPECT_NE(problemsIn("camera: {position_x_m: 11}\n").find("out of range"), std::string::npos);
  EXPECT_NE(problemsIn("camera: {near_m: 1}\n").find("camera.near_m"), std::string::npos);
  EXPECT_NE(problemsIn("camera: [\n"), "");
  EXPECT_NE(problemsIn(std::string("\0\0\0", 3)), "");
}

TEST(Registration, KnowsWhichPosesAreOutOfRange) {
  EXPECT_TRUE(problemsOf(kRegistration.T_world_camera, {}).empty());
  EXPECT_EQ(problemsOf({{99, 0, 0}, 0, 9, 0}, {}).size(), 2U);
}

}  // namespace

namespace {

using Outcome = SettingsReader::Outcome;

constexpr std::chrono::seconds kGenerous{60};

/// A disk that responds when the test lets it.
struct Disk {
  std::promise<void> answer;
  std::shared_future<void> answered = answer.get_future().share();

  std::function<Outcome()> read() const {
    return [answered = answered]() -> Outcome {
      answered.wait();
      return StartSettings{};
    };
  }
};

/// Polls at the time `now` until there is an outcome.
std::optional<Outcome> awaited(SettingsReader& reader, SettingsReader::Clock::time_point now) {
  const auto deadline = std::chrono::steady_clock::now() + kGenerous;
  while (std::chrono::steady_clock::now() < deadline) {
    if (auto outcome = reader.outcome(now)) return outcome;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return std::nullopt;
}

const SettingsReader::Clock::time_point kBegin{std::chrono::hours(1)};

TEST(SettingsReader, HasNoOutcomeUntilTheDiskAnswersAndOneThen) {
  Disk disk;
  SettingsReader reader(disk.read(), "hapticd.yaml");
  EXPECT_FALSE(reader.outcome(kBegin));
  reader.begin(kBegin);
  EXPECT_TRUE(reader.reading());
  EXPECT_FALSE(reader.outcome(kBegin));
  disk.answer.set_value();
  const auto outcome = awaited(reader, kBegin);
  ASSERT_TRUE(outcome);
  EXPECT_TRUE(*outcome);
  EXPECT_FALSE(reader.reading());
  EXPECT_FALSE(reader.outcome(kBegin));
}

TEST(SettingsReader, GivesUpADiskThatDoesNotAnswerAndReadsAgainWhenItDoes) {
  Disk disk;
  SettingsReader reader(disk.read(), "hapticd.yaml");
  reader.begin(kBegin);
  EXPECT_FALSE(reader.outcome(kBegin + SettingsReader::kPatience - std::chrono::milliseconds(1)));
  const auto given_up = reader.outcome(kBegin + SettingsReader::kPatience);
  ASSERT_TRUE(given_up);
  ASSERT_FALSE(*given_up);
  EXPECT_EQ(
      given_up->error().front().text(),
      "hapticd.yaml: has not been read after 10 s: the disk does not answer (check the disk or the network "
      "file system, and reload again)");
  disk.answer.set_value();
  reader.begin(kBegin + std::chrono::minutes(1));
  const auto outcome = awaited(reader, kBegin + std::chrono::minutes(1));
  ASSERT_TRUE(outcome);
  EXPECT_TRUE(*outcome);
}

// If the end waited for the disk it would never come: the disk answers only after it.
TEST(SettingsReader, EndsThoughTheDiskDoesNotAnswer) {
  Disk disk;
  {
    SettingsReader reader(disk.read(), "hapticd.yaml");
    reader.begin(kBegin);
  }
  disk.answer.set_value();
}

}  // namespace
}  // namespace hapticd::daemon
