// SPDX-License-Identifier: Apache-2.0
// Changes of the configuration that a running daemon applies when it is read again.
#include "daemon/reload.h"

#include <gtest/gtest.h>

#include "config/parameter_table.h"

namespace hapticd::daemon {
namespace {

config::Settings with(const std::vector<std::string>& assignments) {
  config::Settings settings;
  for (const std::string& assignment : assignments) {
    EXPECT_TRUE(config::setFromText(settings, assignment)) << assignment;
  }
  return settings;
}

std::string valueOf(const config::Settings& settings, std::string_view name) {
  return config::toText(config::findParameter(name)->get(settings));
}

TEST(Reload, OfTheSameSettingsChangesNothing) {
  const auto reload = reloaded(with({"force.radius_m=0.03"}), with({"force.radius_m=0.03"}));
  ASSERT_TRUE(reload);
  EXPECT_TRUE(reload->changes.empty());
  EXPECT_TRUE(reload->waiting.empty());
}

TEST(Reload, TakesLiveParametersAndReportsOldAndNewValues) {
  const auto reload = reloaded(with({}), with({"force.stiffness_n_per_m=321"}));
  ASSERT_TRUE(reload);
  ASSERT_EQ(reload->changes.size(), 1U);
  EXPECT_EQ(reload->changes[0].name, "force.stiffness_n_per_m");
  EXPECT_EQ(reload->changes[0].old_value, "500");
  EXPECT_EQ(reload->changes[0].new_value, "321");
  EXPECT_EQ(valueOf(reload->settings, "force.stiffness_n_per_m"), "321");
}

TEST(Reload, TakesBackWhatAClientHasSet) {
  const auto reload = reloaded(with({"safety.max_force_n=2"}), with({}));
  ASSERT_TRUE(reload);
  EXPECT_EQ(valueOf(reload->settings, "safety.max_force_n"), "4");
}

TEST(Reload, LeavesParametersThatNeedARestartAndNamesThem) {
  const auto reload = reloaded(with({}), with({"loop.priority=70", "camera.driver=synthetic"}));
  ASSERT_TRUE(reload);
  EXPECT_EQ(reload->waiting, (std::vector<std::string_view>{"camera.driver", "loop.priority"}));
  EXPECT_EQ(valueOf(reload->settings, "loop.priority"), "80");
  EXPECT_EQ(valueOf(reload->settings, "camera.driver"), "freenect");
}

TEST(Reload, IsRefusedWhenTheNewLiveParametersContradictWhatCannotChangeNow) {
  // A radius that fits the window of the file, but not the smaller one of the running daemon.
  const config::Settings loaded = with({"force.law=nearest_springs", "force.radius_m=0.08"});
  ASSERT_TRUE(config::checkTogether(loaded).empty());
  const auto reload =
      reloaded(with({"force.law=nearest_springs", "force.radius_m=0.03", "grid.cells_per_axis=16"}), loaded);
  ASSERT_FALSE(reload);
  EXPECT_NE(reload.error().front().text().find("force.radius_m"), std::string::npos)
      << reload.error().front().text();
}

TEST(Reload, KnowsEveryParameterOfTheTable) {
  config::Settings loaded;
  std::size_t different = 0;
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (parameter.kind != config::Kind::boolean) continue;
    parameter.set(loaded, !std::get<bool>(parameter.get(loaded)));
    ++different;
  }
  const auto reload = reloaded(config::Settings{}, loaded);
  ASSERT_TRUE(reload);
  EXPECT_EQ(reload->changes.size() + reload->waiting.size(), different);
  EXPECT_GT(different, 0U);
}

}  // namespace
}  // namespace hapticd::daemon
