// SPDX-License-Identifier: Apache-2.0
// Files that are loaded, damaged ones, and what is said of them.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <map>
#include <string>

#include "config/settings/parameter_table.h"
#include "config/settings_summary.h"
#include "config/yaml_loader.h"
#include "drivers/camera/recorded/recorded_camera.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "drivers/handle/udp/udp_settings.h"
#include "tests/support/file_content.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

// Returns the settings of a file that is expected to be valid.
Settings load(std::string_view yaml, const std::vector<std::string>& overrides = {}) {
  const test::TemporaryFolder folder;
  const auto settings = loadSettings(folder.write("good.yaml", yaml), overrides);
  if (settings) return *settings;
  for (const base::Error& error : settings.error()) ADD_FAILURE() << error.text();
  return Settings{};
}

void expectDefaults(const Settings& settings) {
  for (const Parameter& parameter : allParameters()) {
    EXPECT_EQ(parameter.get(settings), parameter.defaultValue()) << parameter.name;
  }
}

TEST(YamlLoader, AFileWithoutParametersGivesAllDefaults) {
  for (const char* yaml : {"force:", "force:\n", "force: {}\ngrid: ~\n", "---\nforce:\n...\n",
                           "\xef\xbb\xbf"
                           "force:",
                           "%YAML 1.2\n---\nforce: {}\n...\n", "--- {force: {}}\n...\n", "fixtures: []\n",
                           "# the box in room 3\n---\nforce:\n...\n# end\n"}) {
    SCOPED_TRACE(yaml);
    expectDefaults(load(yaml));
  }
}

TEST(YamlLoader, ReadsEveryKindOfParameter) {
  const Settings settings = load(R"(
force:
  stiffness_n_per_m: 750     # a number without fraction
  radius_m: 3.5e-2
  min_points: 12
camera: {driver: recorded, recording: 'some: folder', loop: false, serial: 0123}
synthetic:
    scene: "sphere"
)");
  EXPECT_EQ(settings.live.force.stiffness_n_per_m, 750);
  EXPECT_EQ(settings.live.force.radius_m, 0.035);
  EXPECT_EQ(settings.live.force.min_points, 12);
  EXPECT_EQ(settings.camera.driver, "recorded");
  EXPECT_EQ(settings.camera.of<drivers::RecordedSettings>().recording, "some: folder");
  EXPECT_FALSE(settings.camera.of<drivers::RecordedSettings>().loop);
  EXPECT_EQ(settings.camera.serial, "0123");
  EXPECT_EQ(settings.camera.of<drivers::SyntheticSettings>().scene, drivers::SyntheticScene::sphere);
  EXPECT_EQ(settings.live.force.max_points, 100);  // not set
}

TEST(YamlLoader, ReadsEveryParameterOfTheTable) {
  std::map<std::string, std::string> lines;  // by group
  for (const Parameter& parameter : allParameters()) {
    const std::string value = toText(parameter.defaultValue());
    lines[std::string(parameter.group())] +=
        fmt::format("  {}: {}\n", parameter.nameInGroup(), value.empty() ? "\"\"" : value);
  }
  std::string yaml;
  for (const auto& [group, text] : lines) yaml += group + ":\n" + text;
  expectDefaults(load(yaml));
}

TEST(YamlLoader, ReadsWindowsLineEnds) {
  const Settings settings = load("force:\r\n  radius_m: 0.05\r\n  law: nearest_springs\r\n");
  EXPECT_EQ(settings.live.force.radius_m, 0.05);
}

TEST(YamlLoader, ReadsAGroupInBracesBelowItsName) {
  for (const char* yaml :
       {"force:\n  {radius_m: 0.035, min_points: 12}\n",
        "force:   # what is felt\n\n   # of the law\n {radius_m: 0.035,\n min_points: 12}\n"}) {
    SCOPED_TRACE(yaml);
    EXPECT_EQ(load(yaml).live.force.radius_m, 0.035);
    EXPECT_EQ(load(yaml).live.force.min_points, 12);
  }
}

TEST(YamlLoader, ReadsJson) {
  EXPECT_EQ(load("{\"force\": {\"radius_m\": 0.05},\n \"grid\": {}}").live.force.radius_m, 0.05);
}

TEST(YamlLoader, OverridesComeAfterTheFileAndTheLastOneCounts) {
  const Settings settings = load("force: {radius_m: 0.05, min_points: 5}",
                                 {"force.radius_m=0.03", "camera.recording=a=b", "force.radius_m=0.02"});
  EXPECT_EQ(settings.live.force.radius_m, 0.02);
  EXPECT_EQ(settings.live.force.min_points, 5);
  EXPECT_EQ(settings.camera.of<drivers::RecordedSettings>().recording, "a=b");
}

TEST(YamlLoader, RulesAreCheckedAfterTheOverrides) {
  EXPECT_EQ(load("camera: {near_m: 5}", {"camera.far_m=6"}).camera.near_m, 5);
}

TEST(YamlLoader, AnUnreadableFileIsTheOnlyError) {
  const test::TemporaryFolder folder;
  const auto textFor = [&](const std::filesystem::path& file) {
    const auto settings = loadSettings(file, std::vector<std::string>{"force.radius_m=7"});
    return settings || settings.error().size() != 1 ? "?" : settings.error()[0].text();
  };
  const std::filesystem::path missing = folder.path() / "missing.yaml";
  EXPECT_EQ(textFor(missing), missing.string() +
                                  ": cannot be read: No such file or directory (check the path and "
                                  "its permissions)");
  EXPECT_EQ(textFor(folder.path()),
            folder.path().string() + ": cannot be read: Is a directory (name the YAML file in the folder)");
  const std::filesystem::path loop = folder.path() / "loop.yaml";
  std::filesystem::create_symlink(loop, loop);
  EXPECT_EQ(textFor(loop), loop.string() +
                               ": cannot be read: Too many levels of symbolic links (check the path and "
                               "its permissions)");
}

TEST(YamlLoader, AFileOfOneMebibyteIsReadAndALongerOneRefused) {
  const test::TemporaryFolder folder;
  const std::size_t longest = 1048576;
  const auto longest_file = folder.write("longest.yaml", std::string(longest - 6, '\n') + "force:");
  EXPECT_TRUE(loadSettings(longest_file));
  const auto longer = folder.write("longer.yaml", std::string(longest + 1, '\n'));
  const auto settings = loadSettings(longer);
  ASSERT_FALSE(settings);
  EXPECT_EQ(settings.error().at(0).text(), longer.string() +
                                               ": is longer than 1048576 bytes (check that this is "
                                               "the configuration file)");
}

TEST(RecordedSettings, LeaveOutWhatIsNoParameterAndRefuseAnyOtherFault) {
  const auto recorded =
      recordedSettings("force: {radius_m: 0.03, once: 7}\nremoved: {quite: true}\n", "settings.yaml");
  ASSERT_TRUE(recorded) << recorded.error().front().text();
  EXPECT_EQ(recorded->settings.live.force.radius_m, 0.03);
  EXPECT_EQ(recorded->unknown, (std::vector<std::string>{"force.once", "removed.quite"}));
  EXPECT_FALSE(recordedSettings("force: {radius_m: 9}\n", "settings.yaml"));
  EXPECT_FALSE(recordedSettings("force: {min_points: 90, max_points: 80}\n", "settings.yaml"));
}

bool isOfForce(const Parameter& parameter) {
  return parameter.name.starts_with("force.");
}

TEST(YamlAssignments, AreThoseOfTheTextInItsOrder) {
  const auto assignments =
      assignmentsFromText("force: {radius_m: 0.03, min_points: 7, law: proxy}\n", "part.yaml", isOfForce);
  ASSERT_TRUE(assignments);
  ASSERT_EQ(assignments->size(), 3U);
  EXPECT_EQ((*assignments)[0].parameter->name, "force.radius_m");
  EXPECT_EQ((*assignments)[0].value, Value(0.03));
  EXPECT_EQ((*assignments)[1].value, Value(std::int64_t{7}));
  EXPECT_EQ((*assignments)[2].value, Value(std::string("proxy")));
}

TEST(YamlAssignments, LeaveTheRulesBetweenParametersToTheCaller) {
  const std::string text = "force: {min_points: 90, max_points: 80}\n";
  EXPECT_FALSE(settingsFromText(text, "part.yaml"));
  EXPECT_TRUE(assignmentsFromText(text, "part.yaml", isOfForce));
}

TEST(YamlAssignments, AreRefusedWhereOneIsWrongUnknownOrMisplaced) {
  const auto assignments =
      assignmentsFromText("force: {radius_m: 9, radius: 1}\ncamera: {near_m: 0.5}\n", "part.yaml", isOfForce);
  ASSERT_FALSE(assignments);
  ASSERT_EQ(assignments.error().size(), 3U);
  EXPECT_NE(assignments.error()[0].text().find("out of range"), std::string::npos);
  EXPECT_NE(assignments.error()[1].text().find("there is no parameter"), std::string::npos);
  EXPECT_NE(assignments.error()[2].text().find("part.yaml:2: camera.near_m: is not a parameter of"),
            std::string::npos)
      << assignments.error()[2].text();
}

TEST(LoadConfiguration, OfAPipeIsRefusedWhereARegularFileIsRequired) {
  const test::TemporaryFolder folder;
  const std::filesystem::path pipe = folder.path() / "pipe.yaml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto loaded = loadConfiguration(pipe, {}, base::FileKind::regular);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().front().text(),
            pipe.string() + ": is not a regular file (put a regular file there, or name another one)");
}

using test::contentOf;
std::string repeated(std::string_view piece, std::size_t length) {
  std::string text;
  while (text.size() < length) text += piece;
  return text;
}

// A loader may only return settings that the table and the rules accept, or errors with a text.
void expectSettingsOrErrors(const std::expected<Settings, std::vector<base::Error>>& settings) {
  if (!settings) {
    EXPECT_FALSE(settings.error().empty());
    EXPECT_LE(settings.error().size(), 101U);
    for (const base::Error& error : settings.error()) {
      EXPECT_FALSE(error.where.empty());
      EXPECT_FALSE(error.what.empty());
    }
    return;
  }
  for (const Parameter& parameter : allParameters()) {
    EXPECT_TRUE(parameter.check(parameter.get(*settings))) << parameter.name;
  }
  EXPECT_TRUE(checkTogether(*settings).empty());
}

// Nested, endless and repetitive inputs of the maximum file size: refused with bounded work and stack. The
// test's time limit bounds the time.
TEST(DamagedYaml, LongPathologicalFilesAreRefused) {
  const test::TemporaryFolder folder;
  for (const char* piece :
       {"[", "{", "[a,",   "{a: ", "{? ", "? ",         "- ",   "a: ", "k: [", "&a ", "*", "!", ":", "\"",
        "'", "a", "---\n", "|\n",  ">",   "%TAG ! x\n", "a:\n", "\\",  "@",    "`",   "}", "]", ","}) {
    SCOPED_TRACE(piece);
    const auto settings = loadSettings(folder.write("long.yaml", repeated(piece, 1000000)));
    EXPECT_FALSE(settings);
    expectSettingsOrErrors(settings);
  }
}

TEST(DamagedYaml, AnAliasBombIsRefusedWithoutUnfoldingIt) {
  const test::TemporaryFolder folder;
  std::string yaml = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n";
  for (int level = 1; level < 30; ++level) {
    const std::string alias = "*a" + std::to_string(level - 1);
    yaml += "a" + std::to_string(level) + ": &a" + std::to_string(level) + " [" + alias +
            repeated(", " + alias, 40) + "]\n";
  }
  const auto settings = loadSettings(folder.write("bomb.yaml", yaml));
  ASSERT_FALSE(settings);
  expectSettingsOrErrors(settings);
}

TEST(DamagedYaml, ManyProblemsAreCutToAHundredAndTheRestCounted) {
  const test::TemporaryFolder folder;
  std::string yaml = "force:\n";
  for (int i = 0; i < 150; ++i) yaml += "  x" + std::to_string(i) + ": 1\n";
  const auto settings = loadSettings(folder.write("many.yaml", yaml));
  ASSERT_FALSE(settings);
  ASSERT_EQ(settings.error().size(), 101U);
  EXPECT_EQ(settings.error()[100].what, "50 more problems");
}

// The list is the first name or value, and line n holds the one after the n-th.
TEST(DamagedYaml, AFileOfManyValuesIsReadNoFurtherThanTwentyFiveThousand) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("foreign.yaml", repeated("- 1\n", 200000));
  const auto settings = loadSettings(file);
  ASSERT_FALSE(settings);
  ASSERT_EQ(settings.error().size(), 2U);
  EXPECT_EQ(
      settings.error()[1].text(),
      file.string() +
          ":25000: more than 25000 names and values, not read any further (check that this is the right "
          "file; a path has at most 256 points)");
}

// A cut must never count as a request for the defaults of what follows it, whatever is there.
TEST(DamagedYaml, EveryCutOfAFileWithMarksIsRefused) {
  const test::TemporaryFolder folder;
  for (const char* name : {"demo.yaml", "hapticd.yaml"}) {
    const std::string whole = contentOf(std::filesystem::path(HAPTICD_SHIPPED_CONFIG) / name);
    const std::size_t end = whole.rfind("...");
    ASSERT_NE(end, std::string::npos);
    // At each byte where that is fast enough.
    const std::size_t step = 1 + whole.size() / 2000;
    std::size_t accepted = 0;
    for (std::size_t length = 0; length < end + 3; length += step) {
      if (loadSettings(folder.write("cut.yaml", whole.substr(0, length)))) ++accepted;
    }
    EXPECT_EQ(accepted, 0U) << name;
    EXPECT_TRUE(loadSettings(folder.write("cut.yaml", whole.substr(0, end + 3))));
  }
}

Settings udpSettings(const char* address, const char* peer, const char* key_file = "") {
  Settings settings;
  settings.handle.driver = "udp";
  settings.handle.of<drivers::UdpHandleSettings>().address = address;
  settings.handle.of<drivers::UdpHandleSettings>().peer = peer;
  settings.handle.of<drivers::UdpHandleSettings>().key_file = key_file;
  return settings;
}

TEST(Warnings, AreEmptyForTheDefaults) {
  EXPECT_TRUE(warningsOf(Settings{}).empty());
}

TEST(Warnings, NameAHandleOnTheNetworkWithoutAKey) {
  for (const auto& settings :
       {udpSettings("0.0.0.0", "192.0.2.10"), udpSettings("192.0.2.1", "192.0.2.10:47801"),
        udpSettings("0.0.0.0", "127.0.0.1")}) {
    const std::vector<base::Error> warnings = warningsOf(settings);
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].where, "udp_handle.key_file");
    EXPECT_NE(warnings[0].text().find(settings.handle.of<drivers::UdpHandleSettings>().peer),
              std::string::npos);
  }
}

TEST(Warnings, AreEmptyForAHandleWithAKeyOnThisComputerOrNotInUse) {
  EXPECT_TRUE(warningsOf(udpSettings("0.0.0.0", "192.0.2.10", "/etc/hapticd/key")).empty());
  EXPECT_TRUE(warningsOf(udpSettings("127.0.0.1", "127.0.0.2:47801")).empty());
  Settings unused = udpSettings("0.0.0.0", "192.0.2.10");
  unused.handle.driver = "simulated";
  EXPECT_TRUE(warningsOf(unused).empty());
}

SettingsSummary summary(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
  const test::TemporaryFolder folder;
  const auto loaded = loadConfiguration(folder.write("a.yaml", yaml), overrides, base::FileKind::regular);
  EXPECT_TRUE(loaded);
  return loaded ? summaryOf(*loaded) : SettingsSummary{};
}

TEST(SettingsSummary, CountsWhatIsSetAndNamesWhatDiffersFromTheDefaults) {
  EXPECT_EQ(summary("force:").text(), "0 parameters set, none differs from the defaults");
  EXPECT_EQ(summary("force: {min_points: 10}").text(), "1 parameter set, none differs from the defaults");
  EXPECT_EQ(
      summary("safety: {max_force_n: 1}\ncamera: {serial: A00362}\nforce: {min_points: 10}\n").text(),
      "3 parameters set, 2 differ from the defaults: safety.max_force_n = 1 (default 4), camera.serial = "
      "\"A00362\" (default \"\")");
}

TEST(SettingsSummary, CountsAParameterOnceThatAnOverrideSetsAgain) {
  EXPECT_EQ(summary("safety: {max_force_n: 1}", {"safety.max_force_n=2", "safety.max_force_n=3"}).text(),
            "1 parameter set, 1 differs from the defaults: safety.max_force_n = 3 (default 4)");
}

TEST(SettingsSummary, IsCutWhenMuchDiffersOrAValueIsLong) {
  Configuration configuration;
  for (const Parameter& parameter : allParameters()) {
    if (parameter.kind == Kind::number) parameter.set(configuration.settings, parameter.maximum);
  }
  const SettingsSummary found = summaryOf(configuration);
  ASSERT_GT(found.differences.size(), 16U);
  EXPECT_TRUE(found.text().ends_with(", and " + std::to_string(found.differences.size() - 16) + " more"))
      << found.text();
  const std::string long_value = summary("force:", {"camera.serial=" + std::string(3000, 'x')}).text();
  EXPECT_TRUE(long_value.ends_with(": camera.serial = \"" + std::string(60, 'x') + "...\" (default \"\")"))
      << long_value;
}

}  // namespace
}  // namespace hapticd::config
