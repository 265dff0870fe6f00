// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <vector>

#include "rt/base/vec3.h"

namespace hapticd::tools {

/// One touch of a landmark: readings of the handle over a time that is long enough to detect a moving hand.
/// Thread: one.
class Touch {
 public:
  static constexpr int kReadings = 20;
  static constexpr std::chrono::milliseconds kPeriod{50};
  /// Largest distance of a reading from the mean of all readings. A hand that rests on something trembles by
  /// some tenths of a millimetre.
  static constexpr double kSteady_m = 0.002;

  Touch() { readings_m_.reserve(kReadings); }

  void add(const rt::Vec3& position_m_in_world) { readings_m_.push_back(position_m_in_world); }
  bool isComplete() const { return readings_m_.size() >= kReadings; }

  /// Returns the mean of all readings; there must be one.
  rt::Vec3 mean_m_in_world() const;
  /// Distance of the farthest reading from the mean.
  double spread_m() const;
  bool isSteady() const { return spread_m() <= kSteady_m; }

 private:
  std::vector<rt::Vec3> readings_m_;
};

}  // namespace hapticd::tools
