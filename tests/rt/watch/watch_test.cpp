// SPDX-License-Identifier: Apache-2.0
#include "tests/rt/watch/watch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/support/rerun.h"

// Deliberate violations of the force thread's rules; the monitor used by other tests must detect each of
// them.

namespace hapticd::test {
namespace {

template <typename Deed>
WatchedSection::Seen watched(Deed deed) {
  WatchedSection section;
  deed();
  return section.end();
}

/// Hides from the compiler that nobody else uses the memory, so that it does not optimise allocation and
/// release away.
template <typename T>
T* used(T* memory) {
  static std::atomic<T*> somewhere;
  somewhere.store(memory, std::memory_order_relaxed);
  return somewhere.load(std::memory_order_relaxed);
}

TEST(Watch, SeesNothingWhereNothingIsDone) {
  int sum = 0;
  const WatchedSection::Seen seen = watched([&sum] {
    for (int i = 0; i < 1'000; ++i) sum += i;
  });
  EXPECT_EQ(seen.misconduct, Misconduct{});
  EXPECT_EQ(sum, 499'500);
}

TEST(Watch, SeesEachKindOfAllocationAndRelease) {
  ASSERT_TRUE(kSight.allocations);
  const auto seen = [](auto deed) { return watched(deed).misconduct.allocations; };
  EXPECT_EQ(seen([] { std::free(used(std::malloc(10))); }), 2U);
  EXPECT_EQ(seen([] { std::free(used(std::calloc(10, 10))); }), 2U);
  EXPECT_EQ(seen([] { delete used(new int(1)); }), 2U);
  EXPECT_EQ(seen([] { used(std::make_unique<double[]>(100).get()); }), 2U);
  std::vector<int> numbers;
  EXPECT_EQ(seen([&numbers] { numbers.push_back(1); }), 1U);
  EXPECT_EQ(seen([&numbers] { std::vector<int>().swap(numbers); }), 1U);
}

TEST(Watch, SeesAlignedAllocations) {
  if (!kSight.aligned_allocations) {
    return reportNotChecked("aligned allocations, which this sanitizer may not report");
  }
  EXPECT_EQ(watched([] { std::free(used(std::aligned_alloc(64, 64))); }).misconduct.allocations, 2U);
}

TEST(Watch, SeesNothingOfOtherThreads) {
  std::vector<int> numbers;
  std::atomic<bool> begin{false};
  std::atomic<bool> done{false};
  std::thread other([&] {
    while (!begin.load()) std::this_thread::yield();
    numbers.resize(1'000);
    done.store(true);
  });
  const WatchedSection::Seen seen = watched([&] {
    begin.store(true);
    while (!done.load()) std::this_thread::yield();
  });
  other.join();
  EXPECT_EQ(seen.misconduct, Misconduct{});
}

TEST(Watch, SeesEachKindOfLock) {
  if (!kSight.locks) return reportNotChecked(kSight.said_instead);
  std::mutex mutex;
  std::recursive_mutex recursive;
  std::shared_mutex shared;
  EXPECT_EQ(watched([&] { const std::lock_guard lock(mutex); }).misconduct.locks, 1U);
  EXPECT_EQ(watched([&] { const std::lock_guard lock(recursive); }).misconduct.locks, 1U);
  EXPECT_EQ(watched([&] { const std::unique_lock lock(mutex, std::try_to_lock); }).misconduct.locks, 1U);
  EXPECT_EQ(watched([&] { const std::shared_lock lock(shared); }).misconduct.locks, 1U);
  EXPECT_EQ(watched([&] { const std::unique_lock lock(shared); }).misconduct.locks, 1U);
}

TEST(Watch, SeesExceptionsOfThisProgramAndOfItsLibraries) {
  if (!kSight.exceptions) return reportNotChecked(kSight.said_instead);
  const auto exceptions = [](auto deed) {
    return watched([&deed] {
             try {
               deed();
             } catch (const std::exception&) {
             }
           })
        .misconduct.exceptions;
  };
  EXPECT_EQ(exceptions([] { throw std::runtime_error("planted"); }), 1U);
  const std::vector<int> empty;
  EXPECT_EQ(exceptions([&empty] { return empty.at(1); }), 1U);
}

TEST(Watch, SeesAPageFault) {
  for (const bool with_locked_memory : {false, true}) {
    std::unique_ptr<LockedMemory> memory;
    if (with_locked_memory) memory = std::make_unique<LockedMemory>();
    UntouchedPage page;
    EXPECT_GE(watched([&page] { page.touch(); }).page_faults.minor, 1);
    EXPECT_EQ(watched([&page] { page.touch(); }).page_faults.major, 0);
  }
}

}  // namespace
}  // namespace hapticd::test
