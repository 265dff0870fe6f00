// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tools/hapticctl/additions/pose_lines.h"
#include "tools/hapticctl/base/number_with_unit.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/hapticctl/watch.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

/// The status of a faulted box with that many warnings beside those about the fault and the trace.
Json status(int warnings) {
  Json all = Json::parse(R"({"mode": "faulted", "cause": "handle_too_fast", "uptimeS": 59,
    "camera": {"state": "streaming", "identity": "ein sehr langer Name mit ü, der nicht auf einen Schirm passt, auch nicht halb"},
    "handle": {"state": "present"}, "trace": {"state": "waiting", "detail": "the disk is full: delete traces"}})");
  all["warnings"] = {
      "faulted: the hand seems to move faster than safety.max_handle_speed_m_per_s (correct the cause, then: "
      "hapticctl clear-fault)",
      "trace waits: the disk is full: delete traces"};
  for (int i = 0; i < warnings; ++i) {
    all["warnings"].push_back("warning " + std::to_string(i) +
                              " with a remedy that takes more than one line of a "
                              "terminal of eighty columns");
  }
  return all;
}

TEST(Glance, FitsOnAScreenOf80By24HoweverMuchIsWrong) {
  for (const int warnings : {0, 1, 3, 20}) {
    const auto lines = glanceLines(status(warnings), {});
    EXPECT_LT(lines.size(), 24U);
    for (const std::string& line : lines) EXPECT_LE(columnsOf(line), 80U) << line;
  }
}

TEST(Glance, SaysFirstWhatIsWrongAndWhatToDo) {
  const auto lines = glanceLines(status(1), {});
  EXPECT_TRUE(lines[0].starts_with("! faulted: the hand seems to move faster than")) << lines[0];
  EXPECT_NE((lines[0] + lines[1]).find("hapticctl clear-fault"), std::string::npos);
  EXPECT_EQ(lines[2], "! trace waits: the disk is full: delete traces");
  EXPECT_TRUE(lines[5].starts_with("mode          faulted")) << lines[5];
}

TEST(Glance, CountsTheWarningsThatItHasNoRoomFor) {
  const auto lines = glanceLines(status(20), {});
  const auto more =
      std::ranges::find_if(lines, [](const std::string& line) { return line.starts_with("! and "); });
  ASSERT_NE(more, lines.end());
  // a fault, a waiting trace and two warnings take seven lines
  EXPECT_EQ(*more, "! and 18 more: hapticctl status --all");
}

TEST(Glance, KeepsToASmallScreen) {
  EXPECT_EQ(glanceLines(status(2), {{80, 5}, false}).size(), 4U);
  for (const std::string& line : glanceLines(status(2), {{50, 24}, false})) EXPECT_LE(columnsOf(line), 50U);
}

TEST(Glance, ColoursOnlyWhenAskedTo) {
  for (const std::string& line : glanceLines(status(1), {})) EXPECT_EQ(line.find('\033'), std::string::npos);
  EXPECT_TRUE(glanceLines(status(1), {{}, true}).front().starts_with("\033[31m! faulted"));
}

Json engagedStatus() {
  return {{"mode", "engaged"},
          {"uptimeS", 60},
          {"loop", {{"rateHz", 1000}, {"counters", {{"ticks", 1'000'000}, {"overruns", 100}}}}},
          {"camera", {{"state", "streaming"}}},
          {"handle", {{"state", "present"}}},
          {"law", {{"chosen", "surface"}}},
          {"scene", {{"points", 0}}}};
}

TEST(Glance, IsGreenOnlyWhileNothingIsWrong) {
  const auto modeLine = [](const Json& status) {
    for (const std::string& line : glanceLines(status, {{}, true})) {
      if (line.find("mode    ") != std::string::npos) return line;
    }
    return std::string();
  };
  EXPECT_TRUE(modeLine(engagedStatus()).starts_with("\033[32m"));
  Json warned = engagedStatus();
  warned["warnings"] = {"something"};
  EXPECT_TRUE(modeLine(warned).starts_with("\033[33m"));
}

// Metrics, JSON and the page have no other list; a sentence of its own here would be missing there.
TEST(Glance, WarnsOfExactlyWhatTheDaemonLists) {
  Json bad = engagedStatus();
  bad["mode"] = "faulted";
  bad["camera"]["state"] = "lost";
  bad["handle"]["state"] = "absent";
  bad["loop"] = {{"rateHz", 700}, {"counters", {{"ticks", 1000}, {"overruns", 300}}}};
  EXPECT_TRUE(warningsOf(bad).empty());
  for (const std::string& line : glanceLines(bad, {})) EXPECT_FALSE(line.starts_with("!")) << line;
  bad["warnings"] = {"one", "two"};
  EXPECT_EQ(warningsOf(bad), (std::vector<std::string>{"one", "two"}));
  EXPECT_TRUE(statusText(bad).starts_with("! one\n! two\nmode "));
}

TEST(Glance, ExplainsASceneWithoutPointsUnderTheLawThatNeedsNone) {
  EXPECT_EQ(sceneContentText(engagedStatus()),
            "all pixels (the law surface works on the depth image and models no points)");
  EXPECT_EQ(sceneContentText(Json::parse(R"({"law": {"chosen": "proxy"}, "scene": {"points": 7}})")),
            "7 points");
}

TEST(TerminalText, CutsBetweenCharacters) {
  EXPECT_EQ(cutTo("äöüäöü", 6), "äöüäöü");
  EXPECT_EQ(cutTo("äöüäöü", 5), "äö...");
  EXPECT_EQ(cutTo("abc", 2), "ab");
}

TEST(TerminalText, BreaksAtBlanksAndLongWordsAnywhere) {
  EXPECT_EQ(wrapped("one two three", 7, "  "), "one two\n  three");
  EXPECT_EQ(wrapped("abcdefgh", 5, " "), "abcde\n fgh");
  EXPECT_EQ(wrapped("", 5, " "), "");
}

TEST(ForceHistory, DrawsTheNewestAtTheRightBelowARoundScale) {
  ForceHistory history;
  for (const double force_n : {0.0, 0.75, 1.5}) history.add(force_n);
  EXPECT_EQ(history.lines(1, 80, true), (std::vector<std::string>{"   2.0 N | ▃▆"}));
  EXPECT_EQ(history.lines(2, 80, false), (std::vector<std::string>{"   2.0 N |  +", "     0 N | +#"}));
}

TEST(ForceHistory, KeepsSixtyWindowsAndTheWidthOfTheTerminal) {
  ForceHistory history;
  for (int i = 0; i < 100; ++i) history.add(1);
  EXPECT_EQ(columnsOf(history.lines(1, 200, true)[0]), 10 + ForceHistory::kWindows);
  EXPECT_EQ(columnsOf(history.lines(1, 30, true)[0]), 30U);
  EXPECT_TRUE(history.lines(1, 10, true).empty());
  EXPECT_TRUE(history.lines(0, 80, true).empty());
}

TEST(ForceHistory, ShowsAGapForAWindowWithoutTicks) {
  ForceHistory history;
  for (const double force_n : {1.0, std::nan(""), 1.0}) history.add(force_n);
  EXPECT_EQ(history.lines(1, 80, false)[0], "   1.0 N |# #");
}

TEST(NumberWithUnit, IsThatInTheUnitOfTheParameter) {
  EXPECT_EQ(inUnit("800N/m", "N/m"), "800");
  EXPECT_EQ(inUnit("0.8 N/mm", "N/m"), "800");
  EXPECT_EQ(inUnit("5mm", "m"), "0.005");
  EXPECT_EQ(inUnit("7 mm", "m"), "0.007");
  EXPECT_EQ(inUnit("1e3m", "m"), "1e3");
  EXPECT_EQ(inUnit("-20ms", "s"), "-0.02");
  EXPECT_EQ(inUnit("180deg", "rad"), "3.141592653589793");
}

TEST(NumberWithUnit, LeavesOtherTextToTheDaemon) {
  for (const char* text :
       {"", "800", "1e-3", "text", "info", "nanometres", "N/m", "1,5", "1.5.2", "0x10", "1,5 m", "true", "-"})
    EXPECT_EQ(inUnit(text, "N/m"), text);
  EXPECT_EQ(inUnit("800 ", "N/m"), "800");
}

TEST(NumberWithUnit, SaysWhichUnitsArePossible) {
  const auto wrong = inUnit("800kg", "N/m");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error(), "\"kg\" is not a unit that it takes; write the number in N/m, or with N/mm");
  const auto only = inUnit("3m", "px");
  ASSERT_FALSE(only);
  EXPECT_EQ(only.error(), "\"m\" is not a unit that it takes; write the number in px");
  const auto none = inUnit("8px", "");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error(), "has no unit; write 8");
}

TEST(PoseLines, AreNumbersWithCommasOrBlanks) {
  const Json pose{{"positionM", {0.1, -0.2, 3.0}}, {"orientationXyzw", {0.0, 0.0, 0.0, 1.0}}};
  for (const char* line : {"0.1,-0.2,3,0,0,0,1", "  0.1 -0.2 3   0 0 0 1\r", "0.1, -0.2, 3, 0, 0, 0, 1"})
    EXPECT_EQ(poseFromLine(line), pose) << line;
  Json aged = pose;
  aged["ageS"] = 0.02;
  EXPECT_EQ(poseFromLine("0.1,-0.2,3,0,0,0,1,0.02"), aged);
}

TEST(PoseLines, AreObjectsOfTheCallAsWell) {
  const Json pose{{"positionM", {0, 0, 0}}, {"orientationXyzw", {0, 0, 0, 1}}, {"timeNs", 12}};
  EXPECT_EQ(poseFromLine(pose.dump()), pose);
}

TEST(PoseLines, MayBeEmptyOrComments) {
  for (const char* line : {"", "  \t", "# x,y,z,qx,qy,qz,qw"}) EXPECT_EQ(poseFromLine(line), Json()) << line;
}

TEST(PoseLines, AreRefusedWithTheReason) {
  const auto refusal = [](const char* line) {
    const auto pose = poseFromLine(line);
    return pose ? std::string("none") : pose.error();
  };
  EXPECT_EQ(refusal("1,2,3"), "has 3 numbers; write x,y,z,qx,qy,qz,qw or these and an age");
  EXPECT_EQ(refusal("1,2,3,0,0,0,nan"), "\"nan\" is not a finite number");
  EXPECT_EQ(refusal("1,2,x,0,0,0,1"), "\"x\" is not a finite number");
  EXPECT_EQ(refusal("{\"positionM\": [0,0,0]"), "is not a JSON object");
  EXPECT_EQ(refusal("{\"frame\": \"a\"}"), "has the member \"frame\", which FeedPose does not have");
}

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
