// SPDX-License-Identifier: Apache-2.0
// Fixtures and regions as part of a configuration, and what follows from them for the force law.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "config/settings/law_choice.h"
#include "config/settings/parameter_table.h"
#include "config/settings_summary.h"
#include "config/yaml_loader.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

constexpr const char* kStandoff = "fixtures: [{name: nerve, kind: standoff, clearance_m: 0.005}]\n";

std::vector<std::string> textsFor(const std::string& yaml) {
  std::vector<std::string> texts;
  if (const auto settings = settingsFromText(yaml, "a.yaml"); !settings) {
    for (const base::Error& error : settings.error()) texts.push_back(error.text());
  }
  return texts;
}

Settings settingsOf(const std::string& yaml) {
  const auto settings = settingsFromText(yaml, "a.yaml");
  EXPECT_TRUE(settings) << settings.error().front().text();
  return settings.value_or(Settings{});
}

TEST(AdditionsInSettings, StandBesideTheParameters) {
  const Settings settings = settingsOf("force: {law: surface}\n" + std::string(kStandoff) +
                                       "label_image: labels.pgm\n"
                                       "regions:\n"
                                       "  - {name: bone, place: label, label: 2}\n"
                                       "trace:\n"
                                       "  at_start: true\n");
  ASSERT_EQ(settings.additions.fixtures.size(), 1U);
  EXPECT_EQ(settings.additions.fixtures[0].clearance_m, 0.005);
  ASSERT_EQ(settings.additions.regions.size(), 1U);
  EXPECT_EQ(settings.additions.label_image, "labels.pgm");
  EXPECT_EQ(settings.live.force.law, rt::ForceLaw::surface);
  EXPECT_TRUE(settings.trace.at_start);
}

TEST(AdditionsInSettings, AreRefusedTogetherWithTheParameters) {
  EXPECT_EQ(textsFor("force: {radius_m: 7}\n"
                     "fixtures:\n"
                     "  - name: nerve\n"
                     "    kind: standoff\n"
                     "    clearance_m: 7\n"
                     "trace: {at_start: 1}\n"),
            (std::vector<std::string>{
                "a.yaml:1: force.radius_m: 7 m is out of range (allowed: 0.005..0.1 m)",
                "a.yaml:5: fixture nerve: clearance_m: 7 m is out of range (set clearance_m to 0..0.05 m)",
                "a.yaml:6: trace.at_start: \"1\" is not a truth value (allowed: true or false)"}));
}

TEST(AdditionsInSettings, AreRefusedIfTheyAreNoLists) {
  EXPECT_EQ(
      textsFor("fixtures: 3\nlabel_image: {a: 1}\n"),
      (std::vector<std::string>{
          "a.yaml:1: fixtures: \"3\" is not a list (write it as a list of mappings, or as `fixtures: []`)",
          "a.yaml:2: label_image: is a mapping (write the path of a PGM file)"}));
}

TEST(AdditionsInSettings, AreCountedInTheSummary) {
  const test::TemporaryFolder folder;
  const auto text = [&folder](const std::string& yaml) {
    const auto loaded = loadConfiguration(folder.write("a.yaml", yaml), {}, base::FileKind::regular);
    return loaded ? summaryOf(*loaded).text() : loaded.error().front().text();
  };
  EXPECT_EQ(text(kStandoff), "0 parameters set, 1 fixture, none differs from the defaults");
  EXPECT_EQ(
      text("regions: [{name: a, shape: sphere, position_m: [0, 0, 0], radius_m: 1}, {name: b, shape: sphere, "
           "position_m: [0, 0, 0], radius_m: 1}]\nforce: {min_points: 11}\n"),
      "1 parameter set, 2 tissue regions, 1 differs from the defaults: force.min_points = 11 (default 10)");
}

TEST(AdditionsInSettings, ArePartOfProfilesButNotOfOtherParts) {
  const auto any = [](const Parameter&) { return true; };
  const auto part = partFromText("fixtures: []\nforce: {min_points: 11}\n", "part.yaml", any);
  ASSERT_TRUE(part) << part.error().front().text();
  EXPECT_EQ(part->assignments.size(), 1U);
  EXPECT_TRUE(part->additions.fixtures);
  EXPECT_FALSE(part->additions.regions);
  SceneAdditions additions{{{.name = "a"}}, {{.name = "b"}}, "c"};
  part->additions.applyTo(additions);
  EXPECT_TRUE(additions.fixtures.empty());
  EXPECT_EQ(additions.regions.size(), 1U);
  EXPECT_EQ(additions.label_image, "c");

  const auto refused = assignmentsFromText("fixtures: []\n", "part.yaml", any);
  ASSERT_FALSE(refused);
  EXPECT_EQ(
      refused.error().front().text(),
      "part.yaml:1: fixtures: is not part of this file (remove it; it belongs in hapticd.yaml or a profile)");
}

TEST(Standoff, NeedsTheLawSurface) {
  EXPECT_EQ(textsFor(kStandoff), std::vector<std::string>{});
  EXPECT_EQ(textsFor(kStandoff + std::string("force: {law: surface}")), std::vector<std::string>{});
  EXPECT_EQ(
      textsFor(kStandoff + std::string("force: {law: proxy}")),
      std::vector<std::string>{
          "a.yaml:2: force.law: proxy has no surface from which the stand-off fixture nerve could keep its "
          "clearance (set force.law to surface or auto, or disable the fixture nerve)"});
  EXPECT_EQ(textsFor("force: {law: proxy}\n"
                     "fixtures: [{name: nerve, kind: standoff, clearance_m: 0.005, enabled: false}]\n"),
            std::vector<std::string>{});
}

TEST(Standoff, MakesAutoChooseTheSurface) {
  const Settings settings = settingsOf(
      "fixtures:\n"
      "  - {name: nerve, kind: standoff, clearance_m: 0.005}\n"
      "  - {name: vein, kind: standoff, clearance_m: 0.02}\n"
      "  - {name: gone, kind: standoff, clearance_m: 0.04, enabled: false}\n"
      "force: {max_error_n: 10}\n");
  const LawDecision decision = chooseLaw(settings, asSeenBy({}, 1));
  EXPECT_EQ(decision.law, rt::ForceLaw::surface);
  EXPECT_FALSE(decision.filtered);
  EXPECT_TRUE(decision.within);
  EXPECT_GT(decision.error_n, 0);
  EXPECT_EQ(decision.reason, "the only law that the stand-off fixture vein can act with");
  EXPECT_EQ(liveWith(settings, decision).standoff_clearance_m, 0.02);
  EXPECT_EQ(settings.effectiveLive().standoff_clearance_m, 0.02);
  for (const rt::LiveParameters& live : lawsThatMayAct(settings)) {
    EXPECT_EQ(live.law, rt::ForceLaw::surface);
    EXPECT_EQ(live.standoff_clearance_m, 0.02);
  }
  const Settings soft = settingsOf(
      "fixtures: [{name: nerve, kind: standoff, clearance_m: 0.02},"
      " {name: vein, kind: standoff, clearance_m: 0.015, soft_m: 0.01}]\n");
  EXPECT_EQ(soft.effectiveLive().standoff_clearance_m, 0.025) << "from where the soft layer begins";
}

TEST(Standoff, ChangesNothingWhereThereIsNone) {
  Settings settings;
  settings.live.force.max_error_n = 10;
  for (const double distance_m : {0.6, 1.0, 2.0, 3.5}) {
    const SurfaceAsSeen seen = asSeenBy({}, distance_m);
    const LawDecision with = chooseLaw(settings, seen);
    const LawDecision without = chooseLaw(10, settings.live.force.stiffness_n_per_m, seen);
    EXPECT_EQ(with.law, without.law) << distance_m;
    EXPECT_EQ(with.reason, without.reason) << distance_m;
  }
  EXPECT_EQ(settings.effectiveLive().standoff_clearance_m, 0);
}

}  // namespace
}  // namespace hapticd::config
