// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

Table sample() {
  Table table({{"NAME"}, {"SIZE", true}, {"MEANING"}});
  table.add({"ä", "5", "one two three four five six seven eight nine ten"});
  table.add({"second", "500", ""});
  return table;
}

TEST(Table, HasAHeaderAndIsWholeWithoutAWidth) {
  EXPECT_EQ(sample().text(TerminalSize::kNoLimit),
            "NAME    SIZE  MEANING\n"
            "ä          5  one two three four five six seven eight nine ten\n"
            "second   500\n");
}

TEST(Table, WrapsTheLastColumnWithinTheTerminal) {
  EXPECT_EQ(sample().text(40),
            "NAME    SIZE  MEANING\n"
            "ä          5  one two three four five\n"
            "              six seven eight nine ten\n"
            "second   500\n");
}

TEST(Table, PutsTheLastColumnBelowWhereThereIsNoRoomBesideTheOthers) {
  EXPECT_EQ(sample().text(30),
            "NAME    SIZE\n"
            "    MEANING\n"
            "ä          5\n"
            "    one two three four five\n"
            "    six seven eight nine ten\n"
            "second   500\n");
}

TEST(Table, IsNeverWiderThanTheTerminal) {
  for (std::size_t columns = 10; columns < 90; ++columns) {
    std::istringstream lines(sample().text(columns));
    for (std::string line; std::getline(lines, line);) EXPECT_LE(columnsOf(line), columns) << line;
  }
}

TEST(FittedText, WrapsBelowTheValueAndDividesNoWord) {
  const std::string text =
      "name     one two three four five six\nshort    line\n/a/path/that/is/longer/than/a/line\n";
  EXPECT_EQ(fitted(text, 34),
            "name     one two three four five\n"
            "         six\n"
            "short    line\n"
            "/a/path/that/is/longer/than/a/line\n");
  EXPECT_EQ(fitted("name     one two three\n", 20), "name     one two\n    three\n");
  EXPECT_EQ(fitted("a sentence without a name\n", 12), "a sentence\n   without a\n   name\n");
  EXPECT_EQ(fitted("ä     öööööööööö üüü\n", 20), "ä     öööööööööö üüü\n");
  EXPECT_EQ(fitted("/a/path/of/a/file is open", 10), "/a/path/of/a/file\n  is open");
  EXPECT_EQ(fitted(text, TerminalSize::kNoLimit), text);
  EXPECT_EQ(fitted("", 20), "");
  EXPECT_EQ(fitted("a b\n", 1), "a\nb\n");
}

TEST(TimeText, IsInUtc) {
  EXPECT_EQ(utcTime(1'772'600'767'999'999'744.0), "2026-03-04 05:06:07Z");
  EXPECT_EQ(utcTimeWithMilliseconds(1'772'600'767'123'000'000.0), "2026-03-04 05:06:07.123Z");
  EXPECT_EQ(utcTime(std::nan("")), "-");
}

TEST(TimeText, ReadsTimesAndAges) {
  constexpr std::int64_t kNow_ns = 1'772'600'767'000'000'000;
  constexpr std::int64_t kMidnight_ns = 1'772'582'400'000'000'000;
  EXPECT_EQ(timeFrom("2026-03-04", kNow_ns), kMidnight_ns);
  EXPECT_EQ(timeFrom("2026-03-04 05:06", kNow_ns), kNow_ns - 7'000'000'000);
  EXPECT_EQ(timeFrom("2026-03-04T05:06:07Z", kNow_ns), kNow_ns);
  EXPECT_EQ(timeFrom("2026-03-04T05-06-07Z", kNow_ns), kNow_ns) << "as in the name of a trace";
  EXPECT_EQ(timeFrom("90s", kNow_ns), kNow_ns - 90'000'000'000);
  EXPECT_EQ(secondsOfAge("1.5h"), 5400);
  EXPECT_EQ(secondsOfAge("2w"), 14 * 86400);
  for (const char* bad : {"", "5", "5x", "-5d", "nan", "nand", "1e300d", "d", "2026-13-01", "2026-03-04x"}) {
    EXPECT_FALSE(timeFrom(bad, kNow_ns)) << bad;
  }
}

TEST(TimeText, ShowsAgesInTheUnitThatFits) {
  EXPECT_EQ(ageText(119.9), "119 s");
  EXPECT_EQ(ageText(120), "2 min");
  EXPECT_EQ(ageText(7200), "2 h");
  EXPECT_EQ(ageText(2 * 86400), "2 d");
  EXPECT_EQ(ageText(-5), "0 s");
}

}  // namespace
}  // namespace hapticd::tools
