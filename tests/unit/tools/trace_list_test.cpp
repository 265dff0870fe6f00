// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/list_text.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kHour_ns = 3600'000'000'000;
constexpr std::int64_t kNow_ns = 1'772'600'767'000'000'000;  // 2026-03-04 05:06:07 UTC

const Json kReply = Json::parse(R"({"folder": "/x", "omitted": 0, "traces": [
  {"name": "2026-03-03T05-06-07Z-left", "bytes": 5000000, "open": false, "depth": true, "kept": true,
   "note": "the good one", "beginNs": 1772514367000000000},
  {"name": "2026-03-04T04-06-07Z-right", "bytes": 1000, "open": false, "depth": false, "kept": false,
   "note": "", "beginNs": 1772597167000000000},
  {"name": "2026-03-04T05-06-00Z", "bytes": 2000000000, "open": true, "depth": false, "kept": false,
   "note": "", "beginNs": 1772600760000000000}]})");

/// Returns which of the three traces are chosen, by their indices in the reply.
std::string chosen(const TraceListOptions& options) {
  std::string places;
  for (const Json& trace : chosenTraces(kReply, options)) {
    for (std::size_t i = 0; i < kReply["traces"].size(); ++i) {
      if (kReply["traces"][i] == trace) places += std::to_string(i);
    }
  }
  return places;
}

TEST(TraceList, IsFilteredByLabelTimeAndState) {
  EXPECT_EQ(chosen({}), "012");
  EXPECT_EQ(chosen({.label = "left"}), "0");
  EXPECT_EQ(chosen({.label = "2026"}), "") << "the time in a name is no label";
  EXPECT_EQ(chosen({.since_ns = kNow_ns - 2 * kHour_ns}), "12");
  EXPECT_EQ(chosen({.until_ns = kNow_ns - 2 * kHour_ns}), "0");
  EXPECT_EQ(chosen({.since_ns = kNow_ns - 2 * kHour_ns, .until_ns = kNow_ns - kHour_ns}), "1");
  EXPECT_EQ(chosen({.state = "writing"}), "2");
  EXPECT_EQ(chosen({.state = "finished"}), "01");
  EXPECT_EQ(chosen({.state = "kept"}), "0");
}

TEST(TraceList, IsSortedAsAskedFor) {
  EXPECT_EQ(chosen({.sort = "size"}), "102");
  EXPECT_EQ(chosen({.sort = "name"}), "012");
  EXPECT_EQ(chosen({.sort = "size", .reverse = true}), "201");
}

TEST(TraceList, ShowsAgeSizeStateAndNoteAndSumsUp) {
  const std::string text = traceListText(kReply["traces"], kReply, kNow_ns, TerminalSize::kNoLimit);
  EXPECT_EQ(
      text,
      "NAME                        BEGIN                    AGE    SIZE  STATE                       NOTE\n"
      "2026-03-03T05-06-07Z-left   2026-03-03 05:06:07Z    24 h  5.0 MB  finished, kept, with depth  the "
      "good one\n"
      "2026-03-04T04-06-07Z-right  2026-03-04 04:06:07Z  60 min  1.0 kB  finished\n"
      "2026-03-04T05-06-00Z        2026-03-04 05:06:00Z     7 s  2.0 GB  being written\n"
      "3 traces, 2.0 GB\n");
}

TEST(TraceList, ShowsAndUsesAgesOnlyWhereTheClockWasSet) {
  Json reply = kReply;
  const Json unset{
      {"name", "1970-01-01T00-00-07Z"}, {"bytes", 1000}, {"beginNs", 7'000'000'000}, {"clockIsSet", false}};
  reply["traces"].push_back(unset);
  const std::string text = traceListText(Json::array({unset}), reply, kNow_ns, TerminalSize::kNoLimit);
  EXPECT_NE(text.find("\n1970-01-01T00-00-07Z  -        -  1.0 kB  finished\n"), std::string::npos) << text;
  const std::string no_ages = traceListText(kReply["traces"], kReply, std::nullopt, TerminalSize::kNoLimit);
  EXPECT_EQ(no_ages.find("24 h"), std::string::npos) << no_ages;
  EXPECT_NE(no_ages.find("2026-03-03 05:06:07Z    -"), std::string::npos) << no_ages;

  EXPECT_EQ(latestBegin_ns(reply), 1772600760000000000);
  EXPECT_TRUE(chosenTraces(reply, {.until_ns = kNow_ns - 3 * 24 * kHour_ns}).empty());
  const TraceDeletion deletion = deletionBefore(kNow_ns - 30 * kHour_ns, reply);
  EXPECT_TRUE(deletion.to_delete.empty()) << deletion.to_delete;
  ASSERT_EQ(deletion.staying.size(), 1U);
  EXPECT_NE(deletion.staying[0].find("its age is not known"), std::string::npos) << deletion.staying[0];
}

TEST(TraceList, DamagedOriginalsAreListedAndDeletedLikeTraces) {
  Json reply = kReply;
  const std::string name = "2026-03-03T05-06-07Z-left.mcap.damaged";
  reply["traces"].push_back(
      {{"name", name}, {"bytes", 1000}, {"open", false}, {"damaged", true}, {"kept", false}});
  EXPECT_EQ(chosenTraces(reply, {.state = "finished"}).size(), 2U);
  EXPECT_EQ(chosenTraces(reply, {.state = "damaged"}).size(), 1U);
  const std::string text = traceListText(reply["traces"], reply, kNow_ns, TerminalSize::kNoLimit);
  EXPECT_NE(text.find("damaged original\n"), std::string::npos) << text;
  EXPECT_EQ(deletionOf({name}, reply).to_delete.size(), 1U);
}

TEST(TraceList, SaysHowManyTracesWereLeftOut) {
  Json reply = kReply;
  reply["omitted"] = 7;
  const Json one = chosenTraces(reply, {.label = "left"});
  const std::string text = traceListText(one, reply, kNow_ns, TerminalSize::kNoLimit);
  EXPECT_NE(text.find("1 trace, 5.0 MB of 3 traces, 2.0 GB; hapticd lists the newest only and left out 7\n"),
            std::string::npos)
      << text;
}

TEST(TraceDeletion, ByAgeLeavesWhatIsKeptOrBeingWritten) {
  const TraceDeletion all = deletionBefore(kNow_ns, kReply);
  ASSERT_EQ(all.to_delete.size(), 1U);
  EXPECT_EQ(all.to_delete[0]["name"], "2026-03-04T04-06-07Z-right");
  EXPECT_EQ(all.staying,
            (std::vector<std::string>{"2026-03-03T05-06-07Z-left stays: it is kept or being written",
                                      "2026-03-04T05-06-00Z stays: it is kept or being written"}));
  EXPECT_TRUE(deletionBefore(kNow_ns - 48 * kHour_ns, kReply).to_delete.empty());
}

TEST(TraceDeletion, ByNameTakesEachOnceAndNamesWhatCannotGo) {
  const std::string right = "2026-03-04T04-06-07Z-right";
  EXPECT_EQ(deletionOf({right, right}, kReply).to_delete.size(), 1U);
  EXPECT_EQ(deletionOf({"2026-03-03T05-06-07Z-left", "2026-03-04T05-06-00Z", "x"}, kReply).problems.size(),
            3U);
}

}  // namespace
}  // namespace hapticd::tools
