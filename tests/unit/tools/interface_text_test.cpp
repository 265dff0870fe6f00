// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/interface_text.h"

#include <gtest/gtest.h>

#include "tools/manual/interface_section.h"

namespace hapticd::tools {
namespace {

constexpr const char* kText =
    "# Reads and\n# more.\ninterface io.hapticd.Test\n\n"
    "# On or off.\ntype Switch (on, off)\n\n"
    "# A place.\ntype Place (\n  # Metres\n  x: ?float,\n  # Nested\n  inner: (a: int, # why\n    b: "
    "[]string),\n"
    "  words: [string]string\n)\n\n"
    "# Moves.\nmethod Move(\n  # Where to\n  to: Place\n) -> ()\n"
    "method Ask() -> (answer: Switch)\n"
    "# Refused.\nerror No (reason: string)\n";

TEST(InterfaceText, IsTakenApartWithItsComments) {
  const auto interface = parseInterface(kText);
  ASSERT_TRUE(interface) << interface.error().text();
  EXPECT_EQ(interface->name, "io.hapticd.Test");
  EXPECT_EQ(interface->comment, "Reads and more.");
  ASSERT_EQ(interface->items.size(), 5U);
  EXPECT_EQ(interface->items[0].fields[1].name, "off");
  EXPECT_EQ(interface->items[0].fields[1].type, "");
  const InterfaceItem& place = interface->items[1];
  ASSERT_EQ(place.fields.size(), 3U);
  EXPECT_EQ(place.comment, "A place.");
  EXPECT_EQ(place.fields[0].type, "?float");
  EXPECT_EQ(place.fields[0].comment, "Metres");
  EXPECT_EQ(place.fields[1].type, "(a: int, b: []string)");
  EXPECT_EQ(place.fields[2].type, "[string]string");
  EXPECT_EQ(interface->items[2].fields[0].comment, "Where to");
  EXPECT_TRUE(interface->items[2].answers.empty());
  EXPECT_EQ(interface->items[3].answers[0].type, "Switch");
  EXPECT_EQ(interface->items[4].kind, "error");
}

TEST(InterfaceText, SaysInWhichLineItIsWrong) {
  const auto errorOf = [](const std::string& text) {
    const auto interface = parseInterface(text);
    return interface ? std::string() : interface.error().where + ": " + interface.error().what;
  };
  EXPECT_EQ(errorOf("type A (a: int)"), "line 1: the line 'interface' is missing");
  EXPECT_EQ(errorOf("interface a.b\nfunction F()"),
            "line 2: 'function' where type, method or error is expected");
  EXPECT_EQ(errorOf("interface a.b\nmethod F()\n"), "line 3: '->' is missing");
  EXPECT_EQ(errorOf("interface a.b\ntype A (a: int"), "line 2: ')' is missing");
  EXPECT_EQ(errorOf("interface a.b\ntype A (:"), "line 2: the name of a field is missing");
}

TEST(InterfaceText, BecomesRoffWithMethodsFirst) {
  const auto interface = parseInterface(kText);
  ASSERT_TRUE(interface);
  const std::string roff = interfaceSection(*interface);
  EXPECT_TRUE(roff.starts_with(".SH \"io.hapticd.Test\"\n.PP\nReads and more.\n.SS method Move\n")) << roff;
  EXPECT_NE(roff.find("Takes:\n.TP\n\\fBto: Place\\fR\nWhere to.\n.PP\nAnswers nothing.\n"),
            std::string::npos)
      << roff;
  EXPECT_NE(roff.find("One of: on, off.\n"), std::string::npos);
  EXPECT_LT(roff.find(".SS error No"), roff.find(".SS type Switch"));
}

}  // namespace
}  // namespace hapticd::tools
