// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "rt/vec3.h"

namespace hapticd::tools {

/// The smallest difference from a force of that size that a person notices: 7 % of it, but not below 0.1 N.
/// (Pang, Tan and Durlach: about 7 % between 2.5 and 10 N.)  Newtons.
double justNoticeableDifference_n(double force_n);

/// Root mean square and largest of some values, none of them negative.
class Spread {
 public:
  void add(double value) {
    ++count_;
    sum_of_squares_ += value * value;
    max_ = std::max(max_, value);
  }
  void add(const Spread& other) {
    count_ += other.count_;
    sum_of_squares_ += other.sum_of_squares_;
    max_ = std::max(max_, other.max_);
  }
  std::size_t count() const { return count_; }
  /// 0 when nothing was added.
  double rms() const { return count_ == 0 ? 0 : std::sqrt(sum_of_squares_ / static_cast<double>(count_)); }
  double max() const { return max_; }

 private:
  std::size_t count_ = 0;
  double sum_of_squares_ = 0;
  double max_ = 0;
};

/// How far forces are from what they should be, in the field's terms.
struct ForceErrors {
  Spread error_n;
  Spread error_percent;  ///< of the true force; where that is zero it does not count
  Spread error_jnd;      ///< multiples of the just noticeable difference from the true force
  Spread direction_deg;  ///< between the two; where one is too small to have a direction it does not count

  void add(const rt::Vec3& force_n, const rt::Vec3& truth_n);
  void add(const ForceErrors& other);
};

}  // namespace hapticd::tools
