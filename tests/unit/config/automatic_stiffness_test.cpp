// SPDX-License-Identifier: Apache-2.0
// force.stiffness_n_per_m is a number or `auto`.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "config/settings/parameter_table.h"
#include "config/settings/yaml_text.h"
#include "config/yaml_loader.h"

namespace hapticd::config {
namespace {

Settings with(const std::vector<std::string>& changes) {
  Settings settings;
  for (const std::string& change : changes) {
    const base::Result<void> result = setFromText(settings, change);
    EXPECT_TRUE(result) << result.error().text();
  }
  return settings;
}

void expectAutomatic(const rt::LiveParameters& live, double ceiling_n_per_m) {
  EXPECT_TRUE(live.force.stiffness_is_automatic);
  EXPECT_EQ(live.force.stiffness_ceiling_n_per_m, ceiling_n_per_m);
  EXPECT_EQ(live.force.stiffness_n_per_m, ceiling_n_per_m);
}

TEST(AutomaticStiffness, IsOffUnlessRequested) {
  EXPECT_FALSE(Settings{}.live.force.stiffness_is_automatic);
  EXPECT_EQ(findParameter("force.stiffness_n_per_m")->defaultValue(), Value(500.0));
}

TEST(AutomaticStiffness, HoldsTheCeilingInWhicheverOrderTheTwoAreSet) {
  expectAutomatic(with({"force.stiffness_n_per_m=auto"}).live, 1000);
  expectAutomatic(with({"force.stiffness_n_per_m=auto", "force.stiffness_ceiling_n_per_m=700"}).live, 700);
  expectAutomatic(with({"force.stiffness_ceiling_n_per_m=700", "force.stiffness_n_per_m=auto"}).live, 700);
}

TEST(AutomaticStiffness, EndsWithANumber) {
  const Settings settings = with({"force.stiffness_n_per_m=auto", "force.stiffness_n_per_m=450"});
  EXPECT_FALSE(settings.live.force.stiffness_is_automatic);
  EXPECT_EQ(settings.live.force.stiffness_n_per_m, 450);
  const Settings ceiling = with({"force.stiffness_ceiling_n_per_m=700"});
  EXPECT_EQ(ceiling.live.force.stiffness_n_per_m, 500);
}

TEST(AutomaticStiffness, IsReadFromAllTexts) {
  for (const char* const text :
       {"force: {stiffness_n_per_m: auto}", "force: {stiffness_n_per_m: \"auto\"}",
        R"({"force": {"stiffness_n_per_m": "auto"}})", "force:\n  stiffness_n_per_m: auto\n"}) {
    const auto settings = settingsFromText(text, "text");
    ASSERT_TRUE(settings) << text << settings.error().front().text();
    expectAutomatic(settings->live, 1000);
  }
  const auto quoted = settingsFromText("force: {stiffness_n_per_m: \"300\"}", "text");
  ASSERT_FALSE(quoted);
  EXPECT_NE(quoted.error().front().text().find("is text because of its quotes"), std::string::npos);
}

TEST(AutomaticStiffness, ReadsBackFromItsText) {
  const Settings settings = with({"force.stiffness_n_per_m=auto", "force.stiffness_ceiling_n_per_m=700"});
  const auto read = settingsFromText(yamlText(settings), "text");
  ASSERT_TRUE(read) << read.error().front().text();
  expectAutomatic(read->live, 700);
}

TEST(AutomaticStiffness, IsTheOnlyWord) {
  const Parameter& parameter = *findParameter("force.stiffness_n_per_m");
  EXPECT_EQ(parameter.range(), "0..5000 N/m or auto");
  EXPECT_EQ(parameter.check(std::string("auto")).value(), Value(std::string("auto")));
  for (const char* const word : {"automatic", "AUTO", "", "auto "}) {
    EXPECT_FALSE(parameter.parse(word)) << word;
    EXPECT_FALSE(parameter.check(std::string(word))) << word;
  }
  EXPECT_FALSE(findParameter("force.radius_m")->parse("auto"));
}

}  // namespace
}  // namespace hapticd::config
