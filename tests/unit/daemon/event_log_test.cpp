// SPDX-License-Identifier: Apache-2.0
// The journal's entries about changes that nobody requested.
#include "daemon/journal.h"

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

TEST_F(EventLogTest, LogsThatAFrameIsFoundLostOrJumps) {
  BoxStatus status;
  status.handle.state = drivers::HandlePresence::present;
  const auto look = [&](std::uint64_t losses, std::uint64_t returns, std::uint64_t relocations) {
    status.frames = {{.name = "phantom", .losses = losses, .returns = returns, .relocations = relocations}};
    log.onStatus(status);
  };
  log.onStatus(status);
  entries.clear();
  look(0, 0, 0);
  EXPECT_TRUE(entries.empty());
  look(0, 1, 0);
  look(0, 1, 0);
  look(1, 1, 0);
  look(1, 1, 1);
  look(1, 2, 1);
  ASSERT_EQ(entries.size(), 4U);
  const char* const actions[] = {"found", "lost", "relocated", "found"};
  for (std::size_t i = 0; i < entries.size(); ++i) {
    EXPECT_EQ(entries[i].event, config::EventKind::frame);
    EXPECT_EQ(fields(i)["ACTION"], actions[i]);
    EXPECT_EQ(fields(i)["FRAME"], "phantom");
  }
  EXPECT_EQ(entries[1].priority, JournalEntry::Priority::warning);
}

// A breach of the forbidden region of a fixture.
FixtureConduct breached(const std::string& name, std::uint64_t number, double entered_s) {
  FixtureConduct conduct{.name = name};
  conduct.breach = {.number = number,
                    .entered_ns = static_cast<std::int64_t>(entered_s * 1e9),
                    .entered_m_in_world = {0.01, 0.02, -0.8},
                    .duration_s = 1.5,
                    .depth_m = 0.0034,
                    .entry_m_per_s = 0.12,
                    .speed_m_per_s = 0.34,
                    .force_n = 1.25};
  return conduct;
}

class BreachLogTest : public EventLogTest {
 protected:
  BreachLogTest() {
    status.handle.state = drivers::HandlePresence::present;
    status.loop.state.tick.planned_ns = 1'000'000'000'000;
  }
  void look(std::vector<FixtureConduct> each) {
    status.fixtures.each = std::move(each);
    log.onStatus(status);
  }

  BoxStatus status;
};

TEST_F(BreachLogTest, LogsEachBreachOnceWithAllThatIsMeasured) {
  look({breached("nerve", 0, 0), breached("vein", 0, 0)});
  EXPECT_TRUE(entries.empty());
  look({breached("nerve", 0, 0), breached("vein", 1, 990)});
  look({breached("nerve", 0, 0), breached("vein", 1, 990)});
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_EQ(entries[0].event, config::EventKind::breach);
  EXPECT_EQ(entries[0].priority, JournalEntry::Priority::info);
  EXPECT_EQ(fields(0)["FIXTURE"], "vein");
  EXPECT_EQ(fields(0)["ENTERED_AGE_S"], "10.000");
  EXPECT_EQ(fields(0)["ENTERED_M"], "0.01000 0.02000 -0.80000");
  EXPECT_EQ(fields(0)["DURATION_S"], "1.500");
  EXPECT_EQ(fields(0)["DEPTH_M"], "0.00340");
  EXPECT_EQ(fields(0)["ENTRY_SPEED_M_PER_S"], "0.1200");
  EXPECT_EQ(fields(0)["SPEED_M_PER_S"], "0.3400");
  EXPECT_EQ(fields(0)["FORCE_N"], "1.250");
  look({breached("nerve", 1, 992), breached("vein", 2, 995)});
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(fields(1)["FIXTURE"], "nerve");
  EXPECT_EQ(fields(2)["FIXTURE"], "vein");
}

TEST_F(BreachLogTest, TakesAChangedSetForNoBreachAndMissesNone) {
  look({breached("nerve", 1, 990), breached("vein", 4, 991)});
  ASSERT_EQ(entries.size(), 2U);
  look({});                                                     // until the loop has taken over the change
  look({breached("vein", 4, 991), breached("nerve", 1, 990)});  // in another order
  look({breached("vein", 4, 991)});
  look({breached("vein", 4, 991), breached("nerve", 0, 0)});  // added again: counts anew
  EXPECT_EQ(entries.size(), 2U);
  look({breached("vein", 4, 991), breached("nerve", 1, 997)});  // the same number as before
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(fields(2)["FIXTURE"], "nerve");
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
