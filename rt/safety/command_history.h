// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// Remembers the most recent force commands and determines which one acts on the hand now: that commanded
/// one handle delay ago.
/// Thread: one.  Progress: wait-free.  RT: safe.
class CommandHistory {
 public:
  /// Number of ticks remembered, 127 ms at 1 kHz. A longer delay is treated as this one.
  static constexpr std::size_t kMaxTicks = 127;

  /// Appends the command of the current tick, in newtons.
  void add(const Vec3& command_n) HAPTICD_RT {
    newest_ = (newest_ + 1) % commands_n_.size();
    commands_n_[newest_] = command_n;
  }

  /// Returns the force that acted on the hand during the last tick; between two commands it interpolates
  /// linearly. `delay_s` >= 0; `period_s` > 0.
  Vec3 acting_n(double delay_s, double period_s) const HAPTICD_RT {
    const double ticks = ticksOf(delay_s, period_s);
    const auto whole = static_cast<std::size_t>(ticks);
    const double share = ticks - static_cast<double>(whole);
    return share > 0 ? (1 - share) * ago(whole) + share * ago(whole + 1) : ago(whole);
  }

  /// Returns the magnitude of the largest command that acted during the last tick or has not reached the hand
  /// yet.
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
    return ticks > 0 ? std::min(ticks, static_cast<double>(kMaxTicks)) : 0;  // also if NaN
  }
  const Vec3& ago(std::size_t ticks) const HAPTICD_RT {
    return commands_n_[(newest_ + commands_n_.size() - ticks) % commands_n_.size()];
  }

  std::array<Vec3, kMaxTicks + 1> commands_n_;
  std::size_t newest_ = 0;
};

}  // namespace hapticd::rt
