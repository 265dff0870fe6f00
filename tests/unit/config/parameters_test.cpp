// SPDX-License-Identifier: Apache-2.0
// The table of parameters, their values, and what is written in place of a number.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "config/settings/line_address.h"
#include "config/settings/parameter_table.h"
#include "config/settings/yaml_text.h"
#include "config/yaml_loader.h"
#include "drivers/camera/recorded/recorded_camera.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "tests/support/golden_file.h"
#include "tests/support/temporary_folder.h"

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

std::string textOfSetting(std::string_view name_and_value) {
  Settings settings;
  const base::Result<void> result = setFromText(settings, name_and_value);
  return result ? "accepted" : result.error().text();
}

std::string textOfCheck(std::string_view name, const Value& value) {
  const base::Result<Value> result = findParameter(name)->check(value);
  return result ? "accepted" : result.error().text();
}

double numberFrom(std::string_view text) {
  const base::Result<Value> value = findParameter("camera.position_x_m")->parse(text);
  return value ? std::get<double>(*value) : std::nan("");
}

TEST(ParameterValue, NumbersAreReadInTheFormsOfYaml) {
  EXPECT_EQ(numberFrom("4"), 4);
  EXPECT_EQ(numberFrom("+4"), 4);
  EXPECT_EQ(numberFrom("-4.25"), -4.25);
  EXPECT_EQ(numberFrom(".5"), 0.5);
  EXPECT_EQ(numberFrom("1."), 1);
  EXPECT_EQ(numberFrom("25e-1"), 2.5);
  EXPECT_EQ(numberFrom("2.5E0"), 2.5);
  EXPECT_EQ(numberFrom("007"), 7);
}

TEST(ParameterValue, ANegativeZeroBecomesZero) {
  EXPECT_FALSE(std::signbit(numberFrom("-0.0")));
}

/// A word of a transcript: a truth value, text in quotes, a number with a point, nan or inf, or a whole
/// number.
Value valueOf(const std::string& text) {
  if (text == "true" || text == "false") return text == "true";
  if (text.starts_with('\'')) return text.substr(1, text.size() - 2);
  if (text.find_first_of(".n") != std::string::npos) return std::stod(text);
  return static_cast<std::int64_t>(std::stoll(text));
}

TEST(ParameterValue, IsTakenOrRefusedAsWritten) {
  test::expectTranscript(
      HAPTICD_SOURCE "/tests/unit/config/refusals/values.golden", [](const std::string& command) {
        const std::string rest = command.substr(command.find(' ') + 1);
        if (command.starts_with("set ")) return textOfSetting(rest.substr(1, rest.size() - 2));
        return textOfCheck(rest.substr(0, rest.find(' ')), valueOf(rest.substr(rest.find(' ') + 1)));
      });
  EXPECT_EQ(textOfSetting("camera.serial=a\tb"),
            "camera.serial: \"a\\x09b\" contains a control or invisible character (allowed: text)");
  EXPECT_EQ(textOfSetting("camera.serial=\xc3"),
            "camera.serial: \"\\xc3\" is not valid UTF-8 (allowed: text)");
  EXPECT_EQ(textOfSetting("camera.serial=" + std::string(4096, 'a')),
            "camera.serial: \"" + std::string(60, 'a') + "...\" is longer than 4095 bytes (allowed: text)");
  EXPECT_NE(textOfSetting("camera.position_x_m=1\n"), "accepted");
}

TEST(ParameterValue, TextIsTakenAsItIsWritten) {
  Settings settings;
  ASSERT_TRUE(setFromText(settings, "camera.recording=/data/a=b, \xc3\xa4 \"c\""));
  EXPECT_EQ(settings.camera.of<drivers::RecordedSettings>().recording, "/data/a=b, \xc3\xa4 \"c\"");
  ASSERT_TRUE(setFromText(settings, "camera.recording="));
  EXPECT_EQ(settings.camera.of<drivers::RecordedSettings>().recording, "");
}

TEST(ParameterValue, ARefusedSettingChangesNothing) {
  Settings settings;
  ASSERT_FALSE(setFromText(settings, "force.radius_m=0.5"));
  EXPECT_EQ(settings.live.force.radius_m, 0.04);
}

TEST(ParameterValue, IntegersServeAsNumbersAndWholeNumbersAsIntegers) {
  EXPECT_EQ(findParameter("force.stiffness_n_per_m")->check(std::int64_t{4}).value(), Value(4.0));
  EXPECT_EQ(findParameter("force.min_points")->check(4.0).value(), Value(std::int64_t{4}));
}

TEST(ToText, IsTheShortestFormThatReadsBack) {
  EXPECT_EQ(toText(500.0), "500");
  EXPECT_EQ(toText(0.04), "0.04");
  EXPECT_EQ(toText(-0.003071102), "-0.003071102");
  EXPECT_EQ(toText(100000.0), "100000");
  EXPECT_EQ(toText(1.0 / 30), "0.03333333333333333");
  EXPECT_EQ(toText(std::int64_t{-7}), "-7");
  EXPECT_EQ(toText(true), "true");
  EXPECT_EQ(toText(std::string("paper")), "paper");
}

// Each number is the neighbour of a simple one, so that rounding of the last digit would be noticed.
TEST(ToText, EveryNumberReadsBackExactly) {
  for (double simple : {0.1, 1.0 / 3, 2.5, 9.999, 1e-7, 1e-300, 4.9e-324}) {
    for (const double number : {simple, std::nextafter(simple, 10), std::nextafter(simple, -10)}) {
      EXPECT_EQ(numberFrom(toText(number)), number) << toText(number);
    }
  }
}

TEST(Range, IsReadableForEveryKind) {
  EXPECT_EQ(findParameter("force.radius_m")->range(), "0.005..0.1 m");
  EXPECT_EQ(findParameter("force.min_points")->range(), "1..1000");
  EXPECT_EQ(findParameter("camera.depth_law")->range(), "one of: paper, factory, custom");
  EXPECT_EQ(findParameter("camera.loop")->range(), "true or false");
  EXPECT_EQ(findParameter("camera.serial")->range(), "text");
}

// force.stiffness_n_per_m is a number or `auto`.

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

// How the line of an LED is written, and what is refused.

TEST(LineAddress, IsReadAndRefusedAsWritten) {
  test::expectTranscript(HAPTICD_SOURCE "/tests/unit/config/refusals/line_addresses.golden",
                         [](const std::string& quoted) {
                           const base::Result<LineAddress> line =
                               lineAddressFrom(std::string_view(quoted).substr(1, quoted.size() - 2));
                           if (!line) return line.error().text();
                           return fmt::format("{}{}", textOf(*line), line->active_low ? ", active low" : "");
                         });
}

TEST(LineAddress, IsWrittenInAFileWithoutQuotes) {
  const test::TemporaryFolder folder;
  const auto loaded = loadSettings(folder.write("leds.yaml",
                                                "leds:\n"
                                                "  driver: gpiod\n"
                                                "  chip: gpiochip0\n"
                                                "  power_line: 17\n"
                                                "  fault_line: STATUS active-low\n"));
  ASSERT_TRUE(loaded) << loaded.error().front().text();
  EXPECT_EQ(loaded->leds.driver, LedDriver::gpiod);
  EXPECT_EQ(loaded->leds.chip, "gpiochip0");
  EXPECT_EQ(loaded->leds.power_line, "17");
  EXPECT_EQ(loaded->leds.fault_line, "STATUS active-low");
  EXPECT_EQ(loaded->leds.camera_line, "");
}

}  // namespace
}  // namespace hapticd::config
