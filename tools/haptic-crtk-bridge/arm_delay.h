// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "drivers/handle/udp/peer_clock.h"

namespace hapticd::tools::crtk {

/// What an arm and the network to it add to the delay from a motion to the force that responds to it.
///
/// The way to here is the age of a measurement when it arrives, by its stamp; no message says how long a
/// force takes to the arm, so the same is assumed for that. Both sides work in periods: a measurement is held
/// for half a period on average until the next one, and a force waits for half a period and acts for half
/// another one on average. Where the stamps cannot be those of this computer's clock, kUnknownWay_ns is
/// assumed in each direction.
/// Thread: one.
class ArmDelay {
 public:
  static constexpr std::int64_t kUnknownWay_ns = 10'000'000;
  /// An older measurement has a stamp of another clock, or is of no use.
  static constexpr std::int64_t kOldest_ns = 100'000'000;
  /// So many stamps in a row have to be plausible before they count.
  static constexpr int kProven = 100;

  /// One measurement, by its stamp, and when it arrived; both UTC.
  void add(std::int64_t stamp_utc_ns, std::int64_t arrived_utc_ns);
  /// Whether the stamps are taken for those of a clock that goes with this computer's.
  bool trustsStamps() const { return plausible_in_a_row_ >= kProven; }
  /// Whether there were enough measurements to tell.
  bool measured() const { return count_ >= kProven; }
  /// From a motion at the arm to the arrival of its measurement, without its being held.
  std::int64_t way_ns() const;
  /// 95th percentile of the time between two measurements; 0: not known yet.
  std::int64_t period_ns() const { return periods_.ninetyFifthPercentileNs(); }
  std::int64_t latency_ns() const { return 2 * way_ns() + 3 * period_ns() / 2; }
  void reset() { *this = {}; }

 private:
  drivers::udp::DelayEstimate ages_;
  drivers::udp::DelayEstimate periods_;
  std::int64_t last_stamp_utc_ns_ = 0;
  int plausible_in_a_row_ = 0;
  int count_ = 0;
};

}  // namespace hapticd::tools::crtk
