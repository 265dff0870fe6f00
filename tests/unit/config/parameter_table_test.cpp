// SPDX-License-Identifier: Apache-2.0
#include "config/settings/parameter_table.h"
#include "drivers/camera/synthetic/analytic_scene.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

namespace hapticd::config {
namespace {

bool isNumeric(const Parameter& parameter) {
  return parameter.kind == Kind::number || parameter.kind == Kind::integer;
}

// Returns a value that parameter.check() accepts and that differs from the default.
Value otherValue(const Parameter& parameter) {
  const Value standard = parameter.defaultValue();
  switch (parameter.kind) {
    case Kind::boolean:
      return !std::get<bool>(standard);
    case Kind::integer:
      return standard == Value(std::int64_t{1}) ? std::int64_t{2}
                                                : static_cast<std::int64_t>(parameter.minimum);
    case Kind::number:
      return std::get<double>(standard) == parameter.maximum ? parameter.minimum : parameter.maximum;
    case Kind::choice:
      return std::string(parameter.choices.back() == std::get<std::string>(standard)
                             ? parameter.choices.front()
                             : parameter.choices.back());
    default:
      break;
  }
  return std::string("some text");
}

// The paper's parameters and those of the two groups that may change in a running loop, listed independently.
TEST(ParameterTable, HasThePapersDefaultsAndSymbols) {
  const auto expectRow = [](std::string_view name, const Value& standard, std::string_view symbol) {
    const Parameter* parameter = findParameter(name);
    ASSERT_NE(parameter, nullptr) << name;
    EXPECT_EQ(parameter->defaultValue(), standard) << name;
    EXPECT_EQ(parameter->symbol, symbol) << name;
  };
  expectRow("force.law", std::string("auto"), "");
  expectRow("force.stiffness_n_per_m", 500.0, "k_s");
  expectRow("force.radius_m", 0.04, "D_thresh");
  expectRow("force.min_points", std::int64_t{10}, "N_min");
  expectRow("force.max_points", std::int64_t{100}, "N_max");
  expectRow("camera.depth_law", std::string("paper"), "");
  expectRow("camera.depth_a_per_m", -0.003071102, "a");
  expectRow("camera.depth_b_per_m", 3.330949516, "b");
  expectRow("camera.fx_px", 594.214342, "f_x");
  expectRow("camera.fy_px", 591.040537, "f_y");
  expectRow("camera.cx_px", 339.307810, "c_x");
  expectRow("camera.cy_px", 242.739138, "c_y");
  expectRow("camera.near_m", 0.4, "");
  expectRow("camera.far_m", 4.0, "");
  for (const char* name : {"camera.position_x_m", "camera.position_y_m", "camera.position_z_m",
                           "camera.roll_rad", "camera.pitch_rad", "camera.yaw_rad"}) {
    expectRow(name, 0.0, "");
  }
}

TEST(ParameterTable, WhatShapesTheForceIsLiveAndNothingElse) {
  const std::set<std::string_view> live_groups{"force", "contact",   "surface", "filter",
                                               "blend", "proximity", "tool",    "safety"};
  for (const Parameter& parameter : allParameters()) {
    EXPECT_EQ(parameter.effect == Effect::live, live_groups.contains(parameter.group())) << parameter.name;
  }
}

TEST(ParameterTable, EveryNameIsUniqueAndFound) {
  std::set<std::string_view> names;
  for (const Parameter& parameter : allParameters()) {
    EXPECT_TRUE(names.insert(parameter.name).second) << parameter.name;
    EXPECT_EQ(findParameter(parameter.name), &parameter);
  }
  EXPECT_EQ(findParameter("force.nothing"), nullptr);
  EXPECT_EQ(findParameter(""), nullptr);
}

TEST(ParameterTable, EveryRowIsComplete) {
  for (const Parameter& parameter : allParameters()) {
    EXPECT_FALSE(parameter.help.empty()) << parameter.name;
    EXPECT_EQ(parameter.help.find('\n'), std::string_view::npos) << parameter.name;
    // the only number that may also be a word
    const bool words = parameter.kind == Kind::choice || parameter.name == "force.stiffness_n_per_m";
    EXPECT_EQ(parameter.choices.empty(), !words) << parameter.name;
    EXPECT_EQ(parameter.minimum < parameter.maximum, isNumeric(parameter)) << parameter.name;
  }
}

// A dimensional number has its unit at the end of its name.
TEST(ParameterTable, TheUnitIsAtTheEndOfTheName) {
  const std::map<std::string_view, std::string_view> endings{{"N/m", "_n_per_m"},
                                                             {"m", "_m"},
                                                             {"N", "_n"},
                                                             {"N/s", "_n_per_s"},
                                                             {"W", "_w"},
                                                             {"s", "_s"},
                                                             {"1/m", "_per_m"},
                                                             {"px", "_px"},
                                                             {"rad", "_rad"},
                                                             {"Hz", "_hz"},
                                                             {"kg", "_kg"},
                                                             {"m/s", "_m_per_s"},
                                                             {"N s/m", "_n_s_per_m"},
                                                             {"MB", "_mb"},
                                                             {"um", "_um"},
                                                             {"us", "_us"}};
  for (const Parameter& parameter : allParameters()) {
    if (parameter.unit.empty()) continue;
    const auto ending = endings.find(parameter.unit);
    ASSERT_NE(ending, endings.end()) << parameter.name << " has the unknown unit " << parameter.unit;
    EXPECT_TRUE(parameter.name.ends_with(ending->second)) << parameter.name;
  }
}

TEST(ParameterTable, EveryDefaultIsAllowed) {
  for (const Parameter& parameter : allParameters()) {
    const base::Result<Value> checked = parameter.check(parameter.defaultValue());
    ASSERT_TRUE(checked) << parameter.name << ": " << checked.error().text();
    EXPECT_EQ(*checked, parameter.defaultValue()) << parameter.name;
  }
  EXPECT_TRUE(checkTogether(Settings{}).empty());
}

TEST(ParameterTable, EveryDefaultReadsBackFromItsText) {
  for (const Parameter& parameter : allParameters()) {
    const base::Result<Value> read = parameter.parse(toText(parameter.defaultValue()));
    ASSERT_TRUE(read) << parameter.name << ": " << read.error().text();
    EXPECT_EQ(*read, parameter.defaultValue()) << parameter.name;
  }
}

TEST(ParameterTable, BothEndsOfEveryRangeAreAllowedAndWhatLiesBeyondIsNot) {
  for (const Parameter& parameter : allParameters()) {
    if (!isNumeric(parameter)) continue;
    const double step = parameter.kind == Kind::integer ? 1 : 1e-6;
    EXPECT_TRUE(parameter.check(parameter.minimum)) << parameter.name;
    EXPECT_TRUE(parameter.check(parameter.maximum)) << parameter.name;
    EXPECT_FALSE(parameter.check(parameter.minimum - step)) << parameter.name;
    EXPECT_FALSE(parameter.check(parameter.maximum + step)) << parameter.name;
  }
}

// Only the member of the row changes: the others keep their defaults.
TEST(ParameterTable, SettingOneParameterChangesThatOneAlone) {
  for (const Parameter& parameter : allParameters()) {
    if (parameter.choices.size() == 1) continue;  // there is no other value
    const Value value = otherValue(parameter);
    ASSERT_TRUE(parameter.check(value)) << parameter.name;
    Settings settings;
    parameter.set(settings, value);
    for (const Parameter& other : allParameters()) {
      const Value expected = other.name == parameter.name ? value : other.defaultValue();
      EXPECT_EQ(other.get(settings), expected) << "set " << parameter.name << ", read " << other.name;
    }
  }
}

TEST(ParameterTable, EveryChoiceReadsBack) {
  for (const Parameter& parameter : allParameters()) {
    for (const std::string_view choice : parameter.choices) {
      Settings settings;
      parameter.set(settings, Value(std::string(choice)));
      EXPECT_EQ(parameter.get(settings), Value(std::string(choice))) << parameter.name;
    }
  }
}

// The words match the enumerators; one is checked for each enumeration.
TEST(ParameterTable, WordsMeanTheirEnumerators) {
  Settings settings;
  ASSERT_TRUE(setFromText(settings, "camera.driver=recorded"));
  ASSERT_TRUE(setFromText(settings, "camera.depth_law=factory"));
  ASSERT_TRUE(setFromText(settings, "synthetic.scene=edge"));
  ASSERT_TRUE(setFromText(settings, "synthetic.noise=quantised"));
  EXPECT_EQ(settings.camera.driver, "recorded");
  EXPECT_EQ(settings.camera.depth_law, DepthLaw::factory);
  EXPECT_EQ(settings.camera.of<drivers::SyntheticSettings>().scene, drivers::SyntheticScene::edge);
  EXPECT_EQ(settings.camera.of<drivers::SyntheticSettings>().noise, drivers::SyntheticNoise::quantised);
}

TEST(UnknownParameter, NamesTheNearestOnes) {
  EXPECT_EQ(unknownParameter("force.radius").text(),
            "\"force.radius\": there is no parameter of this name (did you mean force.radius_m or "
            "contact.proxy_radius_m or filter.spatial_radius_px?)");
  EXPECT_EQ(unknownParameter("force.stifness_n_per_m").remedy, "did you mean force.stiffness_n_per_m?");
  EXPECT_EQ(unknownParameter("force.max_force_n").remedy, "did you mean safety.max_force_n?");
  EXPECT_EQ(unknownParameter("min_points").remedy.substr(0, 32), "did you mean force.min_points or");
  EXPECT_EQ(unknownParameter("colour").remedy, "hapticd.yaml lists all parameters");
  EXPECT_EQ(unknownParameter("").remedy, "hapticd.yaml lists all parameters");
}

TEST(UnknownParameter, ShowsALongOrDamagedNameSafely) {
  EXPECT_EQ(unknownParameter(std::string(100000, 'x')).where, '"' + std::string(60, 'x') + "...\"");
  EXPECT_EQ(unknownParameter("a\x1b[2J\xff").where, R"("a\x1b[2J\xff")");
}

}  // namespace
}  // namespace hapticd::config
