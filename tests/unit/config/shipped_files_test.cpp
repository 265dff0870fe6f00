#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include "config/parameter_table.h"
#include "config/yaml_loader.h"
#include "temporary_folder.h"

namespace hapticd::config {
namespace {

const std::filesystem::path kShipped = HAPTICD_SHIPPED_CONFIG;

// A line `# name: value  # range; live` and the comment above it.
struct Documented {
  std::string value;
  std::string range;
  std::string help;
};

struct DocumentedFile {
  std::map<std::string, Documented> parameters;  ///< by "group.name"
  std::vector<std::string> order;
  std::string uncommented;  ///< the file with every value in force
};

DocumentedFile readDocumentation(const std::filesystem::path& file) {
  static const std::regex kGroup(R"(([a-z_]+):)");
  static const std::regex kValue(R"(  # ([a-z_]+): (\S+)  # (.*))");
  DocumentedFile documentation;
  std::ifstream stream(file);
  std::string group;
  std::string above;
  for (std::string line; std::getline(stream, line); above = line) {
    std::smatch match;
    if (std::regex_match(line, match, kGroup)) group = match[1];
    if (!std::regex_match(line, match, kValue)) {
      documentation.uncommented += line + "\n";
      continue;
    }
    const std::string name = group + "." + match[1].str();
    documentation.parameters[name] = {match[2], match[3], above};
    documentation.order.push_back(name);
    documentation.uncommented += "  " + line.substr(4) + "\n";
  }
  return documentation;
}

void expectLoads(const std::filesystem::path& file, Settings& settings) {
  const auto loaded = loadSettings(file);
  if (loaded) {
    settings = *loaded;
    return;
  }
  for (const Error& error : loaded.error()) ADD_FAILURE() << error.text();
}

TEST(ShippedFiles, HapticdYamlNamesEveryParameterInTheOrderOfTheTable) {
  std::vector<std::string> names;
  for (const Parameter& parameter : parameterTable()) names.emplace_back(parameter.name);
  EXPECT_EQ(readDocumentation(kShipped / "hapticd.yaml").order, names);
}

TEST(ShippedFiles, HapticdYamlShowsDefaultRangeAndHelpOfTheTable) {
  const DocumentedFile documentation = readDocumentation(kShipped / "hapticd.yaml");
  for (const Parameter& parameter : parameterTable()) {
    const auto found = documentation.parameters.find(std::string(parameter.name));
    ASSERT_NE(found, documentation.parameters.end()) << parameter.name;
    const std::string standard = toText(parameter.defaultValue());
    EXPECT_EQ(found->second.value, standard.empty() ? "\"\"" : standard) << parameter.name;
    EXPECT_EQ(found->second.range, parameter.range() + (parameter.effect == Effect::live ? "; live" : ""))
        << parameter.name;
    const std::string help = std::string(parameter.help).substr(1);  // the first letter is a capital there
    EXPECT_NE(found->second.help.find(help), std::string::npos) << found->second.help;
    EXPECT_NE(found->second.help.find(std::string(parameter.symbol)), std::string::npos) << parameter.name;
  }
}

TEST(ShippedFiles, HapticdYamlChangesNothingAsItIsShipped) {
  Settings settings;
  expectLoads(kShipped / "hapticd.yaml", settings);
  for (const Parameter& parameter : parameterTable()) {
    EXPECT_EQ(parameter.get(settings), parameter.defaultValue()) << parameter.name;
  }
}

TEST(ShippedFiles, HapticdYamlLoadsWithEveryCommentMarkDeleted) {
  const TemporaryFolder folder;
  const std::string uncommented = readDocumentation(kShipped / "hapticd.yaml").uncommented;
  Settings settings;
  expectLoads(folder.write("all.yaml", uncommented), settings);
  for (const Parameter& parameter : parameterTable()) {
    EXPECT_EQ(parameter.get(settings), parameter.defaultValue()) << parameter.name;
  }
}

TEST(ShippedFiles, HapticdYamlIsForARealBox) {
  Settings settings;
  expectLoads(kShipped / "hapticd.yaml", settings);
  EXPECT_EQ(settings.camera.driver, CameraDriver::freenect);
  EXPECT_TRUE(settings.control.status_socket.starts_with("/run/hapticd/"));
  EXPECT_TRUE(settings.control.control_socket.starts_with("/run/hapticd/"));
  EXPECT_TRUE(settings.loop.lock_memory);
  EXPECT_GT(settings.loop.priority, 0);
  EXPECT_FALSE(settings.control.engage_at_start);
}

TEST(ShippedFiles, DemoYamlNeedsNoDeviceAndNoPrivilege) {
  Settings settings;
  expectLoads(kShipped / "demo.yaml", settings);
  EXPECT_EQ(settings.camera.driver, CameraDriver::synthetic);
  EXPECT_EQ(settings.handle.driver, HandleDriver::simulated);
  EXPECT_TRUE(settings.control.engage_at_start);
  EXPECT_EQ(settings.live.safety.handle_timeout_s, 0.05);
  EXPECT_TRUE(std::filesystem::path(settings.control.status_socket).is_relative());
  EXPECT_TRUE(std::filesystem::path(settings.control.control_socket).is_relative());
}

// The hand moves along -z and strokes at right angles to it, the sphere along x: whatever the phases of the
// two, the line of the hand meets the sphere, within the travel and in front of the hand's start.
TEST(ShippedFiles, TheHandOfDemoYamlAlwaysMeetsTheSphere) {
  Settings settings;
  expectLoads(kShipped / "demo.yaml", settings);
  const SyntheticSettings& scene = settings.synthetic;
  const SimulatedHandleSettings& hand = settings.handle.simulated;
  ASSERT_EQ(scene.scene, SyntheticScene::moving_sphere);
  ASSERT_EQ(hand.direction_in_world, (rt::Vec3{0, 0, -1}));
  ASSERT_EQ(settings.camera.pose.position_m, rt::Vec3{});
  const double widest_miss_m =
      std::hypot(hand.start_m_in_world.x, hand.start_m_in_world.y) + hand.stroke_m + scene.motion_amplitude_m;
  EXPECT_LT(widest_miss_m, 0.75 * scene.sphere_radius_m);
  const double nearest_surface_m = scene.distance_m - scene.sphere_radius_m;
  EXPECT_GT(-hand.start_m_in_world.z, settings.camera.depth_model.near_m);
  EXPECT_LT(-hand.start_m_in_world.z, nearest_surface_m - settings.live.springs.radius_m);
  EXPECT_GT(-hand.start_m_in_world.z + hand.travel_m, scene.distance_m);
  EXPECT_LT(hand.press_force_n, settings.live.safety.max_force_n);
}

}  // namespace
}  // namespace hapticd::config
