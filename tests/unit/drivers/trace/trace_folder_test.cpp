#include "drivers/trace/trace_folder.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "drivers/trace/trace_writer.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr std::int64_t kTime_ns = 1'772'600'767'999'999'999;  // 2026-03-04T05:06:07.999999999Z

/// A file of `bytes` bytes that was changed `age` ago.
void addFile(const TemporaryFolder& folder, const std::string& name, std::size_t bytes,
             std::chrono::hours age) {
  const fs::path file = folder.write(name, std::string(bytes, 'x'));
  fs::last_write_time(file, fs::file_time_type::clock::now() - age);
}

void addDepth(const TemporaryFolder& folder, const std::string& name, std::size_t bytes) {
  fs::create_directory(folder.path() / (name + ".depth"));
  folder.write(name + ".depth/INDEX.txt", std::string(bytes, 'x'));
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
  addDepth(folder, plain + "-3", 1);
  EXPECT_EQ(newTraceName(folder.path(), kTime_ns, ""), plain + "-4");
}

TEST(TraceFolder, ListsTheOldestFirstWithTheirDepth) {
  const TemporaryFolder folder;
  addFile(folder, "new.mcap", 10, std::chrono::hours(1));
  addFile(folder, "old.mcap", 20, std::chrono::hours(3));
  addFile(folder, "open.mcap.part", 30, std::chrono::hours(2));
  addFile(folder, "notes.txt", 40, std::chrono::hours(4));
  fs::create_directory(folder.path() / "folder.mcap");
  addDepth(folder, "old", 1000);
  const auto traces = listTraces(folder.path());
  ASSERT_TRUE(traces) << traces.error().text();
  ASSERT_EQ(namesIn(folder), (std::vector<std::string>{"old", "open", "new"}));
  EXPECT_EQ((*traces)[0].bytes, 1020U);
  EXPECT_TRUE((*traces)[0].depth);
  EXPECT_FALSE((*traces)[0].open);
  EXPECT_EQ((*traces)[1].bytes, 30U);
  EXPECT_TRUE((*traces)[1].open);
  EXPECT_FALSE((*traces)[1].depth);
  EXPECT_LT((*traces)[0].time_ns, (*traces)[1].time_ns);
}

TEST(TraceFolder, SaysWhichTracesHaveTheirDepthInside) {
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

TEST(TraceFolder, AFolderThatIsNotThereIsEmptyAndAFileIsNone) {
  const TemporaryFolder folder;
  const auto none = listTraces(folder.path() / "nowhere");
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->empty());
  const auto file = listTraces(folder.write("file", ""));
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().text().find("file"), std::string::npos);
}

TEST(TraceFolder, DeletesATraceWithItsDepthAndNothingElse) {
  const TemporaryFolder folder;
  addFile(folder, "a.mcap", 1, {});
  addDepth(folder, "a", 1);
  addFile(folder, "open.mcap.part", 1, {});
  for (const char* name : {"nowhere", "open", "", "..", "../a", "a/../a"}) {
    const auto refused = deleteTrace(folder.path(), name);
    EXPECT_FALSE(refused) << name;
    EXPECT_FALSE(refused.error().remedy.empty());
  }
  EXPECT_EQ(namesIn(folder).size(), 2U);
  ASSERT_TRUE(deleteTrace(folder.path(), "a"));
  EXPECT_FALSE(fs::exists(folder.path() / "a.mcap"));
  EXPECT_FALSE(fs::exists(folder.path() / "a.depth"));
  EXPECT_TRUE(fs::exists(folder.path() / "open.mcap.part"));
}

TEST(TraceFolder, MakesRoomByDeletingTheOldestFinishedTraces) {
  const TemporaryFolder folder;
  addFile(folder, "open.mcap.part", 100, std::chrono::hours(9));
  for (int age = 1; age <= 4; ++age) {
    addFile(folder, "t" + std::to_string(age) + ".mcap", 100, std::chrono::hours(age));
  }
  addDepth(folder, "t4", 100);
  ASSERT_TRUE(limitFolder(folder.path(), 600)->empty());  // that much it has
  const auto deleted = limitFolder(folder.path(), 399);
  ASSERT_TRUE(deleted) << deleted.error().text();
  EXPECT_EQ(*deleted, (std::vector<std::string>{"t4", "t3"}));  // 600 - 200 = 400 is one too many
  EXPECT_EQ(limitFolder(folder.path(), 0)->size(), 2U);
  EXPECT_EQ(namesIn(folder), std::vector<std::string>{"open"});
}

}  // namespace
}  // namespace hapticd::drivers
