// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "rt/loop/loop_state.h"

namespace hapticd::drivers {

/// Reduces ticks to at most one per window of time: the one with the largest commanded force, of equal ones
/// the newest. So no peak of the force is missed, however short it is.
/// Thread: one.
class TickDecimator {
 public:
  explicit TickDecimator(std::int64_t window_ns) : window_ns_(window_ns) {}

  /// Adds a tick; ticks come in the order of time. Returns the tick of the window before if that has ended.
  std::optional<rt::Tick> add(const rt::Tick& tick) {
    const std::int64_t window = tick.planned_ns / window_ns_;
    std::optional<rt::Tick> ended;
    if (best_ && window != number_) ended.swap(best_);
    number_ = window;
    const double force_n = rt::norm(tick.command_force_n_in_world);
    if (!best_ || !(force_n < force_n_)) {
      best_ = tick;
      force_n_ = force_n;
    }
    return ended;
  }

 private:
  std::int64_t window_ns_;
  std::int64_t number_ = 0;
  std::optional<rt::Tick> best_;
  double force_n_ = 0;
};

}  // namespace hapticd::drivers
