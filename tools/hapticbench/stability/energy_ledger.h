// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace hapticd::tools {

/// Energy that a surface gives to what moves against it, joules; negative: takes. Whole contact cycles are
/// what counts: within one, a spring only borrows. Thread: one.
class EnergyLedger {
 public:
  /// `force_n`: held while the position moved from `from_m` to `to_m`. A cycle ends where the motion passes
  /// `middle_m` upwards.
  void add(double force_n, double from_m, double to_m, double middle_m) noexcept {
    if (from_m < middle_m && to_m >= middle_m) {
      const double at_passage_j = total_j_ + force_n * (middle_m - from_m);
      if (passages_++ == 0) at_first_passage_j_ = at_passage_j;
      at_last_passage_j_ = at_passage_j;
    }
    total_j_ += force_n * (to_m - from_m);
  }

  /// Returns the energy of all moves.
  double total_j() const noexcept { return total_j_; }
  /// Returns the energy of the whole cycles since the first passage.
  double ofWholeCycles_j() const noexcept { return at_last_passage_j_ - at_first_passage_j_; }
  std::size_t wholeCycles() const noexcept { return passages_ > 0 ? passages_ - 1 : 0; }

 private:
  double total_j_ = 0;
  double at_first_passage_j_ = 0;
  double at_last_passage_j_ = 0;
  std::size_t passages_ = 0;
};

}  // namespace hapticd::tools
