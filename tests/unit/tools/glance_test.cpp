// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tools/hapticctl/text/status_text.h"
#include "tools/hapticctl/watch.h"

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

}  // namespace
}  // namespace hapticd::tools
