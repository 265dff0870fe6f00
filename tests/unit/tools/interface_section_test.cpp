// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/interface_section.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace hapticd::tools
