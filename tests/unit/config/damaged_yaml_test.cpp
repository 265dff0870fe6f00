// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "config/settings/parameter_table.h"
#include "config/yaml_loader.h"
#include "tests/support/file_content.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

using test::contentOf;
std::string repeated(std::string_view piece, std::size_t length) {
  std::string text;
  while (text.size() < length) text += piece;
  return text;
}

// A loader may only return settings that the table and the rules accept, or errors with a text.
void expectSettingsOrErrors(const std::expected<Settings, std::vector<base::Error>>& settings) {
  if (!settings) {
    EXPECT_FALSE(settings.error().empty());
    EXPECT_LE(settings.error().size(), 101U);
    for (const base::Error& error : settings.error()) {
      EXPECT_FALSE(error.where.empty());
      EXPECT_FALSE(error.what.empty());
    }
    return;
  }
  for (const Parameter& parameter : allParameters()) {
    EXPECT_TRUE(parameter.check(parameter.get(*settings))) << parameter.name;
  }
  EXPECT_TRUE(checkTogether(*settings).empty());
}

// Nested, endless and repetitive inputs of the maximum file size: refused with bounded work and stack. The
// test's time limit bounds the time.
TEST(DamagedYaml, LongPathologicalFilesAreRefused) {
  const test::TemporaryFolder folder;
  for (const char* piece :
       {"[", "{", "[a,",   "{a: ", "{? ", "? ",         "- ",   "a: ", "k: [", "&a ", "*", "!", ":", "\"",
        "'", "a", "---\n", "|\n",  ">",   "%TAG ! x\n", "a:\n", "\\",  "@",    "`",   "}", "]", ","}) {
    SCOPED_TRACE(piece);
    const auto settings = loadSettings(folder.write("long.yaml", repeated(piece, 1000000)));
    EXPECT_FALSE(settings);
    expectSettingsOrErrors(settings);
  }
}

TEST(DamagedYaml, AnAliasBombIsRefusedWithoutUnfoldingIt) {
  const test::TemporaryFolder folder;
  std::string yaml = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n";
  for (int level = 1; level < 30; ++level) {
    const std::string alias = "*a" + std::to_string(level - 1);
    yaml += "a" + std::to_string(level) + ": &a" + std::to_string(level) + " [" + alias +
            repeated(", " + alias, 40) + "]\n";
  }
  const auto settings = loadSettings(folder.write("bomb.yaml", yaml));
  ASSERT_FALSE(settings);
  expectSettingsOrErrors(settings);
}

TEST(DamagedYaml, ManyProblemsAreCutToAHundredAndTheRestCounted) {
  const test::TemporaryFolder folder;
  std::string yaml = "force:\n";
  for (int i = 0; i < 150; ++i) yaml += "  x" + std::to_string(i) + ": 1\n";
  const auto settings = loadSettings(folder.write("many.yaml", yaml));
  ASSERT_FALSE(settings);
  ASSERT_EQ(settings.error().size(), 101U);
  EXPECT_EQ(settings.error()[100].what, "50 more problems");
}

// The list is the first name or value, and line n holds the one after the n-th.
TEST(DamagedYaml, AFileOfManyValuesIsReadNoFurtherThanTwentyFiveThousand) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("foreign.yaml", repeated("- 1\n", 200000));
  const auto settings = loadSettings(file);
  ASSERT_FALSE(settings);
  ASSERT_EQ(settings.error().size(), 2U);
  EXPECT_EQ(
      settings.error()[1].text(),
      file.string() +
          ":25000: more than 25000 names and values, not read any further (check that this is the right "
          "file; a path has at most 256 points)");
}

// A cut must never count as a request for the defaults of what follows it, whatever is there.
TEST(DamagedYaml, EveryCutOfAFileWithMarksIsRefused) {
  const test::TemporaryFolder folder;
  for (const char* name : {"demo.yaml", "hapticd.yaml"}) {
    const std::string whole = contentOf(std::filesystem::path(HAPTICD_SHIPPED_CONFIG) / name);
    const std::size_t end = whole.rfind("...");
    ASSERT_NE(end, std::string::npos);
    // At each byte where that is fast enough.
    const std::size_t step = 1 + whole.size() / 2000;
    std::size_t accepted = 0;
    for (std::size_t length = 0; length < end + 3; length += step) {
      if (loadSettings(folder.write("cut.yaml", whole.substr(0, length)))) ++accepted;
    }
    EXPECT_EQ(accepted, 0U) << name;
    EXPECT_TRUE(loadSettings(folder.write("cut.yaml", whole.substr(0, end + 3))));
  }
}

}  // namespace
}  // namespace hapticd::config
