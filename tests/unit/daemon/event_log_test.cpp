// SPDX-License-Identifier: Apache-2.0
// The journal's entries about changes that nobody requested.
#include "daemon/event_log.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace hapticd::daemon {
namespace {

using std::chrono::milliseconds;

class EventLogTest : public testing::Test {
 protected:
  void tick(rt::Mode mode, rt::Cause cause = rt::Cause::requested) {
    rt::Tick tick;
    tick.mode = mode;
    tick.cause = cause;
    log.onTick(tick, now);
  }

  std::map<std::string_view, std::string> fields(std::size_t index) const {
    return {entries.at(index).fields.begin(), entries.at(index).fields.end()};
  }

  std::vector<JournalEntry> entries;
  EventLog log{[this](const JournalEntry& entry) { entries.push_back(entry); }};
  EventLog::Clock::time_point now{std::chrono::hours(1)};
};

TEST_F(EventLogTest, LogsAChangeOfModeOnceWithItsCause) {
  tick(rt::Mode::idle);
  tick(rt::Mode::idle);
  tick(rt::Mode::holding, rt::Cause::depth_stale);
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(fields(1)["MODE"], "holding");
  EXPECT_EQ(fields(1)["CAUSE"], "depth_stale");
  EXPECT_EQ(entries[0].priority, JournalEntry::Priority::notice);
  EXPECT_EQ(entries[1].priority, JournalEntry::Priority::warning);
}

TEST_F(EventLogTest, LogsAFaultAsAnError) {
  tick(rt::Mode::faulted, rt::Cause::force_not_finite);
  EXPECT_EQ(entries.at(0).priority, JournalEntry::Priority::error);
}

TEST_F(EventLogTest, LogsTenChangesOfModeASecondAndCountsTheOthers) {
  for (int change = 0; change < 35; ++change) tick(change % 2 == 0 ? rt::Mode::holding : rt::Mode::engaged);
  EXPECT_EQ(entries.size(), 10U);
  now += milliseconds(1001);
  tick(rt::Mode::idle);
  ASSERT_EQ(entries.size(), 12U);
  EXPECT_NE(entries[10].text.find("25 changes of mode"), std::string::npos) << entries[10].text;
  EXPECT_EQ(fields(11)["MODE"], "idle");
}

TEST_F(EventLogTest, LogsThatTheCameraComesAndGoesWithTheReason) {
  BoxStatus status;
  status.camera.identity = "freenect A1";
  status.handle.state = drivers::HandlePresence::present;
  log.onStatus(status);
  EXPECT_TRUE(entries.empty());
  status.camera.state = drivers::CameraState::streaming;
  log.onStatus(status);
  status.camera.state = drivers::CameraState::lost;
  status.camera.detail = "unplugged";
  log.onStatus(status);
  log.onStatus(status);
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].text, "camera streaming (freenect A1)");
  EXPECT_EQ(entries[1].text, "camera lost (freenect A1): unplugged");
  EXPECT_EQ(fields(1)["CAMERA"], "lost");
}

TEST_F(EventLogTest, LogsAWarningWhenItAppearsAndNotWhenOnlyItsNumbersChange) {
  BoxStatus status;
  status.handle.state = drivers::HandlePresence::present;
  for (const char* warning : {"7 points did not fit", "8 points did not fit"}) {
    status.warnings = {warning};
    log.onStatus(status);
  }
  EXPECT_EQ(entries.size(), 1U);
  EXPECT_EQ(fields(0)["STATE"], "begin");
  status.warnings.clear();
  log.onStatus(status);
  status.warnings = {"9 points did not fit"};
  log.onStatus(status);
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[2].text, "9 points did not fit");
}

TEST_F(EventLogTest, LogsThatAWarningHasEnded) {
  BoxStatus status;
  status.handle.state = drivers::HandlePresence::present;
  status.warnings = {"7 points did not fit", "camera: two found"};
  log.onStatus(status);
  status.warnings = {"camera: two found"};
  log.onStatus(status);
  log.onStatus(status);
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[2].text, "resolved: 7 points did not fit");
  EXPECT_EQ(entries[2].event, config::EventKind::warning);
  EXPECT_EQ(fields(2), (std::map<std::string_view, std::string>{{"STATE", "end"}}));
}

TEST_F(EventLogTest, LogsThatTheHandleGoesAndComes) {
  BoxStatus status;
  status.handle.identity = "simulated";
  status.handle.state = drivers::HandlePresence::lost;
  log.onStatus(status);
  status.handle.state = drivers::HandlePresence::present;
  log.onStatus(status);
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].text, "handle lost (simulated)");
  EXPECT_EQ(entries[1].text, "handle present (simulated)");
}

TEST_F(EventLogTest, LogsEachDeletedAndEachLostTraceOnceByItsName) {
  BoxStatus status;
  status.camera.state = drivers::CameraState::absent;
  log.onStatus(status);
  const std::size_t before = entries.size();
  status.trace.news = {{1, false, "delete", "old", "trace old was deleted: why"}};
  log.onStatus(status);
  log.onStatus(status);
  status.trace.news.push_back({2, true, "lose", "short", "trace short was cut off"});
  log.onStatus(status);
  ASSERT_EQ(entries.size(), before + 2);
  EXPECT_EQ(entries[before].text, "trace old was deleted: why");
  EXPECT_EQ(fields(before)["TRACE"], "old");
  EXPECT_EQ(fields(before)["ACTION"], "delete");
  EXPECT_EQ(entries[before].priority, JournalEntry::Priority::notice);
  EXPECT_EQ(fields(before + 1)["TRACE"], "short");
  EXPECT_EQ(entries[before + 1].priority, JournalEntry::Priority::warning);
}

}  // namespace
}  // namespace hapticd::daemon
