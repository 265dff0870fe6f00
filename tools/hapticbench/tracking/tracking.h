// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rt/depth/depth_frame.h"
#include "rt/tracking/solid_tracker.h"
#include "tools/hapticbench/engine/sequences.h"
#include "tools/lib/truth/known_solid.h"

namespace hapticd::tools {

/// A depth camera that tracks, and where the noise of its frames comes from.
enum class TrackingNoise : std::uint8_t {
  kinect,    ///< of the synthetic Kinect, as in a recorded room
  harsh,     ///< of the synthetic Kinect, as of two other devices
  recorded,  ///< a Kinect's, added from the frames of a resting recording: what changes from frame to frame
  d405,      ///< of a RealSense D405 by its vendor's figures, 848 x 480
};
inline constexpr std::array kTrackingNoises{TrackingNoise::kinect, TrackingNoise::harsh,
                                            TrackingNoise::recorded, TrackingNoise::d405};
std::string_view nameOf(TrackingNoise noise);

/// What changes from frame to frame in a recording of a scene at rest, raw units of a Kinect v1.
class RecordedNoise {
 public:
  /// Nothing unless the recording is of a Kinect and most of its pixels rest.
  static std::optional<RecordedNoise> of(const BenchSequence& session);

  /// Adds the noise of a frame to exact raw values, row by row without padding, and rounds: the pattern of
  /// any number is shifted over the image, so that there are more of them than frames. Pixels that did not
  /// rest become unmeasured.
  void deliver(std::uint32_t number, const std::vector<float>& exact, rt::DepthFrame& frame) const;

 private:
  std::vector<std::vector<float>> residuals_;  // of each frame, row by row without padding; NaN: did not rest
};

struct TrackingCase {
  SolidKind solid = SolidKind::organ;
  TrackingNoise noise = TrackingNoise::kinect;
  double distance_m = 0.6;
};

struct TrackingSettings {
  int trials = 20;       ///< poses of the solid, each with its own frame and five starts nearby
  int bad_starts = 200;  ///< for each case, shared among its poses
  double limit_m = rt::TrackingLimits{}.max_target_error_m;
  std::uint32_t seed = 1;
};

/// Results of one case. Errors are those of the target, where the surface faces the camera, and of a place 30
/// mm behind the solid's middle.
struct TrackingRow {
  TrackingCase chosen;
  std::vector<double> near_m;  ///< of all fits, with every direction estimated
  std::vector<double> far_m;
  std::vector<double> rotation_rad;
  std::vector<double> accepted_near_m;  ///< of the results that may be used, with the limits as shipped
  std::vector<double> expected_m;       ///< by the tracker, standard deviation, all directions estimated
  std::vector<double> points;
  std::vector<double> condition;
  std::vector<double> cpu_s;  ///< CPU time of the steps from nearby starts
  double floor_near_m = 0;  ///< standard deviation that the noise allows; infinite where a motion is not seen
  int starts = 0;           ///< from nearby
  int refused = 0;          ///< of these
  std::vector<int> verdicts;  ///< of these, by TrackingVerdict
  int failures = 0;  ///< hard cases whose result is off by more than the limit, or where there is no solid
  int failures_found = 0;  ///< of these, refused
  int hard_cases = 0;      ///< bad starts, occlusions, other bodies and none
  int hard_accepted = 0;   ///< of these, accepted and right

  double foundPercent() const;
  int wronglyAccepted() const { return failures - failures_found; }
};

/// Tracks the solid of a case from nearby starts (5 mm and 4 degrees), from bad ones (30 mm and 25 degrees,
/// and up to four times as much), behind other bodies, and where other bodies or none are in its place.
/// `recorded`: not null for TrackingNoise::recorded.
TrackingRow measureTracking(const TrackingCase& chosen, const TrackingSettings& settings,
                            const RecordedNoise* recorded);

/// Smallest standard deviation of an unbiased estimate of where a place of the solid is (Cramer-Rao bound),
/// from points of a camera at the origin with this noise and correlation, and rounding; infinite where they
/// do not determine it. `scale`: of the stated noise.
double trackingFloor_m(const rt::DistanceGrid& grid, const rt::SolidPose& truth,
                       std::span<const rt::TrackingPoint> points, const rt::DepthModelParameters& camera,
                       double scale, const rt::Vec3& target_m_in_solid);

}  // namespace hapticd::tools
