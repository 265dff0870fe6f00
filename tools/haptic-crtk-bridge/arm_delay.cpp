// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-crtk-bridge/arm_delay.h"

#include <algorithm>

namespace hapticd::tools::crtk {

void ArmDelay::add(std::int64_t stamp_utc_ns, std::int64_t arrived_utc_ns) {
  const std::int64_t period_ns = stamp_utc_ns - last_stamp_utc_ns_;
  if (last_stamp_utc_ns_ != 0 && period_ns > 0 && period_ns < kOldest_ns) periods_.add(period_ns);
  last_stamp_utc_ns_ = stamp_utc_ns;
  count_ = std::min(count_ + 1, kProven);
  const std::int64_t age_ns = arrived_utc_ns - stamp_utc_ns;
  if (age_ns < 0 || age_ns > kOldest_ns) {
    plausible_in_a_row_ = 0;
    ages_.reset();
    return;
  }
  plausible_in_a_row_ = std::min(plausible_in_a_row_ + 1, kProven);
  ages_.add(age_ns);
}

std::int64_t ArmDelay::way_ns() const {
  return trustsStamps() ? ages_.ninetyFifthPercentileNs() : kUnknownWay_ns;
}

}  // namespace hapticd::tools::crtk
