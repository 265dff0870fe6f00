// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <span>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"
#include "tools/lib/registration/shape_fit.h"

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

/// A polyline through some points of another one, with both of its ends.
struct SimplifiedPath {
  std::vector<rt::Vec3> points_m;  ///< at most rt::kMaxPathPoints
  double deviation_m = 0;          ///< no place of one of the two is farther from the other
};

/// Simplifies a polyline of at least two points to `tolerance_m`, or as far as rt::kMaxPathPoints and
/// rt::kMinPointDistance_m allow. Cost: rt::kMaxPathPoints times the points.
/// Source: Ramer 1972; Douglas and Peucker 1973; the worst place is divided first.
SimplifiedPath simplifiedPath(std::span<const rt::Vec3> points_m, double tolerance_m);

/// A path along a stroke of the handle.
struct StrokePath {
  std::vector<rt::Vec3> points_m;  ///< at most rt::kMaxPathPoints
  double length_m = 0;
  double tolerance_m = 0;  ///< no place of the stroke that was left out is farther than this from the path
  Residuals residuals;     ///< of the readings
};

/// Distance along a stroke at which it is resampled. Shorter motions of the hand are trembling.
inline constexpr double kStrokeStep_m = 0.001;
inline constexpr double kMinStroke_m = 0.005;

/// The path through `readings_m`, in their order: resampled every kStrokeStep_m of its length and simplified
/// by simplifiedPath(), `tolerance_m` > 0. Errors: readings that are not finite, a stroke shorter than
/// kMinStroke_m.
base::Result<StrokePath> pathOf(std::span<const rt::Vec3> readings_m, double tolerance_m);

}  // namespace hapticd::tools
