// SPDX-License-Identifier: Apache-2.0
// What is wrong with a configuration is said with its place, what is allowed and what to do, to the letter:
// refusals/*.golden.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "config/settings/fixture_settings.h"
#include "config/settings/parameter_table.h"
#include "config/yaml_loader.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/laws/law_table.h"
#include "rt/modelling/scene_builder.h"
#include "tests/support/golden_file.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

using Texts = std::vector<std::string>;

std::string golden(const char* name) {
  return std::string(HAPTICD_SOURCE "/tests/unit/config/refusals/") + name;
}

/// All errors, without the folder of the file.
std::string refusalOf(const std::string& yaml, const Texts& overrides = {}) {
  const test::TemporaryFolder folder;
  const auto settings = loadSettings(folder.write("bad.yaml", yaml), overrides);
  if (settings) return "";
  const std::string prefix = folder.path().string() + "/";
  std::string texts;
  for (const base::Error& error : settings.error()) {
    const std::string text = error.text();
    texts += (text.starts_with(prefix) ? text.substr(prefix.size()) : text) + "\n";
  }
  return texts;
}

TEST(Refusal, OfASettingNamesEachError) {
  test::expectGolden(golden("settings.golden"), [](std::string yaml) {
    constexpr std::string_view kSet = "--set ";
    Texts overrides;
    while (yaml.starts_with(kSet)) {
      overrides.push_back(yaml.substr(kSet.size(), yaml.find('\n') - kSet.size()));
      yaml.erase(0, yaml.find('\n') + 1);
    }
    return refusalOf(yaml, overrides);
  });
}

TEST(Refusal, OfAnUnknownAliasNamesTheLine) {
  const std::string text = refusalOf("loop: *one");
  // yaml-cpp names the alias since version 0.8
  EXPECT_TRUE(text.starts_with("bad.yaml:1: is not YAML: the referenced anchor is not defined")) << text;
}

std::string allTexts(const std::vector<AdditionError>& errors) {
  std::string texts;
  for (const AdditionError& error : errors) texts += error.error.text() + "\n";
  return texts;
}

TEST(Refusal, OfAFixtureOrRegionNamesItTheMemberAndARemedy) {
  test::expectGolden(golden("additions.golden"), [](const std::string& text) {
    const auto additions = additionsFromText(text, "f.yaml");
    if (additions) return std::string();
    std::string answer;
    for (const AdditionError& error : additions.error()) {
      EXPECT_FALSE(error.error.remedy.empty()) << text;
      answer += fmt::format("{} | {} | {}\n", error.name, error.field, error.error.text());
    }
    return answer;
  });
}

TEST(AdditionsText, MayHaveOtherTransitionsForShapesThanForLabels) {
  const std::string label = "place: label, transition_m: 0.02, label: ";
  const auto additions = additionsFromText(
      "label_image: l.pgm\nregions: [{name: a, shape: sphere, position_m: [0, 0, 0], "
      "radius_m: 0.1, transition_m: 0.01}, {name: b, " +
          label + "1}, {name: c, " + label + "2}]",
      "f.yaml");
  EXPECT_TRUE(additions) << allTexts(additions.error());
}

TEST(AdditionsText, DoesNotCompareTransitionsOfLabelsWhereOneIsUnknown) {
  const std::string label = "place: label, transition_m: ";
  const auto additions = additionsFromText("label_image: l.pgm\nregions: [{name: a, " + label +
                                               "wide, label: 1}, {name: b, " + label + "0.02, label: 2}]",
                                           "f.yaml");
  ASSERT_FALSE(additions);
  ASSERT_EQ(additions.error().size(), 1U) << allTexts(additions.error());
  EXPECT_EQ(additions.error()[0].name, "a");
}

TEST(AdditionsText, AreAllRefusedTogetherInTheOrderOfTheirLines) {
  const auto additions = additionsFromText(
      "fixtures:\n"
      "  - name: a\n"
      "    kind: sphere\n"
      "    position_m: [0, 0, 0]\n"
      "    radius_m: -1\n"
      "    side: left\n"
      "  - name: b\n"
      "    kind: nothing\n"
      "regions:\n"
      "  - name: c\n"
      "    shape: sphere\n"
      "    position_m: [0, 0, 0]\n"
      "    radius_m: 0.1\n"
      "    friction: 9\n",
      "f.yaml");
  ASSERT_FALSE(additions);
  EXPECT_EQ(
      allTexts(additions.error()),
      "f.yaml:5: fixture a: radius_m: -1 m is out of range (set radius_m to 0.0001..10 m)\n"
      "f.yaml:6: fixture a: side: \"left\" is not an allowed choice (set side to one of: out, in, both)\n"
      "f.yaml:8: fixture b: kind: \"nothing\" is not an allowed choice (set kind to one of: standoff, plane, "
      "box, sphere, capsule, cone, solid, path, point)\n"
      "f.yaml:14: region c: friction: 9 is out of range (set friction to 0..2)\n");
}

std::string times(std::size_t count, const std::string& text) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}
std::string path(const std::string& points) {
  return "fixtures: [{name: a, kind: path, points_m: [" + points + "]}]";
}

TEST(AdditionsText, WithAMillionPointsIsRefusedByItsLength) {
  const auto additions = additionsFromText(path(times(1'000'000, "[0,0,0],")), "f.yaml");
  ASSERT_FALSE(additions);
  ASSERT_EQ(additions.error().size(), 1U);
  EXPECT_EQ(additions.error()[0].error.text(),
            "f.yaml: is longer than 1 MiB (a path has at most 256 points; leave out the others)");
}

TEST(AdditionsText, WithAHundredThousandPointsNamesTheFixtureAndIsNotReadToItsEnd) {
  const auto additions = additionsFromText(path(times(100'000, "[0,0,0],")), "f.yaml");
  ASSERT_FALSE(additions);
  ASSERT_EQ(additions.error().size(), 2U) << allTexts(additions.error());
  EXPECT_EQ(additions.error()[0].name, "a");
  EXPECT_EQ(additions.error()[0].field, "points_m");
  EXPECT_NE(additions.error()[0].error.what.find("has at least "), std::string::npos);
  EXPECT_NE(additions.error()[1].error.what.find("not read any further"), std::string::npos);
}

TEST(AdditionsText, DamagedYamlIsRefusedWithItsLine) {
  for (const char* const text :
       {"fixtures: [{name: a", "fixtures:\n  - name: a\n    kind: *b\n", "fixtures: [{name: !x a}]",
        "fixtures:\n  - name: a\n    kind:\n      sphere\n", "fixtures: []\nfixtures: []\n"}) {
    const auto additions = additionsFromText(text, "f.yaml");
    ASSERT_FALSE(additions) << text;
    EXPECT_TRUE(additions.error()[0].error.text().starts_with("f.yaml:"))
        << additions.error()[0].error.text();
  }
}

Settings with(const Texts& changes) {
  Settings settings;
  for (const std::string& change : changes) {
    const base::Result<void> result = setFromText(settings, change);
    EXPECT_TRUE(result) << result.error().text();
  }
  return settings;
}

Texts textsFor(const Texts& changes) {
  Texts texts;
  for (const base::Error& error : checkTogether(with(changes))) texts.push_back(error.text());
  return texts;
}

TEST(Refusal, OfValuesTogetherNamesTheRuleAndTheOtherValue) {
  test::expectGolden(golden("rules.golden"), [](const std::string& input) {
    Texts changes;
    std::istringstream lines(input);
    for (std::string line; std::getline(lines, line);) changes.push_back(line);
    std::string answer;
    for (const std::string& text : textsFor(changes)) answer += text + "\n";
    return answer;
  });
}

TEST(UdpPeer, IsOneComputer) {
  for (const char* peer : {"192.0.2.10", "192.0.2.10:1", "192.0.2.10:65535", "223.255.255.255"}) {
    for (const char* address : {"192.0.2.1", "0.0.0.0"})
      EXPECT_EQ(
          textsFor({fmt::format("udp_handle.address={}", address), fmt::format("udp_handle.peer={}", peer)}),
          Texts{})
          << peer;
  }
  for (const char* peer :
       {"device", "192.0.2", "192.0.2.256", "192.0.2.10:", "192.0.2.10:0", "192.0.2.10:65536",
        "192.0.2.10:1x", "192.0.2.10: 1", " 192.0.2.10", "::1", "0.0.0.0", "224.0.0.1", "255.255.255.255"}) {
    const Texts found = textsFor({"udp_handle.address=192.0.2.1", fmt::format("udp_handle.peer={}", peer)});
    ASSERT_EQ(found.size(), 1U) << peer;
    EXPECT_NE(found[0].find("write it as 192.0.2.10, or with a port as 192.0.2.10:47801"), std::string::npos);
  }
}

// The window is fixed; each law must find in it what it reaches with the largest values of its parameters,
// and one voxel on each side, because the window follows the HIP in whole voxels.
TEST(Window, HoldsTheReachOfEveryLawWithEveryValue) {
  const Settings settings = with({"force.radius_m=0.1", "contact.proxy_radius_m=0.03"});
  EXPECT_FALSE(findParameter("force.radius_m")->check(0.1001));
  EXPECT_FALSE(findParameter("contact.proxy_radius_m")->check(0.0301));
  for (const rt::ForceLawRow& law : rt::kForceLaws) {
    rt::LiveParameters live = settings.live;
    live.law = law.law;
    const double reach_m = rt::reachOfModel_m(rt::SceneNeeds::of(live), settings.grid);
    EXPECT_LE(2 * reach_m + 2 * settings.grid.voxel_edge_m,
              settings.grid.cells_per_axis * settings.grid.voxel_edge_m)
        << rt::wordOf(law.law);
  }
}

// Settings that did not pass the table, as a program could make them.
TEST(NumbersThatAreNotFinite, ViolateTheRules) {
  Settings settings = with({"camera.driver=v4l2", "force.law=nearest_springs"});
  settings.camera.near_m = std::nan("");
  settings.live.force.radius_m = std::nan("");
  settings.handle.of<drivers::SimulatedHandleSettings>().direction_in_world.x = std::nan("");
  EXPECT_EQ(checkTogether(settings).size(), 3U);
}

}  // namespace
}  // namespace hapticd::config
