// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "config/settings/parameter_table.h"
#include "drivers/camera/recorded/recorded_camera.h"

namespace hapticd::config {
namespace {

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

TEST(ParameterValue, AnythingButADecimalNumberIsRefused) {
  for (const char* text : {"",   " 1", "1 ", "+-1", "-+1", "--1", "0x10", "1_000", "1,5",      "0.04 m",
                           "e5", "1e", ".",  "-",   "+",   "one", "nan",  "inf",   "infinity", "1\n"}) {
    const base::Result<Value> value = findParameter("camera.position_x_m")->parse(text);
    ASSERT_FALSE(value) << '"' << text << '"';
    EXPECT_TRUE(value.error().text().ends_with("(allowed: -10..10 m)")) << value.error().text();
  }
}

TEST(ParameterValue, ErrorsNameTheParameterTheValueAndTheRange) {
  EXPECT_EQ(textOfSetting("force.radius_m=0.5"),
            "force.radius_m: 0.5 m is out of range (allowed: 0.005..0.1 m)");
  EXPECT_EQ(textOfSetting("force.radius_m=-1e999"),
            "force.radius_m: -1e999 m is out of range (allowed: 0.005..0.1 m)");
  EXPECT_EQ(textOfSetting("force.radius_m=.nan"),
            "force.radius_m: .nan is not a finite number (allowed: 0.005..0.1 m)");
  EXPECT_EQ(textOfSetting("force.radius_m=-.inf"),
            "force.radius_m: -.inf is not a finite number (allowed: 0.005..0.1 m)");
  EXPECT_EQ(textOfSetting("force.radius_m=wide"),
            "force.radius_m: \"wide\" is not a number (allowed: 0.005..0.1 m)");
  EXPECT_EQ(textOfSetting("force.min_points=3.5"),
            "force.min_points: 3.5 is not a whole number (allowed: 1..1000)");
  EXPECT_EQ(textOfSetting("force.min_points=99999999999999999999"),
            "force.min_points: 99999999999999999999 is out of range (allowed: 1..1000)");
  EXPECT_EQ(
      textOfSetting("camera.depth_law=kinect"),
      "camera.depth_law: \"kinect\" is not an allowed choice (allowed: one of: paper, factory, custom)");
  EXPECT_EQ(textOfSetting("trace.depth=yes"),
            "trace.depth: \"yes\" is not a truth value (allowed: true or false)");
  EXPECT_EQ(textOfSetting("camera.serial=a\tb"),
            "camera.serial: \"a\\x09b\" contains a control or invisible character (allowed: text)");
  EXPECT_EQ(textOfSetting("camera.serial=\xc3"),
            "camera.serial: \"\\xc3\" is not valid UTF-8 (allowed: text)");
  EXPECT_EQ(textOfSetting("camera.serial=" + std::string(4096, 'a')),
            "camera.serial: \"" + std::string(60, 'a') + "...\" is longer than 4095 bytes (allowed: text)");
}

TEST(ParameterValue, TruthValuesAreTrueAndFalseOnly) {
  EXPECT_EQ(textOfSetting("trace.depth=false"), "accepted");
  for (const char* text : {"True", "TRUE", "no", "on", "1", "", "true "}) {
    EXPECT_NE(textOfSetting(std::string("trace.depth=") + text), "accepted") << text;
  }
}

TEST(ParameterValue, TextIsTakenAsItIsWritten) {
  Settings settings;
  ASSERT_TRUE(setFromText(settings, "camera.recording=/data/a=b, \xc3\xa4 \"c\""));
  EXPECT_EQ(settings.camera.of<drivers::RecordedSettings>().recording, "/data/a=b, \xc3\xa4 \"c\"");
  ASSERT_TRUE(setFromText(settings, "camera.recording="));
  EXPECT_EQ(settings.camera.of<drivers::RecordedSettings>().recording, "");
}

TEST(ParameterValue, ASettingWithoutValueOrNameIsRefused) {
  EXPECT_EQ(textOfSetting("force.radius_m"),
            "\"force.radius_m\": has no value (write it as group.name=value)");
  EXPECT_EQ(textOfSetting(""), "\"\": has no value (write it as group.name=value)");
  EXPECT_EQ(textOfSetting("=3"),
            "\"\": there is no parameter of this name (hapticd.yaml lists all parameters)");
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

TEST(ParameterValue, OtherTypesAreRefusedByName) {
  EXPECT_EQ(textOfCheck("force.radius_m", std::string("0.04")),
            "force.radius_m: \"0.04\" is text, not a number (allowed: 0.005..0.1 m)");
  EXPECT_EQ(textOfCheck("force.min_points", true),
            "force.min_points: true is a truth value, not a number (allowed: 1..1000)");
  EXPECT_EQ(textOfCheck("trace.depth", std::int64_t{1}),
            "trace.depth: 1 is a number (allowed: true or false)");
  EXPECT_EQ(textOfCheck("camera.depth_law", 2.0),
            "camera.depth_law: 2 is a number (allowed: one of: paper, factory, custom)");
  EXPECT_EQ(textOfCheck("camera.serial", false), "camera.serial: false is a truth value (allowed: text)");
}

TEST(ParameterValue, NumbersThatAreNotFiniteAreRefused) {
  for (const double number : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    EXPECT_NE(textOfCheck("force.radius_m", number), "accepted") << number;
    EXPECT_NE(textOfCheck("force.min_points", number), "accepted") << number;
  }
  EXPECT_NE(textOfCheck("force.min_points", std::numeric_limits<std::int64_t>::max()), "accepted");
  EXPECT_NE(textOfCheck("force.min_points", std::numeric_limits<std::int64_t>::min()), "accepted");
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

}  // namespace
}  // namespace hapticd::config
