// SPDX-License-Identifier: Apache-2.0
#include "rt/base/latency_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <latch>
#include <random>
#include <thread>
#include <vector>

#include "tests/support/sanitizer.h"

namespace hapticd::test {
namespace {

/// There are sixteen buckets per power of two: the width of a bucket is at most a sixteenth of its lower end,
/// and its upper end is reported.
constexpr double kRelativeResolution = 1.0 / 16;
/// Longer durations count as this one.
constexpr std::int64_t kMax_ns = (std::int64_t{1} << 32) - 1;

constexpr double kQuantiles[] = {0.0, 0.001, 0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999, 0.99999, 1.0};

/// Returns the smallest duration such that at least the fraction `quantile` of all durations is not longer.
std::int64_t exactQuantile(const std::vector<std::int64_t>& sorted, double quantile) {
  const double rank = std::ceil(quantile * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

void expectQuantilesOf(std::vector<std::int64_t> durations_ns) {
  rt::LatencyHistogram histogram;
  for (const std::int64_t duration : durations_ns) histogram.add(duration);
  std::sort(durations_ns.begin(), durations_ns.end());
  EXPECT_EQ(histogram.total(), durations_ns.size());
  EXPECT_EQ(histogram.maxNs(), static_cast<std::uint64_t>(std::max<std::int64_t>(durations_ns.back(), 0)));
  for (const double quantile : kQuantiles) {
    const auto exact =
        static_cast<double>(std::clamp<std::int64_t>(exactQuantile(durations_ns, quantile), 0, kMax_ns));
    const auto reported = static_cast<double>(histogram.quantileNs(quantile));
    EXPECT_GE(reported, exact) << "quantile " << quantile;
    EXPECT_LE(reported, exact * (1 + kRelativeResolution)) << "quantile " << quantile;
  }
}

std::vector<std::int64_t> logarithmicallySpread(std::size_t count) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(0, 31.9);
  std::vector<std::int64_t> durations;
  for (std::size_t i = 0; i < count; ++i) {
    durations.push_back(static_cast<std::int64_t>(std::exp2(exponent(random))));
  }
  return durations;
}

TEST(LatencyHistogram, IsEmptyAtFirst) {
  const rt::LatencyHistogram histogram;
  EXPECT_EQ(histogram.total(), 0U);
  EXPECT_EQ(histogram.maxNs(), 0U);
  EXPECT_EQ(histogram.quantileNs(0.5), 0U);
}

TEST(LatencyHistogram, ReportsQuantilesOfAllScalesWithinASixteenth) {
  expectQuantilesOf(logarithmicallySpread(100'000));
}

TEST(LatencyHistogram, ReportsQuantilesOfFewDurationsWithinASixteenth) {
  for (std::size_t count = 1; count <= 20; ++count) expectQuantilesOf(logarithmicallySpread(count));
}

TEST(LatencyHistogram, ReportsTheEndsOfEveryBucketWithinASixteenth) {
  for (int power = 0; power < 32; ++power) {
    for (std::int64_t sixteenth = 16; sixteenth <= 32; ++sixteenth) {
      const std::int64_t bound = (sixteenth << power) / 16;
      for (const std::int64_t duration : {bound - 1, bound, bound + 1}) expectQuantilesOf({duration});
    }
  }
}

TEST(LatencyHistogram, ReportsALoneSpikeAmongManyShortDurations) {
  std::vector<std::int64_t> durations(99'999, 5'000);
  durations.push_back(1'234'567);
  expectQuantilesOf(durations);
}

TEST(LatencyHistogram, IsExactBelow32Nanoseconds) {
  for (std::int64_t duration = 0; duration < 32; ++duration) {
    rt::LatencyHistogram histogram;
    histogram.add(duration);
    histogram.add(1'000'000);  // so that the maximum is not what is reported
    EXPECT_EQ(histogram.quantileNs(0.5), static_cast<std::uint64_t>(duration));
  }
}

TEST(LatencyHistogram, CountsNegativeDurationsAsZeroAndVeryLongOnesAsTheLongest) {
  expectQuantilesOf({-1, INT64_MIN, -1'000'000});
  expectQuantilesOf({kMax_ns, kMax_ns + 1, INT64_MAX});
}

/// Checks what a reader may see at any moment while `durations` are being added.
void watch(const rt::LatencyHistogram& histogram, std::size_t all, std::uint64_t longest,
           std::atomic<int>& wrong) {
  std::uint64_t last_total = 0;
  std::uint64_t last_max = 0;
  while (last_total < all) {
    const std::uint64_t total = histogram.total();
    const std::uint64_t max = histogram.maxNs();
    const std::uint64_t median = histogram.quantileNs(0.5);
    const bool fine = total >= last_total && total <= all && max >= last_max && max <= longest &&
                      median <= longest && histogram.quantileNs(1.0) <= longest;
    if (!fine) wrong.fetch_add(1);
    last_total = std::max(last_total, total);
    last_max = max;
    std::this_thread::yield();
  }
}

TEST(LatencyHistogramUnderThreads, ShowsManyReadersOnlyWhatHasBeenAdded) {
  const std::vector<std::int64_t> durations = logarithmicallySpread(kThreadSanitizer ? 100'000 : 1'000'000);
  const auto longest = static_cast<std::uint64_t>(*std::max_element(durations.begin(), durations.end()));
  constexpr int kReaders = 3;
  rt::LatencyHistogram histogram;
  std::atomic<int> wrong{0};
  {
    std::latch start(kReaders + 1);
    std::vector<std::jthread> readers;
    for (int i = 0; i < kReaders; ++i) {
      readers.emplace_back([&] {
        start.arrive_and_wait();
        watch(histogram, durations.size(), longest, wrong);
      });
    }
    start.arrive_and_wait();
    for (const std::int64_t duration : durations) histogram.add(duration);
  }
  EXPECT_EQ(wrong.load(), 0);
  EXPECT_EQ(histogram.total(), durations.size());
  EXPECT_EQ(histogram.maxNs(), longest);
}

}  // namespace
}  // namespace hapticd::test
