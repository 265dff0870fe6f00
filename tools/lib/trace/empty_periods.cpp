// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/empty_periods.h"

#include <algorithm>
#include <limits>

namespace hapticd::tools {

void EmptyPeriodCount::add(const rt::Tick& tick) {
  if (last_) {
    const auto [time_ns, number] = *last_;
    // times from a file may be anything: their difference may overflow
    std::int64_t taken_ns = 0;
    const bool fits = !__builtin_sub_overflow(tick.planned_ns, time_ns, &taken_ns);
    if (fits && taken_ns > 0 && tick.number > number) {
      Steps& steps = steps_[{taken_ns, tick.number - number}];
      if (steps.count++ == 0) {
        steps.after_tick = number;
        steps.after_ns = time_ns;
      }
    }
  }
  last_ = {tick.planned_ns, tick.number};
}

EmptyPeriods EmptyPeriodCount::finish(std::optional<std::int64_t> period_ns) const {
  EmptyPeriods found;
  if (steps_.empty()) return found;
  found.period_ns = period_ns.value_or(std::numeric_limits<std::int64_t>::max());
  for (const auto& [step, unused] : steps_) {
    if (period_ns) break;
    found.period_ns =
        std::min(found.period_ns,
                 step.first / static_cast<std::int64_t>(std::min<std::uint64_t>(step.second, 1'000'000)));
  }
  found.period_ns = std::max<std::int64_t>(found.period_ns, 1);
  found.periods = 1;
  for (const auto& [step, steps] : steps_) {
    const auto& [taken_ns, ticks] = step;
    const bool up =
        taken_ns % found.period_ns >= (found.period_ns + 1) / 2;  // to the nearest, without overflow
    const std::uint64_t periods = static_cast<std::uint64_t>(taken_ns / found.period_ns) + (up ? 1 : 0);
    found.periods += steps.count * std::max(periods, ticks);
    if (periods <= ticks) continue;
    const std::uint64_t empty = periods - ticks;
    found.empty += steps.count * empty;
    found.stretches += steps.count;
    const bool earlier = empty == found.longest && steps.after_tick < found.after_tick;
    if (empty < found.longest || (empty == found.longest && !earlier)) continue;
    found.longest = empty;
    found.after_tick = steps.after_tick;
    found.after_ns = steps.after_ns;
  }
  return found;
}

}  // namespace hapticd::tools
