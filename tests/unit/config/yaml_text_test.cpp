// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_text.h"

#include <gtest/gtest.h>

#include "config/yaml_loader.h"

namespace hapticd::test {
namespace {

using config::allParameters;
using config::Parameter;
using config::Settings;

/// Returns a value in range other than the default; the numbers have no short decimal form.
config::Value unusual(const Parameter& parameter) {
  switch (parameter.kind) {
    case config::Kind::boolean:
      return !std::get<bool>(parameter.defaultValue());
    case config::Kind::integer:
      return static_cast<std::int64_t>(parameter.maximum);
    case config::Kind::number:
      return parameter.minimum + (parameter.maximum - parameter.minimum) / 3;
    case config::Kind::choice:
      return std::string(parameter.choices.back());
    case config::Kind::text:
      break;
  }
  return std::string("a \"b\" \\ # c: 'd' \t\x7f");
}

Settings readBack(const std::string& text) {
  const auto loaded = config::settingsFromText(text, "all.yaml");
  EXPECT_TRUE(loaded.has_value()) << loaded.error().front().text() << "\n" << text;
  return loaded.value_or(Settings{});
}

TEST(YamlText, EachParameterReadsBackAsItWas) {
  for (const Parameter& parameter : allParameters()) {
    Settings settings;
    if (parameter.kind == config::Kind::text && parameter.check(unusual(parameter))) {
      parameter.set(settings, unusual(parameter));
    } else if (parameter.kind != config::Kind::text) {
      parameter.set(settings, unusual(parameter));
    }
    const auto only = [&](const Parameter& other) { return other.name == parameter.name; };
    const auto loaded = config::settingsFromText(config::yamlText(settings, only), "one.yaml");
    if (!loaded) continue;  // alone it conflicts with the defaults of other parameters
    EXPECT_EQ(parameter.get(*loaded), parameter.get(settings)) << parameter.name;
  }
}

TEST(YamlText, AllDefaultsReadBack) {
  const Settings loaded = readBack(config::yamlText(Settings{}));
  for (const Parameter& parameter : allParameters()) {
    EXPECT_EQ(parameter.get(loaded), parameter.defaultValue()) << parameter.name;
  }
}

TEST(YamlText, HoldsOnlyWhatIsChosen) {
  const auto springs = [](const Parameter& parameter) { return parameter.name == "force.radius_m"; };
  EXPECT_EQ(config::yamlText(Settings{}, springs), "force:\n  radius_m: 0.04\n");
}

}  // namespace
}  // namespace hapticd::test
