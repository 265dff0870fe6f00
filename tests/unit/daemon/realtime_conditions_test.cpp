// SPDX-License-Identifier: Apache-2.0
// What hapticd finds out about the CPUs and its own threads: which CPU is kept free, page faults, a loop that
// is late.

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>

#include "daemon/box_warnings.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

TEST(IsolatedCpu, IsTheLastOneOfTheKernelsList) {
  test::TemporaryFolder folder;
  EXPECT_EQ(lastIsolatedCpu(folder.write("several", "1,4-7,12\n")), 12);
}

TEST(IsolatedCpu, IsNoneWhereNoneIsKeptFreeOrTheKernelDoesNotSay) {
  test::TemporaryFolder folder;
  EXPECT_EQ(lastIsolatedCpu(folder.write("none", "\n")), -1);
  EXPECT_EQ(lastIsolatedCpu(folder.write("odd", "all\n")), -1);
  EXPECT_EQ(lastIsolatedCpu(folder.path() / "absent"), -1);
}

TEST(IsolatedCpu, IsOneOfTheKernelsList) {
  test::TemporaryFolder folder;
  const auto file = folder.write("several", "1,4-7,12\n");
  for (const int cpu : {1, 4, 5, 7, 12}) EXPECT_TRUE(isIsolated(cpu, file)) << cpu;
  for (const int cpu : {-1, 0, 2, 3, 8, 11, 13}) EXPECT_FALSE(isIsolated(cpu, file)) << cpu;
  EXPECT_FALSE(isIsolated(0, folder.write("none", "\n")));
  EXPECT_FALSE(isIsolated(0, folder.path() / "absent"));
}

TEST(ThreadFaults, CountThePagesThatTheThreadTouchesForTheFirstTime) {
  constexpr std::size_t kPages = 200;
  const auto page_size = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  auto* const pages = static_cast<volatile char*>(
      ::mmap(nullptr, kPages * page_size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  ASSERT_NE(pages, MAP_FAILED);
  ::madvise(const_cast<char*>(pages), kPages * page_size, MADV_NOHUGEPAGE);
  const auto before = pageFaultsOf(::gettid());
  for (std::size_t page = 0; page < kPages; ++page) pages[page * page_size] = 1;
  const auto after = pageFaultsOf(::gettid());
  ::munmap(const_cast<char*>(pages), kPages * page_size);
  ASSERT_TRUE(before && after);
  EXPECT_GE(*after - *before, kPages);
}

TEST(ThreadFaults, AreUnknownOfAThreadThatIsNotThere) {
  EXPECT_FALSE(pageFaultsOf(0));
}

// When a force loop counts as late, and that this ends.

/// A loop of 1 kHz, second by second.
class LatenessWatchTest : public testing::Test {
 protected:
  LatenessWatchTest() { watch_.follow(counters_, time_ns_); }

  /// Seconds in each of which so many ticks end late and so many periods are skipped.
  void run(int seconds, std::uint64_t late_ticks = 0, std::uint64_t skipped = 0) {
    for (int second = 0; second < seconds; ++second) {
      counters_.ticks += 1000 - skipped;
      counters_.overruns += late_ticks;
      counters_.skipped_periods += skipped;
      time_ns_ += 1'000'000'000;
      watch_.follow(counters_, time_ns_);
    }
  }
  bool late() const { return watch_.lateness().late; }

  LatenessWatch watch_;
  rt::LoopCounters counters_;
  std::int64_t time_ns_ = 5'000'000'000;
};

TEST_F(LatenessWatchTest, KeepsQuietAboutALoopThatKeepsTime) {
  EXPECT_FALSE(late());
  run(600);
  EXPECT_FALSE(late());
}

TEST_F(LatenessWatchTest, ForgivesTheColdTicksOfTheStart) {
  run(1, 3);
  EXPECT_FALSE(late());
  run(1, 1);
  EXPECT_TRUE(late());
}

TEST_F(LatenessWatchTest, KnowsMoreThanOneLateTickInTenThousand) {
  run(60);
  run(1, 6);
  EXPECT_FALSE(late()) << "6 of 60 000";
  run(1, 1);
  EXPECT_TRUE(late()) << "7 of 60 000";
}

TEST_F(LatenessWatchTest, KnowsASecondInWhichPeriodsWereSkipped) {
  run(10, 0, 5);
  EXPECT_FALSE(late());
  run(1, 0, 6);
  EXPECT_TRUE(late());
}

// The warning stood for ever when it was judged by the counts since the start.
TEST_F(LatenessWatchTest, EndsAMinuteAfterTheLastLateTick) {
  run(120, 50, 20);
  EXPECT_TRUE(late());
  run(59);
  EXPECT_TRUE(late());
  run(2);
  EXPECT_FALSE(late());
  EXPECT_EQ(watch_.lateness().late_ticks, 0U);
}

TEST_F(LatenessWatchTest, CountsWithinTheLastMinuteHoweverOftenItIsCalled) {
  run(300);
  for (int i = 0; i < 900; ++i) {
    counters_.ticks += 66;
    time_ns_ += 66'000'000;
    watch_.follow(counters_, time_ns_);
  }
  EXPECT_NEAR(static_cast<double>(watch_.lateness().ticks), 60'000, 1'100) << "a minute and up to a second";
}

}  // namespace
}  // namespace hapticd::daemon
