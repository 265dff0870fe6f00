// SPDX-License-Identifier: Apache-2.0
#include "rt/tracking/solid_tracker.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// Pixels whose rays are traced.
constexpr int kSightPixels = 1024;

TrackingVerdict verdictOf(const PoseFit& fit, const SightCount& sight, const Tracking& tracking,
                          const TrackingRequest& request, const TrackingLimits& limits) noexcept {
  if (fit.end == FitEnd::no_points || fit.used < limits.min_points) return TrackingVerdict::too_few_points;
  if (fit.end != FitEnd::converged) return TrackingVerdict::diverged;
  if (!(sight.visibleShare() >= limits.min_visible_share)) return TrackingVerdict::too_few_points;
  if (!(sight.share() >= limits.min_share)) return TrackingVerdict::low_share;
  if (!(sight.least_share_of_part >= limits.min_share_of_part)) return TrackingVerdict::low_share;
  const bool fits =
      fit.rms_m <= limits.max_residual_sigmas * fit.sigma_m && fit.unevenness <= limits.max_unevenness;
  if (!fits) return TrackingVerdict::large_residual;
  if (!(tracking.frozen_error_m <= limits.max_target_error_m)) return TrackingVerdict::weak_geometry;
  if (!(tracking.targetError_m(limits.confidence) <= limits.max_target_error_m))
    return TrackingVerdict::target_error;
  if (request.last) {
    const int frames = std::clamp(request.frames_since_last, 1, std::max(1, limits.max_jump_frames));
    const bool stays =
        tracking.jump_m <= frames * limits.max_jump_m && tracking.jump_rad <= frames * limits.max_jump_rad;
    if (!stays) return TrackingVerdict::jumped;
  }
  return TrackingVerdict::tracked;
}

}  // namespace

bool Tracking::weakestIsRotation() const noexcept {
  const double turn = norm(weakest.rotation_rad);
  if (!(turn > 0)) return false;
  // A shift across the axis only moves the axis; one along it makes a screw of the rotation.
  const double along_m = std::abs(dot(weakest.shift_m, weakest.rotation_rad)) / turn;
  constexpr double kFarAxis = 5;
  return turn * length_m > std::max(along_m, norm(weakest.shift_m) / kFarAxis);
}

Vec3 Tracking::weakestAxisPlace_m() const noexcept {
  const double square = dot(weakest.rotation_rad, weakest.rotation_rad);
  if (!(square > 0)) return centre_m;
  return centre_m + (1 / square) * cross(weakest.rotation_rad, weakest.shift_m);
}

Tracking judged(const PoseFit& fit, const SightCount& sight, const TrackingRequest& request,
                const TrackingLimits& limits, const Vec3& middle_m_in_solid) noexcept {
  Tracking tracking;
  tracking.pose = fit.pose;
  tracking.iterations = fit.iterations;
  tracking.used = fit.used;
  tracking.share = sight.share();
  tracking.share_of_part = sight.least_share_of_part;
  tracking.visible_share = sight.visibleShare();
  tracking.rms_m = fit.rms_m;
  tracking.expected_rms_m = fit.sigma_m;
  tracking.unevenness = fit.unevenness;
  if (fit.geometry.length_m > 0) {
    tracking.smallest_eigenvalue = fit.geometry.eigen.values[0];
    tracking.largest_eigenvalue = fit.geometry.eigen.values[5];
    tracking.frozen = fit.geometry.frozen;
    tracking.weakest = motionAlong(fit.geometry, 0);
    tracking.centre_m = fit.geometry.centre_m;
    tracking.length_m = fit.geometry.length_m;
    tracking.noise_error_m = noiseAt_m(fit.geometry, request.target_m_in_solid);
    tracking.frozen_error_m = frozenErrorAt_m(fit.geometry, request.target_m_in_solid,
                                              limits.unseen_rotation_rad, limits.unseen_shift_m);
  }
  if (request.last) {
    tracking.jump_m = norm(fit.pose.placeOut(middle_m_in_solid) - request.last->placeOut(middle_m_in_solid));
    tracking.jump_rad = angleBetween_rad(fit.pose, *request.last);
  }
  tracking.verdict = verdictOf(fit, sight, tracking, request, limits);
  return tracking;
}

SolidTracker::SolidTracker(const DistanceGrid& grid)
    : grid_(grid),
      ball_(ballAround(grid)),
      points_(std::make_unique<TrackingPoint[]>(PixelLattice::kMaxPixels)),
      sums_(std::make_unique<PatchSums>()) {}

Tracking SolidTracker::step(const DepthModel& model, std::span<const std::uint16_t> image,
                            const TrackingRequest& request, const TrackingLimits& limits) noexcept {
  point_count_ = 0;
  Tracking nothing;
  nothing.pose = request.predicted;
  const bool usable = hasSolid() && isRigid(request.predicted) && isFinite(request.target_m_in_solid) &&
                      (!request.last || isRigid(*request.last));
  if (!usable) return nothing;
  // Points that come within the first gate only after some iterations are gathered too.
  constexpr double kGates = 1.3;
  const double range_m = kGates * limits.first_gate_m;
  const PixelLattice lattice = latticeOver(model, request.predicted.placeOut(ball_.centre_m),
                                           ball_.radius_m + limits.first_gate_m, limits.max_pixels);
  if (lattice.pixels() == 0) return nothing;
  point_count_ = gatherPoints(model, image, lattice, grid_, request.predicted, range_m, request.mask,
                              {points_.get(), PixelLattice::kMaxPixels});
  const FitOptions options{.first_gate_m = limits.first_gate_m,
                           .last_gate_m = limits.last_gate_m,
                           .min_condition = limits.min_condition,
                           .shape_sigma_m = limits.shape_sigma_m,
                           .max_iterations = limits.max_iterations};
  const PoseFit fit =
      fitPose(grid_, points(), model.cameraPosition_m_in_world(), request.predicted, options, *sums_);
  SightCount sight;
  if (fit.end == FitEnd::converged) {
    const PixelLattice traced =
        latticeOver(model, fit.pose.placeOut(ball_.centre_m), ball_.radius_m, kSightPixels);
    sight =
        countSight(model, image, traced, grid_, ball_, fit.pose, fit.gate_m, limits.occluder_m, request.mask);
  }
  return judged(fit, sight, request, limits, ball_.centre_m);
}

}  // namespace hapticd::rt
