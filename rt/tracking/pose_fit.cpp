// SPDX-License-Identifier: Apache-2.0
#include "rt/tracking/pose_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "rt/tracking/part_cube.h"

namespace hapticd::rt {
namespace {

constexpr std::size_t kMinFitPoints = 6;
// The gate shrinks from one iteration to the next, slowly while the pose still moves: points that it drops
// too early are those that show the motion.
constexpr double kGateShrink = 0.6;
constexpr double kSlowGateShrink = 0.9;
constexpr double kLargeShift_m = 0.001;
constexpr double kLargeRotation_rad = 0.02;
constexpr double kGateSigmas = 4.7;
constexpr double kRobustSigmas = 3;  // where a residual has half its weight
constexpr double kStopShift_m = 2e-5;
constexpr double kStopRotation_rad = 2e-4;
constexpr double kStopSigmas = 0.03;      // or a step this small relative to the noise of the pose
constexpr double kFadingCosine = 0.25;    // above kMinSightCosine, over which a point gains its whole weight
constexpr double kMaxStepShift_m = 0.03;  // of one iteration
constexpr double kMaxStepRotation_rad = 0.35;

/// A point as the solid sees it.
struct Look {
  Vec3 place_m{};  // in the solid's frame
  Vec3 normal{};
  double distance_m = 0;
  double sigma_m = 0;  // of the distance, by the noise
  double seen = 0;     // from 0 at a grazing angle of sight to 1; a sharp limit would keep a fit from ending
  bool counts = false;
};

bool isUsable(const TrackingPoint& point) noexcept {
  return isFinite(point.place_m) && point.depth_sigma_m > 0 && point.patch < kMaxPatches;
}

Look lookAt(const DistanceGrid& grid, const TrackingPoint& point, const Vec3& eye_m_in_solid,
            const SolidPose& pose, double shape_sigma_m, double gate_m) noexcept {
  Look look;
  if (!isUsable(point)) return look;
  look.place_m = pose.placeIn(point.place_m);
  const GridDistance found = distanceAt(grid, look.place_m);
  if (!(std::abs(found.distance_m) < gate_m)) return look;
  const double length = norm(found.gradient);
  const Vec3 to_eye = eye_m_in_solid - look.place_m;
  const double range_m = norm(to_eye);
  constexpr double kMinGradient = 0.3;  // next to a kink of the distance it is no normal
  if (!(length > kMinGradient) || !(range_m > 0)) return look;
  look.normal = (1 / length) * found.gradient;
  const double cosine = dot(look.normal, to_eye) / range_m;
  if (!(cosine > kMinSightCosine)) return look;
  look.distance_m = found.distance_m;
  look.sigma_m = std::hypot(cosine * point.depth_sigma_m, shape_sigma_m);
  look.seen = std::min(1.0, (cosine - kMinSightCosine) / kFadingCosine);
  look.counts = true;
  return look;
}

/// Sums over the points at a pose. Rotations are about the solid's origin until centred().
struct Sums {
  Matrix6 normal{};  // upper triangle
  Vector6 right{};
  double weight = 0;
  Vec3 place{};       // weighted
  double square = 0;  // weighted square of the distance from the origin
  std::size_t used = 0;
  double residual2_m2 = 0;
  double sigma2_m2 = 0;

  /// `weight`: of the point, relative.
  void add(const Look& look, double weight_of_point) noexcept {
    const Vec3 turn = cross(look.place_m, look.normal);
    const Vector6 row{turn.x, turn.y, turn.z, look.normal.x, look.normal.y, look.normal.z};
    for (std::size_t i = 0; i < 6; ++i) {
      const double weighted = weight_of_point * row[i];
      for (std::size_t j = i; j < 6; ++j) normal[i][j] += weighted * row[j];
      right[i] += weighted * look.distance_m;
    }
    weight += weight_of_point;
    place += weight_of_point * look.place_m;
    square += weight_of_point * dot(look.place_m, look.place_m);
    ++used;
    residual2_m2 += look.distance_m * look.distance_m;
    sigma2_m2 += look.sigma_m * look.sigma_m;
  }
};

/// The normal equations about the mean of the points, with rotations in units of their RMS distance from it,
/// of a mean point.
struct Equations {
  Matrix6 normal{};
  Vector6 right{};
  Vec3 centre_m{};
  double length_m = 0;
};

Equations centred(const Sums& sums) noexcept {
  Equations e;
  const double per_weight = 1 / sums.weight;
  e.centre_m = per_weight * sums.place;
  const double square = per_weight * sums.square - dot(e.centre_m, e.centre_m);
  e.length_m = std::sqrt(std::max(square, 1e-12));
  // A row J = (m x n, n) becomes S J with S = [I / L, -[c]x / L; 0, I].
  const Vec3& c = e.centre_m;
  const double l = 1 / e.length_m;
  const Matrix6 s{{{l, 0, 0, 0, c.z * l, -c.y * l},
                   {0, l, 0, -c.z * l, 0, c.x * l},
                   {0, 0, l, c.y * l, -c.x * l, 0},
                   {0, 0, 0, 1, 0, 0},
                   {0, 0, 0, 0, 1, 0},
                   {0, 0, 0, 0, 0, 1}}};
  Matrix6 half{};  // S A
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = 0; k < 6; ++k) {
      if (s[i][k] == 0) continue;
      for (std::size_t j = 0; j < 6; ++j)
        half[i][j] += s[i][k] * per_weight * (k <= j ? sums.normal[k][j] : sums.normal[j][k]);
      e.right[i] += s[i][k] * per_weight * sums.right[k];
    }
  }
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t k = 0; k < 6; ++k) e.normal[i][j] += half[i][k] * s[j][k];
    }
  }
  // Rounding leaves it unsymmetric by its last digit.
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < i; ++j) e.normal[i][j] = e.normal[j][i];
  }
  return e;
}

bool isFinite(const Equations& e) noexcept {
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) sum += e.normal[i][j];
    sum += e.right[i];
  }
  return std::isfinite(sum);
}

std::size_t frozenOf(const SymmetricEigen& eigen, double min_condition) noexcept {
  std::size_t frozen = 0;
  while (frozen < 6 && !(eigen.values[frozen] > min_condition * eigen.values[5])) ++frozen;
  return frozen;
}

FitGeometry geometryOf(const Equations& equations, double min_condition) noexcept {
  FitGeometry geometry;
  geometry.centre_m = equations.centre_m;
  geometry.length_m = equations.length_m;
  geometry.eigen = eigenOf(equations.normal);
  geometry.frozen = frozenOf(geometry.eigen, min_condition);
  return geometry;
}

/// A step along the directions that are estimated.
struct Step {
  SolidMotion motion;
  double square = 0;  // of its length with each direction in units of 1 / sqrt(eigenvalue), m^2
};

Step stepOf(const FitGeometry& geometry, const Vector6& right) noexcept {
  Step step;
  for (std::size_t i = geometry.frozen; i < 6; ++i) {
    double along = 0;
    for (std::size_t k = 0; k < 6; ++k) along += geometry.eigen.vectors[i][k] * right[k];
    along /= geometry.eigen.values[i];
    const SolidMotion motion = motionAlong(geometry, i);
    step.motion.rotation_rad += along * motion.rotation_rad;
    step.motion.shift_m += along * motion.shift_m;
    step.square += along * along * geometry.eigen.values[i];
  }
  SolidMotion& motion = step.motion;
  const double excess = std::max(
      {1.0, norm(motion.rotation_rad) / kMaxStepRotation_rad, norm(motion.shift_m) / kMaxStepShift_m});
  motion = {(1 / excess) * motion.rotation_rad, (1 / excess) * motion.shift_m};
  return step;
}

/// Sums of residuals over cubes of the solid's frame.
class Parts {
 public:
  Parts(const Vec3& centre_m, double edge_m) noexcept : parts_(centre_m, edge_m) {}

  void add(const Look& look) noexcept {
    Part& part = parts_.at(look.place_m);
    part.sum += look.distance_m / look.sigma_m;
    ++part.count;
  }
  /// RMS over the parts of their mean residual relative to its noise. `shape_share`: of the variance of a
  /// residual, the part that a mean does not reduce.
  double unevenness(double points_per_patch, double shape_share) const noexcept {
    double sum = 0;
    double parts = 0;
    for (const Part& part : parts_.all()) {
      const double worth = part.count / points_per_patch;
      constexpr double kMinWorth = 2;
      if (worth < kMinWorth) continue;
      const double mean = part.sum / part.count;
      sum += part.count * mean * mean / ((1 - shape_share) / worth + shape_share);
      parts += part.count;
    }
    return parts > 0 ? std::sqrt(sum / parts) : 0;
  }

 private:
  struct Part {
    double sum = 0;
    int count = 0;
  };
  PartCube<Part, 8> parts_;
};

/// Points per patch, of the patches that have any.
double pointsPerPatch(std::span<const TrackingPoint> points, PatchSums& sums) noexcept {
  for (const TrackingPoint& point : points) {
    if (isUsable(point)) sums[point.patch][0] = 0;
  }
  std::size_t count = 0;
  std::size_t patches = 0;
  for (const TrackingPoint& point : points) {
    if (!isUsable(point)) continue;
    ++count;
    if (sums[point.patch][0] == 0) ++patches;
    sums[point.patch][0] = 1;
  }
  return patches == 0 ? 1 : static_cast<double>(count) / static_cast<double>(patches);
}

/// The inverse in the directions that are estimated.
Matrix6 inverseOf(const FitGeometry& geometry) noexcept {
  Matrix6 inverse{};
  for (std::size_t i = geometry.frozen; i < 6; ++i) {
    const Vector6& v = geometry.eigen.vectors[i];
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t k = 0; k < 6; ++k) inverse[j][k] += v[j] * v[k] / geometry.eigen.values[i];
    }
  }
  return inverse;
}

/// Fills in the covariance, with the sums of weight * sigma * J of the patches. `weight`: of all
/// points. `scatter`:
/// square of the residuals relative to their noise.
void findCovariance(const PatchSums& sums, double weight, double scatter, FitGeometry& geometry) noexcept {
  Matrix6 together{};
  for (const Vector6& sum : sums) {
    if (sum == Vector6{}) continue;
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) together[i][j] += sum[i] * sum[j];
    }
  }
  const Matrix6 inverse = inverseOf(geometry);
  Matrix6 half{};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t k = 0; k < 6; ++k) half[i][j] += inverse[i][k] * together[k][j];
    }
  }
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t k = 0; k < 6; ++k)
        geometry.covariance_m2[i][j] += scatter / (weight * weight) * half[i][k] * inverse[k][j];
    }
  }
}

/// Everything about the points at the pose that was found.
void judgeFit(const DistanceGrid& grid, std::span<const TrackingPoint> points, const Vec3& eye_m,
              const FitOptions& options, PatchSums& patches, PoseFit& fit) noexcept {
  const Vec3 eye_m_in_solid = fit.pose.placeIn(eye_m);
  Sums sums;
  double weighted2 = 0;  // of residuals in units of their noise
  for (const TrackingPoint& point : points) {
    const Look look = lookAt(grid, point, eye_m_in_solid, fit.pose, options.shape_sigma_m, fit.gate_m);
    if (!look.counts) continue;
    const double relative = look.distance_m / look.sigma_m;
    sums.add(look, look.seen / (look.sigma_m * look.sigma_m));
    weighted2 += relative * relative;
  }
  fit.used = sums.used;
  if (sums.used < kMinFitPoints) {
    fit.end = FitEnd::no_points;
    return;
  }
  const auto count = static_cast<double>(sums.used);
  fit.rms_m = std::sqrt(sums.residual2_m2 / count);
  fit.sigma_m = std::sqrt(sums.sigma2_m2 / count);
  const Equations equations = centred(sums);
  if (!isFinite(equations)) {
    fit.end = FitEnd::not_converged;
    return;
  }
  fit.geometry = geometryOf(equations, options.min_condition);

  constexpr double kPartsPerLength = 0.7;
  const Vec3& centre_m = fit.geometry.centre_m;
  const double per_length = 1 / fit.geometry.length_m;
  Parts parts(centre_m, kPartsPerLength * fit.geometry.length_m);
  patches = {};
  for (const TrackingPoint& point : points) {
    const Look look = lookAt(grid, point, eye_m_in_solid, fit.pose, options.shape_sigma_m, fit.gate_m);
    if (!look.counts) continue;
    parts.add(look);
    const Vec3 turn = per_length * cross(look.place_m - centre_m, look.normal);
    const Vector6 row{turn.x, turn.y, turn.z, look.normal.x, look.normal.y, look.normal.z};
    for (std::size_t i = 0; i < 6; ++i) patches[point.patch][i] += look.seen * row[i] / look.sigma_m;
  }
  // More residual than expected means more noise, less does not mean less.
  findCovariance(patches, sums.weight, std::max(1.0, weighted2 / count), fit.geometry);
  const double shape_share = options.shape_sigma_m * options.shape_sigma_m / (fit.sigma_m * fit.sigma_m);
  fit.unevenness = parts.unevenness(fit.points_per_patch, std::min(1.0, shape_share));
}

}  // namespace

FitGeometry geometryOf(std::span<const SurfacePoint> points, double min_condition) noexcept {
  Sums sums;
  for (const SurfacePoint& point : points) sums.add({.place_m = point.place_m, .normal = point.normal}, 1);
  if (sums.used == 0) return {.frozen = 6};
  return geometryOf(centred(sums), min_condition);
}

SolidMotion motionAlong(const FitGeometry& geometry, std::size_t eigenvector) noexcept {
  const Vector6& v = geometry.eigen.vectors[eigenvector];
  const double per_length = 1 / geometry.length_m;
  return {per_length * Vec3{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

Vec3 shiftOf(const Vec3& place_m_in_solid, const FitGeometry& geometry, const SolidMotion& motion) noexcept {
  return motion.shift_m + cross(motion.rotation_rad, place_m_in_solid - geometry.centre_m);
}

double noiseAt_m(const FitGeometry& geometry, const Vec3& place_m_in_solid) noexcept {
  const double per_length = 1 / geometry.length_m;
  std::array<Vec3, 6> shifts;  // of the place, by each coordinate
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 axis{i == 0 ? 1.0 : 0.0, i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0};
    shifts[i] = per_length * cross(axis, place_m_in_solid - geometry.centre_m);
    shifts[i + 3] = axis;
  }
  double variance = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) variance += geometry.covariance_m2[i][j] * dot(shifts[i], shifts[j]);
  }
  return std::sqrt(std::max(0.0, variance));
}

double frozenErrorAt_m(const FitGeometry& geometry, const Vec3& place_m_in_solid, double rotation_rad,
                       double shift_m) noexcept {
  double square = 0;
  for (std::size_t i = 0; i < geometry.frozen; ++i) {
    const Vector6& v = geometry.eigen.vectors[i];
    const double turned = rotation_rad * geometry.length_m * norm(Vec3{v[0], v[1], v[2]});
    const double moved = shift_m * norm(Vec3{v[3], v[4], v[5]});
    const Vec3 shift = shiftOf(place_m_in_solid, geometry, motionAlong(geometry, i));
    square += dot(shift, shift) * (turned * turned + moved * moved);
  }
  return std::sqrt(square);
}

PoseFit fitPose(const DistanceGrid& grid, std::span<const TrackingPoint> points, const Vec3& eye_m,
                const SolidPose& start, const FitOptions& options, PatchSums& patches) noexcept {
  PoseFit fit;
  fit.pose = start;
  fit.gate_m = options.first_gate_m;
  fit.points_per_patch = pointsPerPatch(points, patches);
  for (fit.iterations = 0; fit.iterations < options.max_iterations; ++fit.iterations) {
    const Vec3 eye_m_in_solid = fit.pose.placeIn(eye_m);
    const double half_weight_m = fit.gate_m / kGateSigmas;
    Sums sums;
    for (const TrackingPoint& point : points) {
      const Look look = lookAt(grid, point, eye_m_in_solid, fit.pose, options.shape_sigma_m, fit.gate_m);
      if (!look.counts) continue;
      const double scaled = look.distance_m / std::max(half_weight_m, kRobustSigmas * look.sigma_m);
      // Goes to zero at the gate, so that no point is dropped or taken up at once.
      const double share = look.distance_m / fit.gate_m;
      const double within = 1 - share * share;
      sums.add(look, look.seen * within * within / (look.sigma_m * look.sigma_m * (1 + scaled * scaled)));
    }
    if (sums.used < kMinFitPoints) {
      fit.end = FitEnd::no_points;
      return fit;
    }
    const Equations equations = centred(sums);
    if (!isFinite(equations)) {
      fit.end = FitEnd::not_converged;
      return fit;
    }
    const FitGeometry geometry = geometryOf(equations, options.min_condition);
    const Step step = stepOf(geometry, equations.right);
    const SolidMotion& motion = step.motion;
    fit.pose = movedInSolid(fit.pose, geometry.centre_m, motion.rotation_rad, motion.shift_m);
    if (!isFinite(fit.pose)) {
      fit.pose = start;
      fit.end = FitEnd::not_converged;
      return fit;
    }
    const double sigma_m = std::sqrt(sums.sigma2_m2 / static_cast<double>(sums.used));
    const double last_gate_m = std::max(options.last_gate_m, kGateSigmas * sigma_m);
    const bool stops =
        (norm(motion.shift_m) < kStopShift_m && norm(motion.rotation_rad) < kStopRotation_rad) ||
        step.square * sums.weight < kStopSigmas * kStopSigmas * fit.points_per_patch;
    if (stops && fit.gate_m <= last_gate_m) {
      fit.end = FitEnd::converged;
      break;
    }
    const bool moves = norm(motion.shift_m) > kLargeShift_m || norm(motion.rotation_rad) > kLargeRotation_rad;
    fit.gate_m = std::max((moves ? kSlowGateShrink : kGateShrink) * fit.gate_m, last_gate_m);
  }
  if (fit.end != FitEnd::converged) fit.end = FitEnd::not_converged;
  judgeFit(grid, points, eye_m, options, patches, fit);
  return fit;
}

}  // namespace hapticd::rt
