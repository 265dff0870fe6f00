// SPDX-License-Identifier: Apache-2.0
// What counts as less protection, and that none of it is left after it was taken back.
#include "config/conflicts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "config/additions/addition_json.h"
#include "config/additions/addition_reader.h"
#include "config/settings/fixture_settings.h"
#include "tests/support/golden_file.h"

namespace hapticd::config {
namespace {

Settings with(const std::vector<std::string>& assignments) {
  Settings settings;
  for (const std::string& assignment : assignments)
    EXPECT_TRUE(setFromText(settings, assignment)) << assignment;
  return settings;
}

std::vector<std::string> textsOf(const std::vector<Loosening>& loosenings) {
  std::vector<std::string> texts;
  for (const Loosening& loosening : loosenings) texts.push_back(loosening.text);
  return texts;
}

std::vector<std::string> loosened(const Settings& before, const Settings& after) {
  return textsOf(looseningsOf(before, after));
}

using Texts = std::vector<std::string>;

/// For each limit a value and a looser one.
struct Limit {
  const char* name;
  const char* tight;
  const char* loose;
};
constexpr Limit kLimits[] = {
    {"force.stiffness_ceiling_n_per_m", "500", "600"},
    {"proximity.warning_m", "0.02", "0.01"},
    {"tool.radius_m", "0.003", "0.002"},
    {"safety.max_force_n", "1", "4"},
    {"safety.max_slew_n_per_s", "100", "200"},
    {"safety.engage_ramp_s", "1", "0.5"},
    {"safety.engage_inside", "false", "true"},
    {"safety.depth_timeout_s", "0.2", "0.3"},
    {"safety.depth_ramp_s", "0.1", "0.2"},
    {"safety.handle_timeout_s", "0.01", "0.02"},
    {"safety.continuous_force_n", "1", "2"},
    {"safety.thermal_time_s", "5", "10"},
    {"safety.force_filter_hz", "50", "80"},
    {"safety.force_filter_hz", "50", "0"},
    {"safety.passivity_control", "true", "false"},
    {"safety.stiffness_limit", "reduce", "warn"},
    {"safety.stiffness_limit", "warn", "off"},
    {"safety.contact_damping", "automatic", "off"},
    {"safety.overrun_burst", "5", "65"},
    {"safety.workspace_radius_m", "1", "2"},
    {"safety.max_handle_speed_m_per_s", "1", "2"},
    {"safety.max_handle_speed_m_per_s", "1", "0"},
    {"safety.max_external_force_n", "0", "1"},
    {"safety.max_external_power_w", "0.2", "0.5"},
};

TEST(Loosening, OfALimitIsTheLooserValueAndNotTheTighterOne) {
  std::set<std::string_view> seen;
  for (const auto& [name, tight, loose] : kLimits) {
    const Parameter* const parameter = findParameter(name);
    ASSERT_NE(parameter, nullptr) << name;
    const Value from = parameter->parse(tight).value();
    const Value to = parameter->parse(loose).value();
    EXPECT_TRUE(isLooser(*parameter, from, to)) << name;
    EXPECT_FALSE(isLooser(*parameter, to, from)) << name;
    EXPECT_FALSE(isLooser(*parameter, from, from)) << name;
    seen.insert(name);
  }
  // Every limit of the table is above, and every live parameter of the group safety is a limit.
  for (const Parameter& parameter : parameterTable()) {
    EXPECT_EQ(parameter.looser != Looser::never, seen.contains(parameter.name)) << parameter.name;
    const bool safety = parameter.name.starts_with("safety.");
    EXPECT_TRUE(!safety || parameter.looser != Looser::never) << parameter.name;
  }
}

TEST(Loosening, NamesTheParameterItsValuesAndTheUnit) {
  EXPECT_EQ(loosened(with({"safety.max_force_n=1"}), with({"force.radius_m=0.03"})),
            Texts{"safety.max_force_n from 1 to 4 N"});
  EXPECT_EQ(loosened(with({}), with({"safety.max_force_n=1", "force.stiffness_n_per_m=900"})), Texts{});
  EXPECT_EQ(loosened(with({}), with({"safety.stiffness_limit=off"})),
            Texts{"safety.stiffness_limit from reduce to off"});
}

FixtureSettings sphere() {
  FixtureSettings fixture{.name = "nerve"};
  fixture.radius_m = 0.01;
  fixture.clearance_m = 0.005;
  return fixture;
}

Settings with(const FixtureSettings& fixture) {
  Settings settings;
  settings.additions.fixtures = {fixture};
  return settings;
}

/// Changes of a forbidden region, or of the guidance to a point, and what they loosen.
TEST(Loosening, OfAFixtureIsEverythingThatMayProtectLess) {
  EXPECT_EQ(loosened(with(sphere()), Settings{}), Texts{"fixture nerve is removed"});
  EXPECT_EQ(loosened(Settings{}, with(sphere())), Texts{});
  const FixtureSettings target{.name = "target", .kind = rt::FixtureKind::point};
  test::expectTranscript(
      HAPTICD_SOURCE "/tests/unit/config/refusals/loosenings.golden", [&](const std::string& line) {
        const std::size_t space = line.find(' ');
        FixtureSettings before = line.starts_with("point") ? target : sphere();
        before.enabled = !line.starts_with("disabled");
        const auto after = changed(before, nodeOf(nlohmann::json::parse(line.substr(space))));
        EXPECT_TRUE(after) << line;
        std::string answer;
        for (const std::string& text : loosened(with(before), with(after.value_or(before))))
          answer += text + "\n";
        return answer;
      });
}

TEST(Loosening, OfARegionIsOnlyThatItGoes) {
  Settings before;
  before.additions.regions = {{.name = "liver"}};
  Settings softer = before;
  softer.additions.regions[0].stiffness_n_per_m = 100;
  EXPECT_EQ(loosened(before, softer), Texts{});
  EXPECT_EQ(loosened(before, Settings{}), Texts{"region liver is removed"});
}

/// Random live settings, fixtures and regions, of few names, so that the same are in several.
class RandomSettings {
 public:
  Settings next() {
    Settings settings;
    for (const Limit& limit : kLimits) {
      if (below(2) == 0) continue;
      const Parameter* const parameter = findParameter(limit.name);
      parameter->set(settings, parameter->parse(below(2) == 0 ? limit.tight : limit.loose).value());
    }
    for (const std::string name : {"a", "b", "c", "d"}) {
      if (below(2) == 0) settings.additions.fixtures.push_back(fixture(name));
      if (below(2) == 0)
        settings.additions.regions.push_back(
            {.name = name, .stiffness_n_per_m = 100 + static_cast<double>(below(3))});
    }
    std::ranges::shuffle(settings.additions.fixtures, random_);
    std::ranges::shuffle(settings.additions.regions, random_);
    return settings;
  }

 private:
  std::size_t below(std::size_t bound) { return random_() % bound; }
  FixtureSettings fixture(const std::string& name) {
    FixtureSettings fixture{.name = name};
    if (below(4) == 0) fixture.kind = rt::FixtureKind::point;
    fixture.enabled = below(3) != 0;
    fixture.stiffness_n_per_m = 100.0 * static_cast<double>(1 + below(3));
    fixture.clearance_m = 0.001 * static_cast<double>(below(3));
    fixture.radius_m = 0.01 * static_cast<double>(1 + below(2));
    return fixture;
  }

  std::mt19937 random_{20110901};  // NOLINT(cert-msc51-cpp): the same settings in every run
};

Texts sorted(Texts texts) {
  std::ranges::sort(texts);
  return texts;
}

template <typename Owner>
std::vector<std::string> namesOf(const std::vector<Owner>& owners) {
  std::vector<std::string> names;
  for (const Owner& owner : owners) names.push_back(owner.name);
  std::ranges::sort(names);
  return names;
}

template <typename Owner>
std::vector<std::string> unionOf(const std::vector<Owner>& a, const std::vector<Owner>& b) {
  std::vector<Owner> both = a;
  both.insert(both.end(), b.begin(), b.end());
  auto names = namesOf(both);
  names.erase(std::ranges::unique(names).begin(), names.end());
  return names;
}

TEST(WithoutLoosening, LoosensNothingAndKeepsEverythingElseOnRandomSettings) {
  RandomSettings random;
  int loosening = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Settings before = random.next();
    const Settings after = random.next();
    const Settings kept = withoutLoosening(before, after);
    EXPECT_EQ(loosened(before, kept), Texts{});
    // What remains to be done is exactly what was taken back.
    EXPECT_EQ(sorted(loosened(kept, after)), sorted(loosened(before, after)));
    EXPECT_EQ(namesOf(kept.additions.fixtures), unionOf(before.additions.fixtures, after.additions.fixtures));
    EXPECT_EQ(namesOf(kept.additions.regions), unionOf(before.additions.regions, after.additions.regions));
    const auto found = looseningsOf(before, after);
    for (const Parameter& parameter : parameterTable()) {
      const bool held = std::ranges::find(found, parameter.name, &Loosening::name) != found.end();
      EXPECT_EQ(parameter.get(kept), parameter.get(held ? before : after)) << parameter.name;
    }
    if (!found.empty()) ++loosening;
    if (HasFailure()) return;
  }
  EXPECT_GT(loosening, 1000);
}

}  // namespace
}  // namespace hapticd::config
