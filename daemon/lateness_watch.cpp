// SPDX-License-Identifier: Apache-2.0
#include "daemon/lateness_watch.h"

#include <algorithm>
#include <functional>

namespace hapticd::daemon {
namespace {

constexpr std::int64_t kSamplePeriod_ns = 1'000'000'000;
constexpr std::int64_t kWindow_ns = 60 * kSamplePeriod_ns;

// One late tick in 10 000 is one every ten seconds at 1 kHz, which a hand hardly ever meets while in contact.
constexpr double kLateShare = 1e-4;
/// Up to this many late ticks do not count: they are from the start, when memory and caches are cold.
constexpr std::uint64_t kFewLateTicks = 3;
// Half a percent of a second without ticks, 5 of 1000, is no rounding.
constexpr double kSkippedShare = 0.005;

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void LatenessWatch::follow(const rt::LoopCounters& counters, std::int64_t time_ns) {
  if (!samples_.empty() && time_ns - samples_.back().time_ns < kSamplePeriod_ns) return;
  samples_.push_back({time_ns, counters.ticks, counters.overruns, counters.skipped_periods});
  while (samples_.size() > 2 && time_ns - samples_[1].time_ns >= kWindow_ns) samples_.pop_front();
  judge();
}

void LatenessWatch::judge() {
  const Sample& first = samples_.front();
  const Sample& last = samples_.back();
  lateness_ = {false, last.ticks - first.ticks, last.late_ticks - first.late_ticks,
               last.skipped_periods - first.skipped_periods};
  const auto skips = [](const Sample& before, const Sample& after) {
    const std::uint64_t skipped = after.skipped_periods - before.skipped_periods;
    return share(skipped, after.ticks - before.ticks + skipped) > kSkippedShare;
  };
  const bool ends_late =
      lateness_.late_ticks > kFewLateTicks && share(lateness_.late_ticks, lateness_.ticks) > kLateShare;
  lateness_.late = ends_late || std::ranges::adjacent_find(samples_, skips) != samples_.end();
}

}  // namespace hapticd::daemon
