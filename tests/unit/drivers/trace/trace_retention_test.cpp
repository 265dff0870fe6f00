// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/trace_retention.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace hapticd::drivers {
namespace {

TraceEntry trace(const std::string& name, std::uint64_t bytes) {
  TraceEntry entry;
  entry.name = name;
  entry.bytes = bytes;
  return entry;
}

std::vector<std::string> namesOf(const std::vector<TraceEntry>& traces) {
  std::vector<std::string> names;
  for (const TraceEntry& entry : traces) names.push_back(entry.name);
  return names;
}

const std::string kFault = "2026-03-04T05-06-07Z-fault";
const std::string kDump = "2026-03-04T05-06-08Z-dump-2";

TEST(TraceRetention, DeletesTheOldestFirstAndNeverWhatIsProtected) {
  std::vector<TraceEntry> traces{trace("a", 1),    trace("kept", 2),  trace(kFault, 4),
                                 trace("b", 8),    trace("left", 16), trace("newest", 32),
                                 trace(kDump, 64), trace("open", 128)};
  traces[1].kept = true;
  traces[4].open = true;
  traces[7].open = true;
  const RetentionPlan plan = planRetention(traces, "newest");
  EXPECT_EQ(namesOf(plan.deletable), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(plan.bytes, 255U);
  EXPECT_EQ(plan.protected_bytes, 255U - 1 - 8);
  EXPECT_EQ(plan.kept, 1U);
  EXPECT_EQ(plan.dumps, 2U);
}

TEST(TraceRetention, TheTraceJustFinishedStaysEvenIfTheClockWasSetBack) {
  const std::vector<TraceEntry> traces{trace("finished", 1), trace("middle", 2), trace("newest by name", 4)};
  EXPECT_EQ(namesOf(planRetention(traces, "finished").deletable), std::vector<std::string>{"middle"});
}

TEST(TraceRetention, ADamagedOriginalCountsAndGoesLikeATraceOfItsAge) {
  std::vector<TraceEntry> traces{trace("a", 1), trace("b", 2), trace("b.mcap.damaged", 4),
                                 trace(kFault + ".mcap.damaged", 8)};
  traces[2].damaged = true;
  traces[3].damaged = true;
  const RetentionPlan plan = planRetention(traces, "");
  EXPECT_EQ(plan.bytes, 15U);
  EXPECT_EQ(namesOf(plan.deletable), (std::vector<std::string>{"a", "b.mcap.damaged"}))
      << "b is the newest trace, and the other one is of the flight recorder";
  EXPECT_EQ(plan.protected_bytes, 10U);
}

TEST(TraceRetention, OfFewTracesNothingMayGo) {
  EXPECT_TRUE(planRetention({}, "").deletable.empty());
  const std::vector<TraceEntry> one{trace("one", 7)};
  EXPECT_TRUE(planRetention(one, "").deletable.empty());
  EXPECT_EQ(planRetention(one, "").protected_bytes, 7U);
}

TEST(TraceRetention, AKeptDumpCountsOnce) {
  std::vector<TraceEntry> traces{trace(kFault, 1)};
  traces[0].kept = true;
  EXPECT_EQ(planRetention(traces, "").kept, 1U);
  EXPECT_EQ(planRetention(traces, "").dumps, 0U);
}

}  // namespace
}  // namespace hapticd::drivers
