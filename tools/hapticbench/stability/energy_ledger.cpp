// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/energy_ledger.h"

namespace hapticd::tools {

void EnergyLedger::add(double force_n, double from_m, double to_m, double middle_m) noexcept {
  if (from_m < middle_m && to_m >= middle_m) {
    const double at_passage_j = total_j_ + force_n * (middle_m - from_m);
    if (passages_++ == 0) at_first_passage_j_ = at_passage_j;
    at_last_passage_j_ = at_passage_j;
  }
  total_j_ += force_n * (to_m - from_m);
}

}  // namespace hapticd::tools
