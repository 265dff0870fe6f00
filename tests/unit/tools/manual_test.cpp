// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/support/file_content.h"
#include "tools/manual/generated.h"
#include "tools/manual/page.h"

namespace hapticd::tools {
namespace {

constexpr const char* kText =
    "# Reads and\n# more.\ninterface io.hapticd.Test\n\n"
    "# On or off.\ntype Switch (on, off)\n\n"
    "type Place (\n  # Metres\n  x: ?float,\n  state: (on, off),\n  words: [string]string\n)\n\n"
    "# Moves.\nmethod Move(\n  # Where to\n  to: Place\n) -> ()\n"
    "method Ask() -> (\n  answer: Switch\n)\n"
    "# Refused.\nerror No (\n  # Why\n  reason: string\n)\n";

TEST(InterfaceSection, HasMethodsThenErrorsThenTypesWithTheirFields) {
  const auto roff = interfaceSection(kText);
  ASSERT_TRUE(roff) << roff.error().text();
  EXPECT_EQ(*roff,
            ".SH \"io.hapticd.Test\"\n.PP\nReads and more.\n"
            ".SS method Move\n.PP\nMoves.\n"
            ".PP\nTakes:\n.TP\n\\fBto: Place\\fR\nWhere to.\n.PP\nAnswers nothing.\n"
            ".SS method Ask\n"
            ".PP\nTakes nothing.\n.PP\nAnswers:\n.TP\n\\fBanswer: Switch\\fR\nSee above.\n"
            ".SS error No\n.PP\nRefused.\n.TP\n\\fBreason: string\\fR\nWhy.\n"
            ".SS type Switch\n.PP\nOn or off.\n.PP\nOne of: on, off.\n"
            ".SS type Place\n.TP\n\\fBx: ?float\\fR\nMetres.\n.TP\n\\fBstate: (on, off)\\fR\nSee above.\n"
            ".TP\n\\fBwords: [string]string\\fR\nSee above.\n");
}

TEST(InterfaceSection, NamesALineThatHasAnotherForm) {
  for (const char* const line : {"function F()", "  x: int", "type A", ") -> ()"}) {
    const auto roff = interfaceSection("interface a.b\n" + std::string(line) + "\n");
    ASSERT_FALSE(roff) << line;
    EXPECT_EQ(roff.error().where, "line 2") << line;
  }
}

constexpr const char* kHelp =
    "box: does it\n"
    "Usage: build/bin/box [OPTIONS] SUBCOMMAND\n"
    "\n"
    "Positionals:\n"
    "  NAME TEXT ...               names\n"
    "\n"
    "Options:\n"
    "  -h,--help                   show help\n"
    "  --depth DIR_OR_PGM REQUIRED folder or file\n"
    "  --interval TIME:INT in [20 - 60000]\n"
    "                              time between two,\n"
    "                              in ms\n"
    "\n"
    "Subcommands:\n"
    "  watch                       look on\n"
    "\n"
    "Exit status: 0 done, 64 wrong, or no, usage,\n"
    "78 configuration.\n"
    "Socket: 5 of them, 6 at most.\n";

using Entries = std::vector<std::pair<std::string, std::string>>;

Entries textsOf(const std::vector<HelpEntry>& help) {
  Entries entries;
  for (const HelpEntry& entry : help) entries.emplace_back(entry.name, entry.text);
  return entries;
}

TEST(HelpText, GivesUsageWithoutTheFolderAndEachEntryWithItsText) {
  const HelpText help = parseHelp(kHelp);
  EXPECT_EQ(help.usage, "box [OPTIONS] SUBCOMMAND");
  EXPECT_EQ(textsOf(help.arguments), (Entries{{"NAME TEXT ...", "names"}}));
  EXPECT_EQ(textsOf(help.options),
            (Entries{{"-h,--help", "show help"},
                     {"--depth DIR_OR_PGM REQUIRED", "folder or file"},
                     {"--interval TIME:INT in [20 - 60000]", "time between two, in ms"}}));
  EXPECT_EQ(textsOf(help.commands), (Entries{{"watch", "look on"}}));
  EXPECT_EQ(textsOf(help.exit_statuses),
            (Entries{{"0", "done"}, {"64", "wrong, or no, usage"}, {"78", "configuration"}}));
}

TEST(Roff, PrintsTextAsItStands) {
  EXPECT_EQ(plainRoff(".so x\n'br a\\b --c"), "\\&.so x\n\\&'br a\\eb \\-\\-c");
}

TEST(ManualPage, RefusesAProgramThatIsNotThere) {
  const auto page = manualPage({"@OPTIONS@\n", "/nowhere/program", "1"});
  ASSERT_FALSE(page.has_value());
  EXPECT_NE(page.error().text().find("/nowhere/program"), std::string::npos);
}

TEST(ManualPage, RefusesALineThatStandsForNothing) {
  const auto page = manualPage({"@EXIT_STATUS@\n", "", "1"});
  ASSERT_FALSE(page.has_value());
  EXPECT_NE(page.error().text().find("@EXIT_STATUS@"), std::string::npos);
}

TEST(ManualPage, FillsTheVersionIn) {
  EXPECT_EQ(manualPage({".TH A 1 \"\" \"a @VERSION@\"\n", "", "1.2"}).value(), ".TH A 1 \"\" \"a 1.2\"\n");
}

constexpr const char* kHowToGenerate = "run: cmake --build --preset dev --target generate";

std::string sourceFile(const std::string& name) {
  return test::contentOf(std::string(HAPTICD_SOURCE_FOLDER) + "/" + name);
}

TEST(GeneratedParts, AreInTheSourcesAsTheTablesSay) {
  const std::string configuration = sourceFile("config/hapticd.yaml");
  EXPECT_EQ(withParameters(configuration), configuration) << kHowToGenerate;
  const std::string fixtures = sourceFile("docs/fixtures.md");
  EXPECT_EQ(withMembers(fixtures), fixtures) << kHowToGenerate;
  for (const std::string name : {"Control", "Status"}) {
    const std::string interface = sourceFile("daemon/control/io.hapticd." + name + ".varlink");
    EXPECT_EQ(withTypes(interface), interface) << kHowToGenerate;
  }
}

TEST(GeneratedParts, ReplaceWhatIsOldAndKeepWhatPeopleWrote) {
  const std::string configuration = sourceFile("config/hapticd.yaml");
  std::string old = configuration;
  const std::string line = "  # radius_m: 0.04  # 0.005..0.1 m; live\n";
  ASSERT_NE(old.find(line), std::string::npos);
  old.replace(old.find(line), line.size(),
              "  # radius_m: 7  # anything\n  # Of a parameter that is gone\n  # gone: 1  # 0..2\n");
  EXPECT_EQ(withParameters(old), configuration);
  EXPECT_EQ(withTypes("# Which one.\ntype Mode (one, two)\ntype Other (one, two)\n"),
            "# Which one.\ntype Mode (starting, idle, engaged, holding, faulted)\ntype Other (one, two)\n");
}

TEST(GeneratedParts, NameTheMemberOfAFixtureThatHasNoRow) {
  std::string document = sourceFile("docs/fixtures.md");
  const std::size_t regions = document.find("### Members of regions");
  const std::size_t range = document.find("0.0001..10 m", document.find("| `radius_m` |", regions));
  document.replace(range, 12, "anything");
  EXPECT_EQ(withMembers(document), sourceFile("docs/fixtures.md"));
  document.erase(document.find("| `exponent` |", regions), 12);
  const auto text = withMembers(document);
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().what.find("exponent"), std::string::npos) << text.error().text();
}

TEST(GeneratedParts, NameAGroupThatTheFileLacks) {
  const auto text = withParameters("---\nforce:\n");
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().what.find("contact"), std::string::npos) << text.error().text();
  EXPECT_EQ(text.error().what.find("force"), std::string::npos) << text.error().text();
}

}  // namespace
}  // namespace hapticd::tools
