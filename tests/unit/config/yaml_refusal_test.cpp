// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "config/yaml_loader.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

struct Refusal {
  std::string name;  ///< of the test
  std::string yaml;
  std::vector<std::string> texts;  ///< all errors, without the folder of the file
  std::vector<std::string> overrides = {};
};

void PrintTo(const Refusal& refusal, std::ostream* stream) {
  *stream << refusal.yaml;
}

std::vector<std::string> textsOf(const Refusal& refusal) {
  const test::TemporaryFolder folder;
  const auto settings = loadSettings(folder.write("bad.yaml", refusal.yaml), refusal.overrides);
  if (settings) return {};
  std::vector<std::string> texts;
  const std::string prefix = folder.path().string() + "/";
  for (const base::Error& error : settings.error()) {
    const std::string text = error.text();
    texts.push_back(text.starts_with(prefix) ? text.substr(prefix.size()) : text);
  }
  return texts;
}

std::string nameOf(const testing::TestParamInfo<Refusal>& test) {
  return test.param.name;
}

class YamlRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(YamlRefusal, ListsExactlyTheseErrors) {
  EXPECT_EQ(textsOf(GetParam()), GetParam().texts);
}

const std::string kForm = "(write it as `group: {name: value}`, or the same on indented lines)";
const std::string kNoGroup =
    "has no group of parameters: is it empty, or was its end cut off? (restore it; for a box with all "
    "defaults "
    "write `force:`)";
const std::string kCut =
    "begins with a line `---`, and the line `...` at its end is missing: was its end cut off? (restore it; "
    "if "
    "it is complete, write `...` below its last line)";
const std::string kSyntax = "(check the quotes, brackets and indentation of this line and the one above)";

const std::vector<Refusal> kValues{
    {"OutOfRange",
     "\nforce:\n  radius_m: 0.5\n",
     {"bad.yaml:3: force.radius_m: 0.5 m is out of range (allowed: 0.005..0.1 m)"}},
    {"OutOfRangeInFlowForm",
     "force: {min_points: 4,\n  radius_m: 0.5}",
     {"bad.yaml:2: force.radius_m: 0.5 m is out of range (allowed: 0.005..0.1 m)"}},
    {"NotANumber",
     "force: {radius_m: .nan, stiffness_n_per_m: .inf}",
     {"bad.yaml:1: force.radius_m: .nan is not a finite number (allowed: 0.005..0.1 m)",
      "bad.yaml:1: force.stiffness_n_per_m: .inf is not a finite number (allowed: 0..5000 N/m or auto)"}},
    {"WrongType",
     "force: {radius_m: true}\ntrace: {depth: 1}",
     {"bad.yaml:1: force.radius_m: \"true\" is not a number (allowed: 0.005..0.1 m)",
      "bad.yaml:2: trace.depth: \"1\" is not a truth value (allowed: true or false)"}},
    {"FractionForAnInteger",
     "force:\n  min_points: 3.5",
     {"bad.yaml:2: force.min_points: 3.5 is not a whole number (allowed: 1..1000)"}},
    {"DecimalComma",
     "force:\n  radius_m: 0,04",
     {"bad.yaml:2: force.radius_m: \"0,04\" is not a number (allowed: 0.005..0.1 m)"}},
    {"QuotedNumber",
     "force:\n  radius_m: \"0.04\"",
     {"bad.yaml:2: force.radius_m: \"0.04\" is text because of its quotes; write 0.04 without them (allowed: "
      "0.005..0.1 m)"}},
    {"QuotedTruthValue",
     "trace: {depth: 'true'}",
     {"bad.yaml:1: trace.depth: \"true\" is text because of its quotes; write true without them "
      "(allowed: "
      "true "
      "or false)"}},
    {"TruthValueOfOldYaml",
     "camera:\n  loop: yes",
     {"bad.yaml:2: camera.loop: \"yes\" is not a truth value (allowed: true or false)"}},
    {"NoSuchChoice",
     "trace:\n  compression: gzip",
     {"bad.yaml:2: trace.compression: \"gzip\" is not an allowed choice (allowed: one of: none, zstd)"}},
    {"NoValue",
     "camera:\n  serial:\n  fx_px: ~\n",
     {"bad.yaml:2: camera.serial: has no value (give a value, \"\" for an empty text, or delete the line)",
      "bad.yaml:3: camera.fx_px: has no value (give a value, \"\" for an empty text, or delete the line)"}},
    {"ListAsValue",
     "camera:\n  serial: [a, b]\n  loop: {a: [1, {b: c}]}\n  far_m: 11",
     {"bad.yaml:2: camera.serial: is a list, but a parameter has a single value (write `name: value`)",
      "bad.yaml:3: camera.loop: is a map, but a parameter has a single value (write `name: value`)",
      "bad.yaml:4: camera.far_m: 11 m is out of range (allowed: 0.1..10 m)"}},
    {"EscapedControlCharacter",
     "camera: {serial: \"a\\0b\"}",
     {"bad.yaml:1: camera.serial: \"a\\x00b\" contains a control or invisible character (allowed: text)"}},
};
INSTANTIATE_TEST_SUITE_P(Values, YamlRefusal, testing::ValuesIn(kValues), nameOf);

const std::vector<Refusal> kNames{
    {"UnknownName",
     "force:\n  radius: 0.04",
     {"bad.yaml:2: \"force.radius\": there is no parameter of this name (did you mean force.radius_m or "
      "contact.proxy_radius_m or filter.spatial_radius_px?)"}},
    {"UnknownGroupOnce",
     "\nforces:\n  a: 1\n  b: 2\n",
     {"bad.yaml:2: \"forces\": there is no group of this name (did you mean force?)"}},
    {"UnknownGroupFarFromAll",
     "zzz: {}",
     {"bad.yaml:1: \"zzz\": there is no group of this name (groups: force, contact, surface, filter, blend, "
      "proximity, tool, safety, camera, grid, loop, handle, udp_handle, hid_handle, falcon_handle, leds, "
      "control, "
      "state, trace, synthetic, simulated_handle, fixtures, regions, label_image)"}},
    {"DottedName",
     "force.radius_m: 0.05",
     {"bad.yaml:1: force.radius_m: is outside its group (write it as `force: {radius_m: 0.05}`)"}},
    {"NameTwice",
     "force:\n  radius_m: 0.04\n  min_points: 5\n  radius_m: 0.05",
     {"bad.yaml:4: force.radius_m: is given twice, first in line 2 (delete one of the two)"}},
    {"GroupTwice",
     "force: {radius_m: 0.04}\nloop: {}\nforce: {min_points: 5}",
     {"bad.yaml:3: force: is given twice, first in line 1 (merge the two)"}},
    {"EscapeSequenceInAName",
     "force:\n  \"\\e[2J\": ~\n",
     {"bad.yaml:2: force.\\x1b[2J: has no value (give a value, \"\" for an empty text, or delete the line)"}},
    {"EscapeSequenceBehindADottedName",
     "force.radius_m: \"\\e[2J\"",
     {"bad.yaml:1: force.radius_m: is outside its group (write it as `force: {radius_m: \\x1b[2J}`)"}},
    {"ScalarAsGroup",
     "grid: 7",
     {"bad.yaml:1: grid: found \"7\" where `name: value` is expected (write it as `grid: "
      "{name: value}`)"}},
    {"ListAsGroup",
     "loop:\n  - cpu: 1",
     {"bad.yaml:2: loop: found a list where `name: value` is expected " + kForm}},
    {"ListAsName",
     "? [force]\n: {radius_m: 7}",
     {"bad.yaml:1: found a list where a name is expected " + kForm}},
    {"MissingName", "force:\n  ~: 3", {"bad.yaml:2: force: a name is missing " + kForm}},
};
INSTANTIATE_TEST_SUITE_P(Names, YamlRefusal, testing::ValuesIn(kNames), nameOf);

const std::vector<Refusal> kForms{
    {"ScalarAsRoot",
     "hello",
     {"bad.yaml:1: found \"hello\" where groups of parameters are expected " + kForm}},
    {"ListAsRoot",
     "\n- force",
     {"bad.yaml:2: found a list where groups of parameters are expected " + kForm}},
    {"OpenBracket",
     "force: {radius_m: 0.05",
     {"bad.yaml:1: is not YAML: end of map flow not found " + kSyntax}},
    {"OpenQuote", "camera:\n  serial: \"abc", {"bad.yaml:2: is not YAML: illegal EOF in scalar " + kSyntax}},
    {"TwoColons",
     "\nforce: radius_m: 3",
     {"bad.yaml:2: is not YAML: illegal map value " + kSyntax,
      "bad.yaml:2: force: found \"radius_m\" where `name: value` is expected (write it as `force: {name: "
      "value}`)"}},
    {"SyntaxAfterOtherErrors",
     "force: {radius_m: 7}\ncamera: {near_m: 5}\ngrid: [",
     {"bad.yaml:1: force.radius_m: 7 m is out of range (allowed: 0.005..0.1 m)",
      "bad.yaml:3: grid: found a list where `name: value` is expected " + kForm,
      "bad.yaml:3: is not YAML: end of sequence flow not found " + kSyntax}},
    {"QuoteThatNothingCloses",
     "camera:\n  serial: \"A00362\nsafety:\n  max_force_n: 1\n",
     {"bad.yaml:2: the quote before \"A00362\" is not closed on its line (close it with \" at the end of the "
      "value)"}},
    {"QuoteThatALaterOneCloses",
     "camera:\n  serial: \"A00362\nsafety:\n  max_force_n: 1\nleds:\n  chip: \"gpiochip0\"\n",
     {"bad.yaml:2: the quote before \"A00362\" is not closed on its line (close it with \" at the end of the "
      "value)"}},
    {"QuoteThatALaterCommentCloses",
     "camera:\n  serial: \"A00362\nsafety:\n  max_force_n: 1  # a \"light touch\"\"\n",
     {"bad.yaml:2: the quote before \"A00362\" is not closed on its line (close it with \" at the end of the "
      "value)"}},
    {"QuoteThatTheEndOfACommentCloses",
     "camera:\n  serial: 'A00362\nsafety:\n  max_force_n: 1  # of the boxes'\n",
     {"bad.yaml:2: the quote before \"A00362\" is not closed on its line (close it with ' at the end of the "
      "value)"}},
    {"QuotedTextOverTwoLines",
     "camera:\n  recording: \"a\n    b\"\n",
     {"bad.yaml:2: the quote before \"a\" is not closed on its line (close it with \" at the end of the "
      "value)"}},
    {"PlainTextOverTwoLines",
     "camera:\n  recording: a\n    near_m 0.5\n",
     {"bad.yaml:2: the value that begins with \"a\" continues on the next line (write it on one line; check "
      "the "
      "colon and the indentation of the line below)"}},
    {"BlockText",
     "camera:\n  recording: >-\n    a\n    near_m: 0.5\n",
     {"bad.yaml:2: text over several lines is not supported (write the value on one line)"}},
    {"ValueInTheNextLine",
     "camera:\n  yaw_rad:\n    0\n",
     {"bad.yaml:3: the value is not on the line of its name (write it as `name: value`)"}},
    {"FlowMapInTheNextLine",
     "camera:\n{yaw_rad: 0}\n",
     {"bad.yaml:2: the value is not on the line of its name (write it as `name: value`)"}},
    {"CarriageReturnAlone",
     "force:\r  radius_m: 0.05\rsafety:\r  max_force_n: 1\r",
     {"bad.yaml:1: a carriage return is inside the line (end lines with LF, or with CR LF)"}},
    {"CarriageReturnInAComment",
     "# comment\rsafety: {max_force_n: 1}\n",
     {"bad.yaml:1: a carriage return is inside the line (end lines with LF, or with CR LF)"}},
    {"LineSeparatorsOfOtherReaders",
     "# a\xc2\x85safety: {}\n# b\xe2\x80\xa8grid: {}\n",
     {"bad.yaml:1: the invisible character U+0085 is not allowed (delete it)",
      "bad.yaml:2: the invisible character U+2028 is not allowed (delete it)"}},
    {"VersionOfAnotherYaml",
     "%YAML 1.3\n---\nforce:\n...\n",
     {"bad.yaml:1: \"%YAML 1.3\" is not understood here " + kSyntax}},
    {"VersionWithoutTheBeginOfADocument",
     "%YAML 1.2\nforce: {}\n",
     {"bad.yaml:3: a line `---` is missing after the version (write it below %YAML, or remove the version)"}},
    {"NameWithoutColon",
     "grid: {}\nsafety",
     {"bad.yaml:2: a colon is missing after the name (write `name: value`)"}},
    {"SecondDocument",
     "force: {}\n---\n{}\n...\n",
     {"bad.yaml:2: a second YAML document begins (keep one, without a line `---` after it and with nothing "
      "below a line `...`)"}},
    {"LinesBelowTheEnd",
     "---\nforce: {}\n...\ngrid: {}\n",
     {"bad.yaml:4: a second YAML document begins (keep one, without a line `---` after it and with nothing "
      "below a line `...`)"}},
    {"NothingAtAll", "", {"bad.yaml: " + kNoGroup}},
    {"NothingButAComment", "# the box in room 3\n", {"bad.yaml: " + kNoGroup}},
    {"NothingBetweenTheMarks", "---\n...\n", {"bad.yaml: " + kNoGroup}},
    {"NoGroups", "{}\n", {"bad.yaml: " + kNoGroup}},
    {"NoEndAfterABeginning", "---\nsafety: {max_force_n: 1}\n", {"bad.yaml: " + kCut}},
    {"Anchor",
     "loop:\n  cpu: &one 1\n  priority: *one",
     {"bad.yaml:2: loop.cpu: anchor \"&one\" is not supported (write the value where it is needed)",
      "bad.yaml:3: loop.priority: aliases (*name) are not supported (write the value where it is needed)"}},
    {"Tag",
     "loop:\n  rate_hz: !!float 1000\ngrid: !x {}",
     {"bad.yaml:2: loop.rate_hz: tag \"tag:yaml.org,2002:float\" is not supported (remove the tag)",
      "bad.yaml:3: grid: tag \"!x\" is not supported (remove the tag)"}},
    {"TabIndentation",
     "force:\n\tradius_m: 0.05\n\t# a comment\n \tmin_points: 3\n",
     {"bad.yaml:2: a tab is used for indentation (indent with spaces)",
      "bad.yaml:3: a tab is used for indentation (indent with spaces)",
      "bad.yaml:4: a tab is used for indentation (indent with spaces)"}},
    {"NulByte",
     std::string("force:\n  radius_m: 0.0\0005", 24),
     {"bad.yaml:2: control character 0x00 is not allowed (delete it)"}},
    {"NotUtf8",
     "# gr\xfc\xdf\nforce: {}\n# \xc0\x80\n",
     {"bad.yaml:1: byte 0xfc is not UTF-8 (save the file as UTF-8 text)",
      "bad.yaml:3: byte 0xc0 is not UTF-8 (save the file as UTF-8 text)"}},
    {"Utf16",
     std::string("\xff\xfe{\0}\0", 6),
     {"bad.yaml:1: byte 0xff is not UTF-8 (save the file as UTF-8 text)"}},
};
INSTANTIATE_TEST_SUITE_P(Forms, YamlRefusal, testing::ValuesIn(kForms), nameOf);

TEST(YamlRefusalOfAnUnknownAlias, NamesTheLine) {
  const std::vector<std::string> texts = textsOf({.name = "", .yaml = "loop: *one", .texts = {}});
  ASSERT_EQ(1U, texts.size());
  const std::string reason = "bad.yaml:1: is not YAML: the referenced anchor is not defined";
  // yaml-cpp names the alias since version 0.8
  EXPECT_TRUE(texts[0] == reason + ": one " + kSyntax || texts[0] == reason + " " + kSyntax) << texts[0];
}

const std::string kNearAboveFar =
    "camera.near_m: 5 m is not below camera.far_m, 4 m (set camera.near_m below "
    "camera.far_m)";
const std::vector<Refusal> kTogether{
    {"RuleAtTheLineOfItsParameter", "camera:\n  loop: true\n  near_m: 5", {"bad.yaml:3: " + kNearAboveFar}},
    {"RuleAtTheOverride", "force:", {"--set camera.near_m=5: " + kNearAboveFar}, {"camera.near_m=5"}},
    {"NoRuleAboutARefusedValue",
     "camera:\n  near_m: 5\n  far_m: 60",
     {"bad.yaml:3: camera.far_m: 60 m is out of range (allowed: 0.1..10 m)"}},
    {"NoRuleAboutAValueThatIsMissing",
     "camera:\n  near_m: 5\n  far_m:\n",
     {"bad.yaml:3: camera.far_m: has no value (give a value, \"\" for an empty text, or delete the line)"}},
    {"OverridesAfterTheFile",
     "force: {radius_m: 7}",
     {"bad.yaml:1: force.radius_m: 7 m is out of range (allowed: 0.005..0.1 m)",
      "--set trace.compression=x: \"x\" is not an allowed choice (allowed: one of: none, zstd)",
      "--set cpu: has no value (write it as group.name=value)",
      "--set loop.cpus=1: there is no parameter of this name (did you mean loop.cpu?)"},
     {"trace.compression=x", "cpu", "loop.cpus=1"}},
    {"ErrorsInTheOrderOfLines",
     "safety: {max_force_n: 41}\nforce:\n  min_points: 0\nsafety: {}\nloop: {cpu: -2}",
     {"bad.yaml:1: safety.max_force_n: 41 N is out of range (allowed: 0..40 N)",
      "bad.yaml:3: force.min_points: 0 is out of range (allowed: 1..1000)",
      "bad.yaml:4: safety: is given twice, first in line 1 (merge the two)",
      "bad.yaml:5: loop.cpu: -2 is out of range (allowed: -1..1023)"}},
};
INSTANTIATE_TEST_SUITE_P(Together, YamlRefusal, testing::ValuesIn(kTogether), nameOf);

}  // namespace
}  // namespace hapticd::config
