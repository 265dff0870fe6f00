// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/base/counted.h"
#include "config/base/value_text.h"
#include "config/settings/yaml_text.h"
#include "config/yaml_loader.h"

namespace hapticd::config {
namespace {

TEST(Printable, LeavesTextInAllLanguagesAsItIs) {
  for (const char* text : {"", "plain", "H\xc3\xb6he \xe2\x89\xa4 4 N", "\xe6\x89\x8b", "\xf0\x9f\x96\x90"}) {
    EXPECT_EQ(base::printable(text), text);
  }
}

TEST(Printable, EscapesTerminalControlsAndLineBreaks) {
  EXPECT_EQ(base::printable("a\x1b[2Jb\r\n\t\x7f"), "a\\x1b[2Jb\\x0d\\x0a\\x09\\x7f");
  EXPECT_EQ(base::printable("\xc2\x9b"
                            "31m"),
            "\\xc2\\x9b31m");                                           // CSI as one character of C1
  EXPECT_EQ(base::printable("\xe2\x80\xa8|\xe2\x80\xae|\xef\xbb\xbf"),  // U+2028, U+202E, U+FEFF
            "\\xe2\\x80\\xa8|\\xe2\\x80\\xae|\\xef\\xbb\\xbf");
  EXPECT_EQ(base::printable("\x9b|\xc3|\xed\xa0\x80"), "\\x9b|\\xc3|\\xed\\xa0\\x80");  // not UTF-8
}

TEST(InQuotes, CutsLongTextBetweenCharacters) {
  EXPECT_EQ(base::inQuotes(std::string(3000, 'x')), "\"" + std::string(60, 'x') + "...\"");
  EXPECT_EQ(base::inQuotes(std::string(59, 'x') + "\xc3\xb6"), "\"" + std::string(59, 'x') + "...\"");
  EXPECT_EQ(base::inQuotes(std::string(58, 'x') + "\xc3\xb6"), "\"" + std::string(58, 'x') + "\xc3\xb6\"");
  EXPECT_EQ(base::inQuotes("\xc2\x9b"), "\"\\xc2\\x9b\"");
}

TEST(FirstUnprintable, NamesPlaceAndCharacter) {
  EXPECT_FALSE(base::firstUnprintable("a\xc3\xb6"));
  const auto found = base::firstUnprintable("\xc3\xb6\xc2\x85");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->at, 2U);
  EXPECT_EQ(found->code_point, U'\u0085');
}

}  // namespace
}  // namespace hapticd::config

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
    default:
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

TEST(Counted, HasThePluralForEveryCountButOne) {
  EXPECT_EQ(base::counted(0, "tick(s) in contact"), "0 ticks in contact");
  EXPECT_EQ(base::counted(1, "tick(s) in contact"), "1 tick in contact");
  EXPECT_EQ(base::counted(2U, "pair(s) of hand(s)"), "2 pairs of hands");
  EXPECT_EQ(base::counted("1", "pair(s) of hand(s)"), "1 pair of hand");
  EXPECT_EQ(base::counted("-", "frame(s)"), "- frames") << "a count that is not known";
  EXPECT_EQ(base::counted(1, "damaged"), "1 damaged");
}

}  // namespace
}  // namespace hapticd::test
