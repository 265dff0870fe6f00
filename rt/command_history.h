// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// The forces that were commanded last, and which of them acts on the hand now: the one from the handle's
/// delay ago. Thread: one.  Progress: wait-free.  RT: safe.
class CommandHistory {
 public:
  /// Ticks: a longer delay counts as that long. 127 ms at 1 kHz.
  static constexpr std::size_t kMostTicks = 127;

  void add(const Vec3& command_n) HAPTICD_RT {
    newest_ = (newest_ + 1) % commands_n_.size();
    commands_n_[newest_] = command_n;
  }

  /// What acted over the last tick, between two commands the mean by time. `delay_s` >= 0; `period_s` > 0.
  Vec3 acting_n(double delay_s, double period_s) const HAPTICD_RT {
    const double ticks = ticksOf(delay_s, period_s);
    const auto whole = static_cast<std::size_t>(ticks);
    const double share = ticks - static_cast<double>(whole);
    return share > 0 ? (1 - share) * ago(whole) + share * ago(whole + 1) : ago(whole);
  }

  /// Length of the largest one that acted over the last tick or is still on its way to the hand.
  double largest_n(double delay_s, double period_s) const HAPTICD_RT {
    const auto ticks = static_cast<std::size_t>(std::ceil(ticksOf(delay_s, period_s)));
    double largest2_n2 = 0;
    for (std::size_t age = 0; age <= ticks; ++age)
      largest2_n2 = std::max(largest2_n2, dot(ago(age), ago(age)));
    return std::sqrt(largest2_n2);
  }

 private:
  static double ticksOf(double delay_s, double period_s) HAPTICD_RT {
    const double ticks = delay_s / period_s;
    return ticks > 0 ? std::min(ticks, static_cast<double>(kMostTicks)) : 0;  // also where it is not a number
  }
  const Vec3& ago(std::size_t ticks) const HAPTICD_RT {
    return commands_n_[(newest_ + commands_n_.size() - ticks) % commands_n_.size()];
  }

  std::array<Vec3, kMostTicks + 1> commands_n_;
  std::size_t newest_ = 0;
};

}  // namespace hapticd::rt
