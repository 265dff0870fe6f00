// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "rt/loop_state.h"

namespace hapticd::tools::view {

/// Sums up ticks for one message `window`: the newest tick as it is, of the others the largest values, so
/// that no peak is lost however few messages a client takes.  Thread: one at a time.
class TickSummary {
 public:
  void add(const rt::Tick& tick);
  void addLost(std::uint64_t ticks) { lost_ += ticks; }

  bool empty() const { return ticks_ == 0 && lost_ == 0; }
  /// The message, JSON. A number that is not finite is null.
  std::string message() const;
  void clear() { *this = TickSummary(); }

 private:
  rt::Tick newest_;
  std::uint64_t ticks_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t contact_ticks_ = 0;
  std::uint32_t fixture_contacts_ = 0;  // bit n: fixture n acted
  double max_force_n_ = 0;
  double max_penetration_m_ = 0;
  bool has_penetration_ = false;  // a law with a proxy was in use
  std::int64_t max_scene_age_ns_ = 0;
  std::int64_t max_wakeup_latency_ns_ = 0;
};

}  // namespace hapticd::tools::view
