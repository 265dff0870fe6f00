// SPDX-License-Identifier: Apache-2.0
// The limit of the folder of traces: what is deleted, what is reported, and when recording ends.
#include "daemon/recorder/retention.h"

#include <gtest/gtest.h>

#include <memory>

#include "daemon/trace/writer/trace_writer.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using daemon::Retention;

class RetentionTest : public testing::Test {
 protected:
  /// A finished trace of so many megabytes, without content.
  void add(const std::string& name, double mb, const char* ending = ".mcap") const {
    const fs::path file = folder.write(name + ending, "");
    fs::resize_file(file, static_cast<std::uintmax_t>(mb * 1e6));
  }
  /// Names without the hour: "05-06-07Z-NAME" for trace number 7.
  static std::string numbered(int number) { return "2026-03-04T05-06-0" + std::to_string(number) + "Z"; }
  bool has(const std::string& name) const { return fs::exists(folder.path() / (name + ".mcap")); }

  void start(double max_folder_mb) {
    config::TraceSettings settings;
    settings.max_folder_mb = max_folder_mb;
    settings.max_file_mb = 1000;
    retention = std::make_unique<Retention>(
        folder.path(), settings,
        [this](const std::string& name, const std::string& reason) { deleted.emplace_back(name, reason); });
    ASSERT_TRUE(retention->start());
    EXPECT_TRUE(becomesTrue([&] { return retention->status().folder_bytes > 0; }));
  }
  /// All problems of the status in one text.
  std::string problems() const {
    std::string text;
    for (const std::string& problem : retention->status().problems) text += problem + "\n";
    return text;
  }

  TemporaryFolder folder;
  std::vector<std::pair<std::string, std::string>> deleted;  // read after stop()
  std::unique_ptr<Retention> retention;
};

TEST_F(RetentionTest, WithoutALimitNothingIsEverDeleted) {
  for (int i = 1; i <= 5; ++i) add(numbered(i), 30'000);  // sparse
  start(config::TraceSettings().max_folder_mb);
  retention->requestListAfter(numbered(5));
  ASSERT_TRUE(becomesTrue([&] { return retention->status().folder_bytes == 150'000'000'000U; }));
  retention->stop();
  EXPECT_TRUE(deleted.empty());
  EXPECT_EQ(retention->status().limit_bytes, std::nullopt);
  EXPECT_EQ(retention->status().next, "");
  EXPECT_TRUE(retention->mayBegin() && retention->mayGoOn());
  EXPECT_EQ(retention->mostFileBytes(), 1'000'000'000U);
}

TEST_F(RetentionTest, DeletesTheOldestDownToTheLimitAndReportsEachWithItsReason) {
  for (int i = 1; i <= 6; ++i) add(numbered(i), 10);
  start(35);
  ASSERT_TRUE(becomesTrue([&] { return retention->status().deleted == 3; }));
  retention->stop();
  for (int i = 1; i <= 6; ++i) EXPECT_EQ(has(numbered(i)), i > 3) << i;
  ASSERT_EQ(deleted.size(), 3U);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(deleted[static_cast<std::size_t>(i)].first, numbered(i + 1));
    EXPECT_NE(deleted[static_cast<std::size_t>(i)].second.find("trace.max_folder_mb"), std::string::npos);
  }
  EXPECT_EQ(retention->status().folder_bytes, 30'000'000U);
  EXPECT_EQ(retention->status().next, numbered(4));
}

/// A box without a battery for its clock begins in 1970, or wherever its system has left the time.
TEST_F(RetentionTest, TheOldestTraceIsTheOneThatBeganFirstWhateverTheClockSaid) {
  const std::vector<std::string> names{numbered(1), numbered(2), "1970-01-01T00-00-09Z", numbered(0),
                                       "1970-01-01T00-00-08Z"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const fs::path file = folder.path() / (names[i] + ".mcap");
    auto writer = trace::TraceWriter::create(file, {.number = 9 + i});  // of one and of two digits
    ASSERT_TRUE(writer && (*writer)->close());
    fs::resize_file(file, 10'000'000);
  }
  add("2026-03-04T05-06-09Z-without-number", 10);
  start(25);
  ASSERT_TRUE(becomesTrue([&] { return retention->status().deleted == 4; }));
  retention->stop();
  std::vector<std::string> gone;
  for (const auto& [name, reason] : deleted) gone.push_back(name);
  EXPECT_EQ(gone,
            (std::vector<std::string>{"2026-03-04T05-06-09Z-without-number", names[0], names[1], names[2]}));
}

TEST_F(RetentionTest, SaysBeforehandWhatGoesNext) {
  for (int i = 1; i <= 3; ++i) add(numbered(i), 10);
  start(100);
  EXPECT_EQ(retention->status().limit_bytes, 100'000'000U);
  EXPECT_EQ(problems(), "") << "30 of 100 MB, and a trace takes 25 MB at most";
  add(numbered(4), 50);
  retention->requestListAfter(numbered(4));
  ASSERT_TRUE(becomesTrue([&] { return !retention->status().problems.empty(); }));
  EXPECT_NE(problems().find("80.0 MB of the 100.0 MB"), std::string::npos) << problems();
  EXPECT_NE(problems().find(numbered(1) + " is deleted next (hapticctl trace keep"), std::string::npos);
  EXPECT_EQ(retention->status().next, numbered(1));
  EXPECT_EQ(retention->status().deleted, 0U);
}

TEST_F(RetentionTest, WhereOnlyProtectedTracesAreLeftRecordingStopsWithThatReason) {
  add(numbered(1), 40);
  folder.write(numbered(1) + ".keep", "");
  add(numbered(2) + "-fault", 30);
  add(numbered(3), 20);
  add(numbered(4), 20);  // the newest: stays too
  start(100);
  ASSERT_TRUE(becomesTrue([&] { return retention->status().deleted == 1; })) << "of 110 MB only 3 may go";
  EXPECT_FALSE(has(numbered(3)));
  EXPECT_TRUE(has(numbered(1)) && has(numbered(2) + "-fault") && has(numbered(4)));
  ASSERT_TRUE(becomesTrue([&] { return retention->mayBegin().has_value(); })) << "90 MB";
  add(numbered(5), 5, ".mcap.part");
  retention->requestList();
  ASSERT_TRUE(becomesTrue([&] { return !retention->mayBegin(); })) << "95 MB";
  EXPECT_TRUE(retention->mayGoOn());
  const std::string reason = retention->mayBegin().error().text();
  EXPECT_NE(reason.find("1 traces marked to be kept, 1 of the flight recorder"), std::string::npos) << reason;
  EXPECT_NE(reason.find("trace keep --undo"), std::string::npos) << reason;
  add(numbered(5), 15, ".mcap.part");
  retention->requestList();
  ASSERT_TRUE(becomesTrue([&] { return !retention->mayGoOn(); })) << "105 MB";
  fs::remove(folder.path() / (numbered(1) + ".keep"));  // now it is the oldest that may go
  retention->requestList();
  ASSERT_TRUE(becomesTrue([&] { return retention->mayGoOn() && retention->mayBegin(); }));
  EXPECT_FALSE(has(numbered(1)));
}

TEST_F(RetentionTest, AFileIsAtMostAQuarterOfTheLimit) {
  add(numbered(1), 1);
  start(20);
  EXPECT_EQ(retention->mostFileBytes(), 5'000'000U);
}

}  // namespace
}  // namespace hapticd::test
