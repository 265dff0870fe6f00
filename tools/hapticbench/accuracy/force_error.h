// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/vec3.h"
#include "tools/hapticbench/statistics.h"

namespace hapticd::tools {

/// Returns the JND of a force in newtons: 7 % of it, but at least 0.1 N.
/// (Pang, Tan and Durlach: about 7 % between 2.5 and 10 N.)
double justNoticeableDifference_n(double force_n);

/// Errors of forces relative to the true ones, in newtons, percent, JND and degrees.
struct ForceErrors {
  Spread error_n;
  Spread error_percent;  ///< of the true force; where that is zero it does not count
  Spread error_jnd;      ///< multiples of the just noticeable difference from the true force
  Spread direction_deg;  ///< between the two; where one is too small to have a direction it does not count

  void add(const rt::Vec3& force_n, const rt::Vec3& truth_n);
  void add(const ForceErrors& other);
};
auto fieldsOf(Is<ForceErrors> auto& errors) {
  auto& [error_n, percent, jnd, direction] = errors;
  return std::tie(error_n, percent, jnd, direction);
}

}  // namespace hapticd::tools
