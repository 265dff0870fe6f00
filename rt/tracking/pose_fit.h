// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "rt/base/vec3.h"
#include "rt/fixtures/distance_grid.h"
#include "rt/tracking/solid_pose.h"

/// Registration of a solid to measured points: the pose at which the solid's boundary passes through them.
///
/// Gauss-Newton on the distances of the points from the boundary, along its normals. Distance and normal come
/// from the solid's DistanceGrid, so that no nearest neighbours are searched for and the cost does not depend
/// on the shape.
namespace hapticd::rt {

using Vector6 = std::array<double, 6>;
using Matrix6 = std::array<Vector6, 6>;

struct SymmetricEigen {
  Vector6 values;   ///< ascending
  Matrix6 vectors;  ///< vectors[i] has unit length and belongs to values[i]
};

/// Eigenvalues and eigenvectors of a symmetric, finite matrix, by Jacobi's rotations: exact to rounding, also
/// for the small eigenvalues.  RT: safe; at most 16 sweeps of 15 rotations.
inline SymmetricEigen eigenOf(Matrix6 a) noexcept {
  Matrix6 v{};
  for (std::size_t i = 0; i < 6; ++i) v[i][i] = 1;
  for (int sweep = 0; sweep < 16; ++sweep) {
    double beside = 0;
    double diagonal = 0;
    for (std::size_t p = 0; p < 6; ++p) {
      diagonal += a[p][p] * a[p][p];
      for (std::size_t q = p + 1; q < 6; ++q) beside += a[p][q] * a[p][q];
    }
    if (!(beside > 1e-34 * diagonal)) break;
    for (std::size_t p = 0; p < 6; ++p) {
      for (std::size_t q = p + 1; q < 6; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::hypot(theta, 1));
        const double cosine = 1 / std::hypot(t, 1);
        const double sine = t * cosine;
        for (std::size_t k = 0; k < 6; ++k) {
          const double kp = a[k][p];
          const double kq = a[k][q];
          a[k][p] = cosine * kp - sine * kq;
          a[k][q] = sine * kp + cosine * kq;
        }
        for (std::size_t k = 0; k < 6; ++k) {
          const double pk = a[p][k];
          const double qk = a[q][k];
          a[p][k] = cosine * pk - sine * qk;
          a[q][k] = sine * pk + cosine * qk;
        }
        for (std::size_t k = 0; k < 6; ++k) {
          const double pk = v[p][k];
          const double qk = v[q][k];
          v[p][k] = cosine * pk - sine * qk;
          v[q][k] = sine * pk + cosine * qk;
        }
      }
    }
  }
  std::array<std::size_t, 6> order{0, 1, 2, 3, 4, 5};
  std::ranges::sort(order, {}, [&a](std::size_t i) { return a[i][i]; });
  SymmetricEigen result;
  for (std::size_t i = 0; i < 6; ++i) {
    result.values[i] = a[order[i]][order[i]];
    result.vectors[i] = v[order[i]];
  }
  return result;
}

/// A measured point, in the outer frame of the poses.
struct TrackingPoint {
  Vec3 place_m{};
  /// Standard deviation of the depth along the optical axis, > 0.
  double depth_sigma_m = 0;
  /// Points of one patch of the image have their error in common, those of different ones do not: the window
  /// that a camera matches as a whole. Below kMaxPatches.
  std::uint16_t patch = 0;
};
inline constexpr std::size_t kMaxPatches = 4096;

struct FitOptions {
  /// Points farther from the boundary than the gate are left out; it shrinks from the first value to the
  /// last, or to 4.7 standard deviations of the noise if these are more.
  double first_gate_m = 0.035;
  double last_gate_m = 0.004;
  /// A direction of motion whose eigenvalue is below this share of the largest is not estimated.
  double min_condition = 0.02;
  /// By how much the surface of the solid may deviate from its grid, standard deviation; adds to that of the
  /// points.
  double shape_sigma_m = 0;
  int max_iterations = 40;
};

/// How well the points determine the pose. Motions are those of the solid in its own frame: a rotation about
/// `centre_m`, times `length_m`, and a translation, six lengths in metres together.
struct FitGeometry {
  Vec3 centre_m{};      ///< mean of the points, in the solid's frame
  double length_m = 0;  ///< RMS distance of the points from it
  /// Of the normal matrix, the mean of J J^T over the points with J = ((m - centre) x n / length, n); each is
  /// 0..1, and together they are at most 2.
  SymmetricEigen eigen{};
  /// Directions that are not estimated: the first ones of `eigen`.
  std::size_t frozen = 0;
  /// Of the error by noise, m^2, in the directions that are estimated: A^-1 B A^-1, with the sums A over the
  /// points and B over the patches, whose points err together.
  Matrix6 covariance_m2{};
};

/// A place of a surface with its outward unit normal, both in the solid's frame.
struct SurfacePoint {
  Vec3 place_m{};
  Vec3 normal{};
};

/// How well points of a surface would determine its pose, without noise: the covariance is 0. All directions
/// are frozen where there is no point.  RT: safe.
FitGeometry geometryOf(std::span<const SurfacePoint> points, double min_condition) noexcept;

/// A motion of the solid in its own frame.
struct SolidMotion {
  Vec3 rotation_rad{};
  Vec3 shift_m{};
};

/// The motion of length 1 m along an eigenvector of the geometry.
SolidMotion motionAlong(const FitGeometry& geometry, std::size_t eigenvector) noexcept;

/// How far a place of the solid moves when the solid moves so.
Vec3 shiftOf(const Vec3& place_m_in_solid, const FitGeometry& geometry, const SolidMotion& motion) noexcept;

/// Standard deviation, by the noise of the points, of the place where a point of the solid is estimated: the
/// root of the trace of its covariance G C G^T, without what the frozen directions add.
double noiseAt_m(const FitGeometry& geometry, const Vec3& place_m_in_solid) noexcept;

/// Error of that place if the pose is off by `rotation_rad` and `shift_m`, of any direction, in the frozen
/// directions; 0 without any.
double frozenErrorAt_m(const FitGeometry& geometry, const Vec3& place_m_in_solid, double rotation_rad,
                       double shift_m) noexcept;

enum class FitEnd : std::uint8_t {
  converged,
  no_points,      ///< fewer than six within the gate
  not_converged,  ///< the greatest number of iterations was not enough, or a number was not finite
};

struct PoseFit {
  SolidPose pose;
  FitEnd end = FitEnd::no_points;
  int iterations = 0;
  std::size_t used = 0;  ///< points within the last gate
  double points_per_patch = 1;
  double gate_m = 0;   ///< the last one
  double rms_m = 0;    ///< of the distances of these
  double sigma_m = 0;  ///< RMS of what noise and shape make expect of them
  /// The distances relative to their noise, averaged over parts of the surface that are larger than what the
  /// noise has in common, RMS over the parts: about 1 where the residual is noise, more where the shape is
  /// another one or the pose is wrong. 0: too few points.
  double unevenness = 0;
  FitGeometry geometry;
};

/// What a fit adds up for each patch; large, so that its owner makes it once.
using PatchSums = std::array<Vector6, kMaxPatches>;

/// Fits the pose, starting at `start`, to points of which each is seen from `eye_m`: places where the solid's
/// surface is turned away from the eye or is seen at a grazing angle do not count. Points that are not finite
/// are left out. The result does not depend on the order of the points but for rounding. `sums`: overwritten.
/// Effort: at most (options.max_iterations + 2) times points.size() look-ups of the grid.
/// Thread: any.  RT: safe (no allocation; bounded, but too long for the force thread).
PoseFit fitPose(const DistanceGrid& grid, std::span<const TrackingPoint> points, const Vec3& eye_m,
                const SolidPose& start, const FitOptions& options, PatchSums& sums) noexcept;

/// Cosine of the largest angle between sight and normal at which a surface counts as seen, 75 degrees: beyond
/// it a camera's window mixes the surface with what is beside it.
inline constexpr double kMinSightCosine = 0.26;

}  // namespace hapticd::rt
