// SPDX-License-Identifier: Apache-2.0
// The shipped configurations, the documents and the texts of the programs name what there is: parameters with
// their ranges and defaults, members of fixtures and regions, examples that load.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "config/additions/addition_fields.h"
#include "config/settings/driver_rows.h"
#include "config/settings/parameter_table.h"
#include "config/yaml_loader.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "tests/support/file_content.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

const std::filesystem::path kShipped = HAPTICD_SHIPPED_CONFIG;

bool isWord(std::string_view text) {
  return !text.empty() &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string_view::npos;
}

/// Whether a line is "  # name: value  # range".
bool holdsAValue(const std::string& line) {
  const std::size_t colon = line.find(": ");
  return line.starts_with("  # ") && colon != std::string::npos && line.rfind("  # ") > colon &&
         isWord(std::string_view(line).substr(4, colon - 4));
}

/// The file with every value uncommented.
std::string uncommented(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string text;
  for (std::string line; std::getline(stream, line);)
    text += (holdsAValue(line) ? "  " + line.substr(4) : line) + "\n";
  return text;
}

void expectLoads(const std::filesystem::path& file, Settings& settings) {
  const auto loaded = loadSettings(file);
  if (loaded) {
    settings = *loaded;
    return;
  }
  for (const base::Error& error : loaded.error()) ADD_FAILURE() << error.text();
}

void expectRows(std::span<const Parameter> parameters, const std::string& readme) {
  const std::string text = test::contentOf(std::filesystem::path(HAPTICD_SOURCE) / readme);
  for (const Parameter& parameter : parameters) {
    const std::string standard = toText(parameter.defaultValue());
    const std::string row =
        fmt::format("| `{}` | {} | {} | {} |\n", parameter.name, standard.empty() ? "empty" : standard,
                    parameter.range(), parameter.help);
    EXPECT_NE(text.find(row), std::string::npos) << row;
  }
}

TEST(StandInParameters, AreInTheReadmeOfTheirDriver) {
  std::size_t count = 1;  // control.allow_fault_injection
  const auto expectRowsOf = [&count](const auto& driver, const std::string& folder) {
    if (!driver.stands_in) return;
    expectRows(driver.parameters, fmt::format("drivers/{}/{}/README.md", folder, driver.word));
    count += driver.parameters.size();
  };
  for (const CameraDriver& driver : cameraDrivers()) expectRowsOf(driver, "camera");
  for (const HandleDriver& driver : handleDrivers()) expectRowsOf(driver, "handle");
  EXPECT_EQ(standInParameters().size(), count);
  const std::string faults = test::contentOf(std::filesystem::path(HAPTICD_SOURCE) / "docs/faults.md");
  EXPECT_NE(faults.find("`control.allow_fault_injection`"), std::string::npos);
}

TEST(ShippedFiles, HapticdYamlChangesNothingAsItIsShipped) {
  Settings settings;
  expectLoads(kShipped / "hapticd.yaml", settings);
  for (const Parameter& parameter : parameterTable()) {
    EXPECT_EQ(parameter.get(settings), parameter.defaultValue()) << parameter.name;
  }
}

TEST(ShippedFiles, HapticdYamlLoadsWithEveryCommentMarkDeleted) {
  const test::TemporaryFolder folder;
  Settings settings;
  expectLoads(folder.write("all.yaml", uncommented(kShipped / "hapticd.yaml")), settings);
  for (const Parameter& parameter : parameterTable()) {
    EXPECT_EQ(parameter.get(settings), parameter.defaultValue()) << parameter.name;
  }
}

TEST(ShippedFiles, HapticdYamlIsForARealBox) {
  Settings settings;
  expectLoads(kShipped / "hapticd.yaml", settings);
  EXPECT_EQ(settings.camera.driver, "freenect");
  EXPECT_TRUE(settings.control.status_socket.starts_with("/run/hapticd/"));
  EXPECT_TRUE(settings.control.control_socket.starts_with("/run/hapticd/"));
  EXPECT_GT(settings.loop.priority, 0);
  EXPECT_FALSE(settings.control.engage_at_start);
}

TEST(ShippedFiles, DemoYamlNeedsNoDeviceAndNoPrivilege) {
  Settings settings;
  expectLoads(kShipped / "demo.yaml", settings);
  EXPECT_EQ(settings.camera.driver, "synthetic");
  EXPECT_EQ(settings.handle.driver, "simulated");
  EXPECT_TRUE(settings.control.engage_at_start);
  EXPECT_EQ(settings.live.safety.handle_timeout_s, 0.05);
  EXPECT_TRUE(std::filesystem::path(settings.control.status_socket).is_relative());
  EXPECT_TRUE(std::filesystem::path(settings.control.control_socket).is_relative());
}

TEST(ShippedFiles, DemoFixturesYamlIsTheDemonstrationWithARestingBallAndNothingAdded) {
  Settings settings;
  expectLoads(kShipped / "demo-fixtures.yaml", settings);
  EXPECT_TRUE(settings.additions.fixtures.empty());
  EXPECT_TRUE(settings.additions.regions.empty());
  EXPECT_EQ(settings.camera.driver, "synthetic");
  EXPECT_EQ(settings.handle.driver, "simulated");
  EXPECT_EQ(settings.camera.of<drivers::SyntheticSettings>().motion_amplitude_m, 0);
  EXPECT_EQ(settings.namedLaw(), rt::ForceLaw::surface);
  EXPECT_TRUE(settings.control.engage_at_start);
  const double front_m = settings.camera.of<drivers::SyntheticSettings>().distance_m -
                         settings.camera.of<drivers::SyntheticSettings>().sphere_radius_m;
  const double start_m = -settings.handle.of<drivers::SimulatedHandleSettings>().start_m_in_world.z;
  EXPECT_LT(start_m, front_m);
  EXPECT_GT(start_m + settings.handle.of<drivers::SimulatedHandleSettings>().travel_m, front_m);
}

// The hand moves along -z and strokes perpendicular to it, the sphere along x: for all phases of both, the
// line of the hand meets the sphere within the travel and in front of the hand's start.
TEST(ShippedFiles, TheHandOfDemoYamlAlwaysMeetsTheSphere) {
  Settings settings;
  expectLoads(kShipped / "demo.yaml", settings);
  const drivers::SyntheticSettings& scene = settings.camera.of<drivers::SyntheticSettings>();
  const drivers::SimulatedHandleSettings& hand = settings.handle.of<drivers::SimulatedHandleSettings>();
  ASSERT_EQ(scene.scene, drivers::SyntheticScene::moving_sphere);
  ASSERT_EQ(hand.direction_in_world, (rt::Vec3{0, 0, -1}));
  ASSERT_EQ(settings.camera.pose().position_m, rt::Vec3{});
  const double widest_miss_m =
      std::hypot(hand.start_m_in_world.x, hand.start_m_in_world.y) + hand.stroke_m + scene.motion_amplitude_m;
  EXPECT_LT(widest_miss_m, 0.75 * scene.sphere_radius_m);
  const double nearest_surface_m = scene.distance_m - scene.sphere_radius_m;
  EXPECT_GT(-hand.start_m_in_world.z, settings.camera.near_m);
  EXPECT_LT(-hand.start_m_in_world.z, nearest_surface_m - settings.live.force.radius_m);
  EXPECT_GT(-hand.start_m_in_world.z + hand.travel_m, scene.distance_m);
  EXPECT_LT(hand.press_force_n, settings.live.safety.max_force_n);
}

// The shipped configuration and the documentation show every member of fixtures and regions with its range.

const std::string kSource = HAPTICD_SOURCE;

/// The section of the shipped configuration from `fixtures:` on, without its comment marks.
std::string shippedSection() {
  std::istringstream lines(test::contentOf(kSource + "/config/hapticd.yaml"));
  std::string section;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#') && (!section.empty() || line == "# fixtures:"))
      section += line.substr(2) + "\n";
  }
  return section;
}

std::string listOf(const std::string& section, const AdditionType& type) {
  const std::size_t frames = section.find("\nframes:");
  const std::size_t regions = section.find("\nregions:");
  if (type.noun == "fixture") return section.substr(0, frames);
  return type.noun == "frame" ? section.substr(frames, regions - frames) : section.substr(regions);
}

void expectEveryMember(const AdditionType& type) {
  const std::string section = listOf(shippedSection(), type);
  for (const AdditionField& field : type.fields) {
    const std::size_t name = section.find(" " + std::string(field.name) + ": ");
    ASSERT_NE(name, std::string::npos) << field.name;
    const std::string line = section.substr(name, section.find('\n', name) - name);
    // a member of several kinds has its range where it is first
    EXPECT_TRUE(line.ends_with("  # " + rangeOf(field))) << line << "\n" << rangeOf(field);
  }
}

TEST(ShippedFixtures, ShowEveryMemberWithItsRange) {
  expectEveryMember(typeOf(FixtureSettings{}));
  expectEveryMember(typeOf(RegionSettings{}));
  expectEveryMember(typeOf(FrameSettings{}));
}

TEST(ShippedFixtures, LoadWithEveryCommentMarkDeleted) {
  const auto additions = additionsFromText(shippedSection(), "hapticd.yaml");
  ASSERT_TRUE(additions) << additions.error().front().error.text();
  EXPECT_EQ(additions->fixtures.size(), rt::kWords<rt::FixtureKind>.size() + 1) << "and one that slows";
  EXPECT_EQ(additions->regions.size(), 3U);
  EXPECT_EQ(additions->frames.size(), 1U);
}

TEST(FixturesDocument, ShowsAnExampleThatLoads) {
  const std::string document = test::contentOf(kSource + "/docs/fixtures.md");
  const std::size_t reference = document.find("## Reference");
  const std::size_t begin = document.find("```yaml\n", reference) + 8;
  const auto additions =
      additionsFromText(document.substr(begin, document.find("```", begin) - begin), "example");
  ASSERT_TRUE(additions) << additions.error().front().error.text();
  EXPECT_EQ(additions->fixtures.size(), 3U);
}

TEST(FixturesDocument, ShowsMarginsAndASlowingRegionThatLoad) {
  const std::string document = test::contentOf(kSource + "/docs/fixtures.md");
  for (const std::string heading : {"### Margins and breaches", "### Regions that slow the hand"}) {
    const std::size_t begin = document.find("```yaml\n", document.find(heading)) + 8;
    const auto additions = additionsFromText(
        "fixtures:\n" + document.substr(begin, document.find("```", begin) - begin), "example");
    ASSERT_TRUE(additions) << additions.error().front().error.text();
    EXPECT_EQ(additions->fixtures.size(), 1U);
  }
}

// Messages name parameters; a name that does not exist sends the reader nowhere. Documents: tests/style.

namespace fs = std::filesystem;

/// Returns the texts of a source that people read: literals of more than one word, without comments.
std::string textsIn(const fs::path& file) {
  static const std::regex literal(R"re("((?:[^"\\\n]|\\.)*)")re");
  const std::string source = test::contentOf(file);
  std::string texts;
  for (std::sregex_iterator found(source.begin(), source.end(), literal), end; found != end; ++found) {
    const std::string text = (*found)[1];
    if (text.find(' ') != std::string::npos) texts += text + "\n";
  }
  return texts;
}

TEST(ParametersInTexts, ExistInTheTable) {
  std::set<std::string> groups;
  for (const Parameter& parameter : allParameters()) {
    groups.emplace(parameter.group());
  }
  // in braces stand fields of the status
  static const std::regex dotted(R"re((?:^|[^\w./{-])([a-z_]+)\.([a-z][a-z0-9_]*)(?![\w.(/]))re");
  static const std::set<std::string> endings{"h", "cpp", "yaml", "csv", "json", "conf"};
  int names = 0;
  for (const char* folder : {"config", "daemon", "drivers", "tools"}) {
    for (const fs::directory_entry& entry :
         fs::recursive_directory_iterator(fs::path(HAPTICD_SOURCE) / folder)) {
      if (entry.path().extension() != ".cpp" && entry.path().extension() != ".h") continue;
      const std::string texts = textsIn(entry.path());
      for (std::sregex_iterator found(texts.begin(), texts.end(), dotted), end; found != end; ++found) {
        const std::string group = (*found)[1], name = (*found)[2];
        if (!groups.contains(group) || endings.contains(name)) continue;
        ++names;
        EXPECT_TRUE(findParameter(group + "." + name) != nullptr)
            << entry.path() << " names " << group << "." << name;
      }
    }
  }
  EXPECT_GT(names, 20);
}

}  // namespace
}  // namespace hapticd::config
