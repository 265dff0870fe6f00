// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <span>

#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/depth/depth_model.h"
#include "rt/fixtures/distance_grid.h"
#include "rt/tracking/pose_fit.h"
#include "rt/tracking/solid_pose.h"
#include "rt/tracking/solid_sight.h"

/// The depth camera as tracker of a solid: from one depth frame to the pose of a solid whose shape is known,
/// and to whether that pose may be used.
///
/// A small residual does not mean that a pose is right: a sphere turns and a plane slides at the level of the
/// noise, and a symmetric body fits as well the other way round. So a pose is refused by what the points do
/// not determine, by the error to expect where the solid is touched, by the share of the pixels that agree,
/// and by its distance from the last pose.
namespace hapticd::rt {

enum class TrackingVerdict : std::uint8_t {
  tracked,         ///< the pose may be used; all others: it may not
  too_few_points,  ///< no pose was fitted, or most of the solid is hidden or not measured
  diverged,        ///< the fit did not end
  low_share,       ///< too few of the pixels that should show the solid do: something else is there
  large_residual,  ///< the points do not lie on the solid's surface
  weak_geometry,   ///< motions that the points do not show could move the target too far
  target_error,    ///< the noise of the points alone could move the target too far
  jumped,          ///< too far from the last pose: a symmetric body the other way round, or another body
};
constexpr auto wordsOf(TrackingVerdict) {
  return words<TrackingVerdict>("tracked", "too_few_points", "diverged", "low_share", "large_residual",
                                "weak_geometry", "target_error", "jumped");
}

/// When a pose is refused, and what is assumed of the solid and its motion.
struct TrackingLimits {
  /// Points within the gate of the fit.
  std::size_t min_points = 60;
  /// Of the pixels that should show the solid and are neither hidden nor without measurement, the share that
  /// shows it: of all of them, and of those of any part of the surface. Right poses reach 0.9, and wrong ones
  /// of bodies with faces up to 0.85.
  double min_share = 0.8;
  double min_share_of_part = 0.5;
  /// Of the pixels that should show the solid, the share that is neither hidden nor without measurement. What
  /// is in front of the solid is no misfit, because a hand or a tool may hide it, but what is hidden cannot
  /// show that a pose is wrong.
  double min_visible_share = 0.35;
  /// Of the RMS distance of the points from the surface, relative to noise and `shape_sigma_m` together, and
  /// of its mean over parts of the surface (PoseFit::unevenness). With a camera whose noise is as stated,
  /// right poses reach 1 and 1.1. A camera that is noisier than stated is refused.
  double max_residual_sigmas = 1.75;
  double max_unevenness = 1.5;
  /// By how much the real surface may deviate from the grid, standard deviation: the accuracy of the model.
  double shape_sigma_m = 0.0005;
  /// Smallest eigenvalue of an estimated direction as a share of the largest (FitGeometry). In directions
  /// below it the solid is not moved: of the poses that fit, that one is taken which moves the visible
  /// surface least from the prediction. Damped instead, they would drift from frame to frame.
  double min_condition = 0.02;
  /// By how much the prediction may be wrong in directions that are not estimated. The defaults are the
  /// largest motion from one frame to the next; a body that is clamped may have less.
  double unseen_shift_m = 0.01;
  double unseen_rotation_rad = 8 * std::numbers::pi / 180;
  /// Largest error of the target, for `confidence` standard deviations of the error by noise and for that of
  /// the directions that are not estimated.
  double max_target_error_m = 0.003;
  double confidence = 3;
  /// Largest motion of the solid's middle and largest rotation from one frame to the next.
  double max_jump_m = 0.01;
  double max_jump_rad = 8 * std::numbers::pi / 180;
  /// These grow with the number of frames since the last pose, up to this many.
  int max_jump_frames = 3;
  /// Something this far in front of the solid's surface hides it; nearer, it contradicts the pose.
  double occluder_m = 0.01;
  /// How far the points of the first iteration may be from the surface, and those of the last.
  double first_gate_m = 0.035;
  double last_gate_m = 0.004;
  int max_iterations = 40;
  /// Of the lattice that points are taken from, 1..PixelLattice::kMaxPixels.
  int max_pixels = PixelLattice::kMaxPixels;
};

/// What one frame is asked for. Poses are T_world_solid.
struct TrackingRequest {
  SolidPose predicted{};
  /// The last pose that was tracked; none at the start, where a pose cannot be refused for a jump and a
  /// symmetric body may be the other way round.
  std::optional<SolidPose> last{};
  int frames_since_last = 1;  ///< >= 1
  /// Where the solid is touched: the place whose error counts, in the solid's frame.
  Vec3 target_m_in_solid{};
  /// Around the HIP: a hand or a tool that is not the solid.
  std::optional<SightMask> mask{};
};

struct Tracking {
  TrackingVerdict verdict = TrackingVerdict::too_few_points;
  /// What the fit found, of use only if `verdict` is `tracked`; the prediction where there was nothing to
  /// fit.
  SolidPose pose{};
  std::size_t used = 0;       ///< points within the gate
  double share = 0;           ///< of the pixels that could contradict the pose, those that agree
  double share_of_part = 0;   ///< the same where it is lowest
  double visible_share = 0;   ///< of the pixels that should show the solid, those that could contradict
  double rms_m = 0;           ///< of the distances of the used points from the surface
  double expected_rms_m = 0;  ///< the same by noise and shape
  double unevenness = 0;      ///< PoseFit::unevenness
  int iterations = 0;
  /// Of the normal matrix, see FitGeometry.
  double smallest_eigenvalue = 0;
  double largest_eigenvalue = 0;
  std::size_t frozen = 0;  ///< directions that are not estimated, of six
  /// The motion that the points show least, in the solid's frame and of unit length in the fit's measure; its
  /// shift is that of `centre_m`, the mean of the points.
  SolidMotion weakest{};
  Vec3 centre_m{};
  double length_m = 0;  ///< RMS distance of the points from their mean
  /// Expected error of the target: standard deviation by noise, and largest error by the frozen directions.
  double noise_error_m = 0;
  double frozen_error_m = 0;
  double jump_m = 0;  ///< from the last pose; 0 without one
  double jump_rad = 0;

  /// Whether `weakest` is mainly a rotation, about an axis that is not much farther from the points than
  /// these are from each other; otherwise it is mainly a translation.
  bool weakestIsRotation() const noexcept;
  /// A place of that axis, in the solid's frame.
  Vec3 weakestAxisPlace_m() const noexcept;
  /// The error of the target that a limit applies to.
  double targetError_m(double confidence) const noexcept {
    return confidence * noise_error_m + frozen_error_m;
  }
};

/// Fills in the geometry and the verdict of a fit. `sight`: what the pixels show at the pose of the fit.
/// `middle_m_in_solid`: the place whose motion since the last pose counts.
/// Thread: any.  RT: safe.
Tracking judged(const PoseFit& fit, const SightCount& sight, const TrackingRequest& request,
                const TrackingLimits& limits, const Vec3& middle_m_in_solid) noexcept;

/// Tracks one solid, frame by frame. Remembers nothing from one frame to the next: prediction and last pose
/// are the caller's. The grid's coefficients outlive the tracker.
/// Thread: one at a time.
class SolidTracker {
 public:
  /// RT: not safe (allocates, and reads the whole grid).
  explicit SolidTracker(const DistanceGrid& grid);

  /// False if the grid holds no solid; then no frame is tracked.
  bool hasSolid() const noexcept { return ball_.radius_m > 0; }
  /// The ball around the solid, in its frame.
  const SolidBall& ball() const noexcept { return ball_; }

  /// Finds the solid in a frame. `image`: the raw values of a frame of the model's camera. A prediction that
  /// is not finite or not rigid, an image that is too small and a solid out of sight are `too_few_points`.
  /// Effort: looks at a lattice of at most PixelLattice::kMaxPixels pixels around the predicted place, fits
  /// at most as many points in at most `limits.max_iterations`, and traces at most 1024 rays. RT: safe (no
  /// allocation, no locks), but too long for the force thread.
  Tracking step(const DepthModel& model, std::span<const std::uint16_t> image, const TrackingRequest& request,
                const TrackingLimits& limits) noexcept;

  /// The points that the last step fitted, in the world.
  std::span<const TrackingPoint> points() const noexcept { return {points_.get(), point_count_}; }

 private:
  DistanceGrid grid_;
  SolidBall ball_;
  std::unique_ptr<TrackingPoint[]> points_;  // [PixelLattice::kMaxPixels]
  std::size_t point_count_ = 0;
  std::unique_ptr<PatchSums> sums_;
};

}  // namespace hapticd::rt
