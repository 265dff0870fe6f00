// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/trace_session.h"

#include <gtest/gtest.h>

#include "daemon/trace/reader/trace_folder.h"
#include "daemon/trace/writer/trace_writer.h"
#include "rt/base/clock.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using daemon::TraceNumbers;
using trace::WallClock;

constexpr std::int64_t kDay_ns = 86'400 * rt::kNsPerSecond;
constexpr std::int64_t kToday_ns = 1'790'000'000 * rt::kNsPerSecond;  // in 2026

WallClock clockAt(std::int64_t time_ns, bool synchronised = false) {
  return {.realtime_ns = time_ns, .synchronised = synchronised, .kept_by_battery = true};
}

class TraceNumbersTest : public testing::Test {
 protected:
  void addTrace(const std::string& name, const trace::TraceOptions& options) const {
    fs::create_directories(folder.path() / "traces");
    auto writer = trace::TraceWriter::create(folder.path() / "traces" / (name + ".mcap"), options);
    ASSERT_TRUE(writer && (*writer)->close());
  }
  TraceNumbers::Next next(const WallClock& clock) const { return TraceNumbers(folder.path()).next(clock); }

  const TemporaryFolder folder;
};

TEST_F(TraceNumbersTest, CountOnFromOneStartToTheNext) {
  TraceNumbers numbers(folder.path());
  EXPECT_EQ(numbers.next(clockAt(kToday_ns)).number, 1U);
  EXPECT_EQ(numbers.next(clockAt(kToday_ns)).number, 2U);
  EXPECT_EQ(next(clockAt(0)).number, 3U);
  EXPECT_EQ(next(clockAt(kToday_ns)).number, 4U);
}

TEST_F(TraceNumbersTest, GoOnFromTheTracesWhereTheCountIsLost) {
  addTrace("a", {.number = 41});
  addTrace("b", {.number = 7});
  addTrace("c", {});
  for (const char* damaged : {"", "traces: {number: 3", "traces: {number: -1, latest_ns: 0}",
                              "traces: {number: 3}", "\xff", "number: 3"}) {
    folder.write("trace_count.yaml", damaged);
    EXPECT_EQ(next(clockAt(kToday_ns)).number, 42U) << damaged;
  }
  fs::remove(folder.path() / "trace_count.yaml");
  EXPECT_EQ(next(clockAt(kToday_ns)).number, 42U);
  EXPECT_EQ(next(clockAt(kToday_ns)).number, 43U) << "from the file, although there is no trace 42";
}

TEST_F(TraceNumbersTest, AClockThatIsBehindTheLastTraceIsNotSet) {
  EXPECT_TRUE(next(clockAt(kToday_ns)).clock_is_set);
  EXPECT_FALSE(next(clockAt(kToday_ns - kDay_ns)).clock_is_set);
  EXPECT_FALSE(next(clockAt(0)).clock_is_set);
  EXPECT_TRUE(next(clockAt(kToday_ns + 1)).clock_is_set);
  EXPECT_TRUE(next(clockAt(kToday_ns - kDay_ns, true)).clock_is_set) << "the network knows better";
  EXPECT_TRUE(next(clockAt(kToday_ns - kDay_ns + 1)).clock_is_set) << "from then on";
}

TEST_F(TraceNumbersTest, TimesOfTracesWhoseClockWasNotSetDoNotCount) {
  addTrace("2026-09-21T13-33-20Z", {.clock_is_set = true, .number = 1});
  addTrace("2099-01-01T00-00-00Z", {.clock_is_set = false, .number = 2});
  EXPECT_TRUE(next(clockAt(kToday_ns)).clock_is_set);
}

TEST_F(TraceNumbersTest, WhereTheCountCannotBeKeptTheTracesTellIt) {
  folder.write("trace_count.yaml", "traces: {number: 3, latest_ns: 0}");
  addTrace("a", {.number = 41});
  fs::create_directory(folder.path() / "trace_count.yaml.new");  // in the way of the temporary file
  TraceNumbers numbers(folder.path());
  EXPECT_EQ(numbers.next(clockAt(kToday_ns)).number, 42U);
  EXPECT_EQ(numbers.next(clockAt(kToday_ns)).number, 43U);
}

TEST(WallClockTest, IsSetWhereTheNetworkOrABatteryKeepsIt) {
  const WallClock kept{.realtime_ns = kToday_ns, .synchronised = false, .kept_by_battery = true};
  const WallClock synchronised{.realtime_ns = kToday_ns, .synchronised = true, .kept_by_battery = false};
  const WallClock neither{.realtime_ns = kToday_ns, .synchronised = false, .kept_by_battery = false};
  EXPECT_TRUE(kept.isSet(0) && kept.isSet(kToday_ns));
  EXPECT_FALSE(kept.isSet(kToday_ns + 1));
  EXPECT_TRUE(synchronised.isSet(kToday_ns + kDay_ns));
  EXPECT_FALSE(neither.isSet(0));
  for (const std::int64_t past_ns : {std::int64_t{0}, 1'700'000'000 * rt::kNsPerSecond}) {
    EXPECT_FALSE((WallClock{past_ns, true, true}.isSet(0))) << past_ns;
  }
}

TEST(WallClockTest, ReadsWhetherTheKernelTookTheTimeFromADevice) {
  const TemporaryFolder root;
  fs::create_directories(root.path() / "sys/class/rtc/rtc0");
  fs::create_directories(root.path() / "sys/class/rtc/rtc1");
#if !defined(__x86_64__)
  EXPECT_FALSE(WallClock::read(root.path()).kept_by_battery);
  root.write("sys/class/rtc/rtc0/hctosys", "0\n");
  EXPECT_FALSE(WallClock::read(root.path()).kept_by_battery);
#endif
  root.write("sys/class/rtc/rtc1/hctosys", "1\n");
  EXPECT_TRUE(WallClock::read(root.path()).kept_by_battery);
  EXPECT_GT(WallClock::read(root.path()).realtime_ns, kToday_ns - 365 * kDay_ns);
}

}  // namespace
}  // namespace hapticd::test
