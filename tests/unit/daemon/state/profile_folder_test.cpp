// SPDX-License-Identifier: Apache-2.0
// Profiles on the disk.
#include "daemon/state/profile_folder.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "config/settings/parameter_table.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;

class ProfileFolderTest : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& content) {
    fs::create_directories(folder.path() / "profiles");
    folder.write("profiles/" + name, content);
  }
  std::vector<std::string> names() {
    std::vector<std::string> names;
    const auto entries = profiles.list();
    if (!entries) return {entries.error().text()};
    for (const ProfileEntry& entry : *entries) names.push_back(entry.name);
    return names;
  }

  const test::TemporaryFolder folder;
  const ProfileFolder profiles{folder.path()};
};

TEST(ProfileName, IsLettersDigitsUnderscoresAndDashes) {
  for (const char* name : {"a", "A-b_9", "-", "boot"}) EXPECT_TRUE(isProfileName(name)) << name;
  EXPECT_TRUE(isProfileName(std::string(64, 'x')));
  EXPECT_FALSE(isProfileName(std::string(65, 'x')));
  for (const char* name : {"", ".", "..", "a.b", "a/b", "a b", "\xc3\xa9", "a\n"}) {
    EXPECT_FALSE(isProfileName(name)) << name;
  }
  EXPECT_FALSE(isProfileName(std::string_view("a\0b", 3)));
}

TEST_F(ProfileFolderTest, ReadsBackEveryLiveParameter) {
  config::Settings settings;
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (parameter.effect != config::Effect::live) continue;
    if (parameter.kind == config::Kind::number)
      parameter.set(settings, parameter.minimum / 3 + parameter.maximum * 2 / 3);
    if (parameter.kind == config::Kind::choice)
      parameter.set(settings, std::string(parameter.choices.back()));
    if (parameter.kind == config::Kind::boolean)
      parameter.set(settings, !std::get<bool>(parameter.get(settings)));
  }
  ASSERT_TRUE(profiles.save("all", settings));
  const auto loaded = profiles.load("all");
  ASSERT_TRUE(loaded) << textOf(loaded.error());
  config::Settings read;
  for (const auto& [parameter, value] : loaded->assignments) parameter->set(read, value);
  for (const config::Parameter& parameter : config::parameterTable()) {
    const bool live = parameter.effect == config::Effect::live;
    EXPECT_EQ(parameter.get(read), live ? parameter.get(settings) : parameter.defaultValue())
        << parameter.name;
  }
}

TEST_F(ProfileFolderTest, KeepsFixturesAndRegions) {
  config::Settings settings;
  settings.additions.fixtures = {
      {.name = "nerve", .kind = rt::FixtureKind::standoff, .clearance_m = 0.005},
      {.name = "cut", .kind = rt::FixtureKind::path, .points_m = {{0, 0, -1}, {0.1, 0.2, -1}}}};
  settings.additions.regions = {{.name = "bone", .place = rt::TissuePlace::label, .label = 3}};
  settings.additions.label_image = "labels.pgm";
  ASSERT_TRUE(profiles.save("all", settings));
  auto loaded = profiles.load("all");
  ASSERT_TRUE(loaded) << textOf(loaded.error());
  config::SceneAdditions read;
  loaded->additions.applyTo(read);
  EXPECT_EQ(read, settings.additions);

  ASSERT_TRUE(profiles.save("none", config::Settings()));
  loaded = profiles.load("none");
  ASSERT_TRUE(loaded) << textOf(loaded.error());
  loaded->additions.applyTo(read);
  EXPECT_EQ(read, config::SceneAdditions());
}

TEST_F(ProfileFolderTest, KeepsAsManyLongPathsAsThereMayBe) {
  config::Settings settings;
  for (std::size_t i = 0; i < rt::kMaxFixtures; ++i) {
    config::FixtureSettings path{.name = "p" + std::to_string(i), .kind = rt::FixtureKind::path};
    for (std::size_t j = 0; j < rt::kMaxPathPoints; ++j) {
      path.points_m.push_back({static_cast<double>(j) / 300, 1.0 / 3, -0.1234567890123456});
    }
    settings.additions.fixtures.push_back(path);
  }
  ASSERT_TRUE(profiles.save("long", settings));
  const auto loaded = profiles.load("long");
  ASSERT_TRUE(loaded) << textOf(loaded.error());
  EXPECT_EQ(loaded->additions.fixtures, settings.additions.fixtures);
}

TEST_F(ProfileFolderTest, WithoutFixturesLeavesThemAsTheyAre) {
  write("old.yaml", "force:\n  min_points: 11\n");
  const auto loaded = profiles.load("old");
  ASSERT_TRUE(loaded) << textOf(loaded.error());
  EXPECT_TRUE(loaded->additions.empty());
}

TEST_F(ProfileFolderTest, ListsProfilesOnlyWhateverElseIsThere) {
  EXPECT_EQ(names(), std::vector<std::string>{});
  write("b.yaml", "");
  write("a.yaml", "force: {min_points: 7}\n");
  write("no name.yaml", "");
  write("a.yaml.new", "");
  write("text.txt", "");
  fs::create_directory(folder.path() / "profiles/folder.yaml");
  fs::create_symlink(folder.path() / "profiles/a.yaml", folder.path() / "profiles/link.yaml");
  ASSERT_TRUE(profiles.setBoot("a"));
  EXPECT_EQ(names(), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(profiles.list().value().at(0).boot);
}

TEST_F(ProfileFolderTest, ListsProfilesBesideADamagedChoiceForTheStart) {
  write("a.yaml", "force: {min_points: 7}\n");
  write("boot", "../../etc/passwd\n");
  EXPECT_EQ(names(), std::vector<std::string>{"a"});
  EXPECT_FALSE(profiles.list().value().at(0).boot);
  const auto boot = profiles.boot();
  ASSERT_FALSE(boot);
  EXPECT_NE(boot.error().text().find("is not a valid profile name"), std::string::npos);
  EXPECT_TRUE(profiles.setBoot("a"));
  EXPECT_EQ(profiles.boot().value(), "a");
}

TEST_F(ProfileFolderTest, TakesNoMoreThanItLists) {
  for (std::size_t i = 0; i < ProfileFolder::kMaxProfiles; ++i) write("p" + std::to_string(i) + ".yaml", "");
  const auto saved = profiles.save("one-more", {});
  ASSERT_FALSE(saved);
  EXPECT_NE(saved.error().text().find("256"), std::string::npos) << saved.error().text();
  EXPECT_TRUE(profiles.save("p7", {}));
}

TEST_F(ProfileFolderTest, ChoosesNoBrokenProfileForTheStart) {
  ASSERT_TRUE(profiles.save("good", {}));
  ASSERT_TRUE(profiles.setBoot("good"));
  write("broken.yaml", "force: {radius_m: 99}\n");
  const auto chosen = profiles.setBoot("broken");
  ASSERT_FALSE(chosen);
  EXPECT_NE(chosen.error().text().find("force.radius_m"), std::string::npos);
  EXPECT_EQ(profiles.boot().value(), "good");
}

}  // namespace
}  // namespace hapticd::daemon
