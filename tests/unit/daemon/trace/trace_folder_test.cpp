// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "daemon/trace/reader/trace_folder.h"
#include "daemon/trace/writer/trace_writer.h"
#include "rt/base/clock.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr std::int64_t kTime_ns = 1'772'600'767'999'999'999;  // 2026-03-04T05:06:07.999999999Z

/// Adds a file of `bytes` bytes that was changed `age` ago.
void addFile(const TemporaryFolder& folder, const std::string& name, std::size_t bytes,
             std::chrono::hours age) {
  const fs::path file = folder.write(name, std::string(bytes, 'x'));
  fs::last_write_time(file, fs::file_time_type::clock::now() - age);
}

std::vector<std::string> namesIn(const TemporaryFolder& folder) {
  const auto traces = listTraces(folder.path());
  EXPECT_TRUE(traces) << traces.error().text();
  std::vector<std::string> names;
  for (const TraceEntry& entry : *traces) names.push_back(entry.name);
  return names;
}

TEST(TraceFolder, NamesAreOfPlainCharactersOnly) {
  for (const char* name : {"a", "2026-03-04T05-06-07Z-label_1.b"}) EXPECT_TRUE(isTraceName(name)) << name;
  EXPECT_TRUE(isTraceName(std::string(100, 'a')));
  EXPECT_FALSE(isTraceName(std::string(101, 'a')));
  for (const char* name : {"", ".", "..", ".a", "a/b", "a b", "a\n", "ä", "a*"})
    EXPECT_FALSE(isTraceName(name));
}

TEST(TraceFolder, GivesNamesThatAreFree) {
  const TemporaryFolder folder;
  const std::string plain = "2026-03-04T05-06-07Z";
  EXPECT_EQ(newTraceName(folder.path(), kTime_ns, ""), plain);
  EXPECT_EQ(newTraceName(folder.path(), kTime_ns, "../a b"), plain + "-..-a-b");
  const std::string longest = newTraceName(folder.path(), kTime_ns, std::string(500, 'a'));
  EXPECT_TRUE(isTraceName(longest) && isTraceName(longest + "-123"));
  addFile(folder, plain + ".mcap", 1, {});
  addFile(folder, plain + "-2.mcap.part", 1, {});
  EXPECT_EQ(newTraceName(folder.path(), kTime_ns, ""), plain + "-3");
}

TEST(TraceFolder, ListsTheOldestFirst) {
  const TemporaryFolder folder;
  addFile(folder, "new.mcap", 10, std::chrono::hours(1));
  addFile(folder, "old.mcap", 20, std::chrono::hours(3));
  addFile(folder, "open.mcap.part", 30, std::chrono::hours(2));
  addFile(folder, "notes.txt", 40, std::chrono::hours(4));
  fs::create_directory(folder.path() / "folder.mcap");
  const auto traces = listTraces(folder.path());
  ASSERT_TRUE(traces) << traces.error().text();
  ASSERT_EQ(namesIn(folder), (std::vector<std::string>{"old", "open", "new"}));
  EXPECT_EQ((*traces)[0].bytes, 20U);
  EXPECT_FALSE((*traces)[0].open);
  EXPECT_EQ((*traces)[1].bytes, 30U);
  EXPECT_TRUE((*traces)[1].open);
  EXPECT_LT((*traces)[0].time_ns, (*traces)[1].time_ns);
}

TEST(TraceFolder, ReportsWhichTracesContainDepth) {
  const TemporaryFolder folder;
  for (const bool depth : {true, false}) {
    const auto writer =
        TraceWriter::create(folder.path() / (depth ? "with.mcap" : "without.mcap"), {.depth = depth});
    ASSERT_TRUE(writer) << writer.error().text();
    ASSERT_TRUE((*writer)->close());
  }
  const auto traces = listTraces(folder.path());
  ASSERT_TRUE(traces) << traces.error().text();
  ASSERT_EQ(traces->size(), 2U);
  for (const TraceEntry& entry : *traces) {
    EXPECT_EQ(entry.depth, entry.name == "with");
    EXPECT_EQ(entry.bytes, fs::file_size(folder.path() / (entry.name + ".mcap")));
  }
}

TEST(TraceFolder, SortsByTheTimeInTheNameAndNotByTheLastChange) {
  const TemporaryFolder folder;
  addFile(folder, "2026-03-04T05-06-07Z-2.mcap", 1, std::chrono::hours(1));
  addFile(folder, "2026-03-04T05-06-07Z.mcap", 1, std::chrono::hours(2));
  addFile(folder, "2026-03-04T05-06-08Z-a.mcap", 1, std::chrono::hours(5));
  addFile(folder, "2026-03-04T05-06-06Z-b.mcap.part", 1, std::chrono::hours(0));
  addFile(folder, "9999-99-99T05-06-06Z.mcap", 1, std::chrono::hours(3));  // not a time
  EXPECT_EQ(namesIn(folder), (std::vector<std::string>{"2026-03-04T05-06-06Z-b", "2026-03-04T05-06-07Z",
                                                       "2026-03-04T05-06-07Z-2", "2026-03-04T05-06-08Z-a",
                                                       "9999-99-99T05-06-06Z"}));
  const auto traces = listTraces(folder.path());
  EXPECT_EQ((*traces)[1].begin_ns, kTime_ns / rt::kNsPerSecond * rt::kNsPerSecond);
  EXPECT_EQ((*traces)[4].begin_ns, (*traces)[4].time_ns);
}

TEST(TraceFolder, SortsByTheNumbersOfTracesThatHaveThem) {
  const TemporaryFolder folder;
  const auto add = [&folder](const std::string& name, const TraceOptions& options) {
    const auto writer = TraceWriter::create(folder.path() / (name + ".mcap"), options);
    return writer && (*writer)->close();
  };
  ASSERT_TRUE(add("2026-03-04T05-06-07Z", {.clock_is_set = true, .number = 9}));
  ASSERT_TRUE(add("1970-01-01T00-00-09Z", {.clock_is_set = false, .number = 11}));
  ASSERT_TRUE(add("2026-03-04T05-06-08Z", {.clock_is_set = true, .number = 10}));
  ASSERT_TRUE(add("2026-03-04T05-06-09Z", {}));
  EXPECT_EQ(namesIn(folder), (std::vector<std::string>{"2026-03-04T05-06-09Z", "2026-03-04T05-06-07Z",
                                                       "2026-03-04T05-06-08Z", "1970-01-01T00-00-09Z"}));
  const auto traces = *listTraces(folder.path());
  EXPECT_EQ(traces[0].clock_is_set, std::nullopt);
  EXPECT_EQ(traces[2].clock_is_set, true);
  EXPECT_EQ(traces[3].clock_is_set, false);
  EXPECT_EQ(traces[3].number, 11U);
}

TEST(TraceFolder, RecognisesTracesOfTheFlightRecorder) {
  const std::string time = "2026-03-04T05-06-07Z";
  for (const char* dump : {"-dump", "-fault", "-overrun-burst", "-fault-2", "-overrun-burst-17"}) {
    EXPECT_TRUE(isDumpName(time + dump)) << dump;
  }
  for (const char* other : {"", "-2", "-faulty", "-my-fault", "-fault-", "-fault-x", "-faults-2"}) {
    EXPECT_FALSE(isDumpName(time + other)) << other;
  }
  EXPECT_FALSE(isDumpName("x-fault"));
}

TEST(TraceFolder, FindsOpenTraces) {
  const TemporaryFolder folder;
  addFile(folder, "a.mcap", 1, {});
  addFile(folder, "b.mcap.part", 1, {});
  addFile(folder, "c.part", 1, {});
  EXPECT_EQ(openTraces(folder.path()), std::vector<std::string>{"b"});
  EXPECT_TRUE(openTraces(folder.path() / "nowhere").empty());
}

TEST(TraceFolder, AKeptTraceIsDeletedOnlyAfterTheMarkIsRemoved) {
  const TemporaryFolder folder;
  addFile(folder, "a.mcap", 1, {});
  addFile(folder, "b.mcap.part", 1, {});
  ASSERT_TRUE(keepTrace(folder.path(), "a", true));
  ASSERT_TRUE(keepTrace(folder.path(), "a", true)) << "twice is no error";
  ASSERT_TRUE(keepTrace(folder.path(), "b", true)) << "also while it is written";
  auto traces = *listTraces(folder.path());
  ASSERT_EQ(traces.size(), 2U) << "marks are no traces";
  EXPECT_TRUE(traces[0].kept && traces[1].kept);
  const auto refused = deleteTrace(folder.path(), "a");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("trace keep --undo a"), std::string::npos) << refused.error().text();
  ASSERT_TRUE(keepTrace(folder.path(), "a", false));
  ASSERT_TRUE(keepTrace(folder.path(), "a", false));
  ASSERT_TRUE(deleteTrace(folder.path(), "a"));
  for (const char* name : {"a", "nowhere", "../b", ""})
    EXPECT_FALSE(keepTrace(folder.path(), name, true)) << name;
  EXPECT_FALSE(fs::exists(folder.path() / "a.keep"));
}

TEST(TraceFolder, DamagedOriginalsAreCountedKeptAndDeletedByName) {
  const TemporaryFolder folder;
  const std::string name = "2026-03-04T05-06-07Z-a", damaged = name + ".mcap.damaged";
  addFile(folder, name + ".mcap", 1, {});
  addFile(folder, damaged, 10, {});
  addFile(folder, damaged + "-2", 100, {});
  for (const char* other : {"a.damaged", "a.mcap.damaged-", "a.mcap.damaged-x", "a.mcap.rewriting"})
    addFile(folder, other, 1, {});
  EXPECT_EQ(namesIn(folder), (std::vector<std::string>{name, damaged, damaged + "-2"}));
  const auto traces = *listTraces(folder.path());
  EXPECT_EQ(traces[1].bytes, 10U);
  EXPECT_TRUE(traces[1].damaged && traces[2].damaged && !traces[0].damaged);
  EXPECT_FALSE(traces[1].open);
  EXPECT_EQ(traces[1].begin_ns, traces[0].begin_ns);

  ASSERT_TRUE(keepTrace(folder.path(), damaged, true));
  EXPECT_FALSE(deleteTrace(folder.path(), damaged));
  ASSERT_TRUE(keepTrace(folder.path(), damaged, false));
  ASSERT_TRUE(noteTrace(folder.path(), damaged, "the disk failed"));
  EXPECT_EQ((*listTraces(folder.path()))[1].note, "the disk failed");
  ASSERT_TRUE(deleteTrace(folder.path(), damaged));
  EXPECT_EQ(namesIn(folder), (std::vector<std::string>{name, damaged + "-2"}));
  EXPECT_FALSE(fs::exists(folder.path() / (damaged + ".note")));
  ASSERT_TRUE(deleteTrace(folder.path(), name));
  EXPECT_EQ(namesIn(folder), std::vector<std::string>{damaged + "-2"});
  EXPECT_FALSE(deleteTrace(folder.path(), name + ".mcap.damaged-3"));
}

TEST(TraceFolder, ANoteIsListedReplacedAndGoesWithItsTrace) {
  const TemporaryFolder folder;
  addFile(folder, "a.mcap", 1, {});
  addFile(folder, "b.mcap.part", 1, {});
  ASSERT_TRUE(noteTrace(folder.path(), "a", "first"));
  ASSERT_TRUE(noteTrace(folder.path(), "a", "participant 7, left hand \u00fc"));
  ASSERT_TRUE(noteTrace(folder.path(), "b", "also while it is written"));
  const auto traces = *listTraces(folder.path());
  ASSERT_EQ(traces.size(), 2U) << "notes are no traces";
  EXPECT_EQ(traces[0].note, "participant 7, left hand \u00fc");
  EXPECT_EQ(noteOf(folder.path() / "b.mcap.part"), "also while it is written");
  ASSERT_TRUE(noteTrace(folder.path(), "b", ""));
  EXPECT_EQ(noteOf(folder.path() / "b.mcap.part"), "");
  EXPECT_FALSE(fs::exists(folder.path() / "b.note"));
  ASSERT_TRUE(deleteTrace(folder.path(), "a"));
  EXPECT_EQ(namesIn(folder).size(), 1U) << "only b is left";
}

TEST(TraceFolder, ANoteIsOneLineOfLimitedLength) {
  const TemporaryFolder folder;
  addFile(folder, "a.mcap", 1, {});
  for (const std::string& text :
       {std::string("two\nlines"), std::string("\033[31m"), std::string(201, 'a')}) {
    EXPECT_FALSE(noteTrace(folder.path(), "a", text)) << text;
  }
  EXPECT_TRUE(noteTrace(folder.path(), "a", std::string(200, 'a')));
  for (const char* name : {"nowhere", "../a", ""}) EXPECT_FALSE(noteTrace(folder.path(), name, "x")) << name;
  folder.write("a.note", std::string(5000, 'x'));
  EXPECT_EQ(noteOf(folder.path() / "a.mcap"), "") << "a file that is no note";
}

TEST(TraceFolder, AMissingFolderIsEmptyAndAFileIsRefused) {
  const TemporaryFolder folder;
  const auto none = listTraces(folder.path() / "nowhere");
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->empty());
  const auto file = listTraces(folder.write("file", ""));
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().text().find("file"), std::string::npos);
}

TEST(TraceFolder, DeletesATraceAndNothingElse) {
  const TemporaryFolder folder;
  addFile(folder, "a.mcap", 1, {});
  addFile(folder, "open.mcap.part", 1, {});
  for (const char* name : {"nowhere", "open", "", "..", "../a", "a/../a"}) {
    const auto refused = deleteTrace(folder.path(), name);
    EXPECT_FALSE(refused) << name;
    EXPECT_FALSE(refused.error().remedy.empty());
  }
  EXPECT_EQ(namesIn(folder).size(), 2U);
  ASSERT_TRUE(deleteTrace(folder.path(), "a"));
  EXPECT_FALSE(fs::exists(folder.path() / "a.mcap"));
  EXPECT_TRUE(fs::exists(folder.path() / "open.mcap.part"));
}

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
}  // namespace hapticd::trace
