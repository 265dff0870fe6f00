// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"

/// Shapes through points that the handle has touched. All lengths in metres, all vectors in the frame of the
/// points.
namespace hapticd::tools {

/// How far the points are from the shape that fits them.
struct Residuals {
  std::vector<double> each_m;  ///< distance of each point, in the order of the points
  double rms_m = 0;
  double largest_m = 0;
};

/// The residuals of these distances, which may have any sign.
Residuals residualsOf(std::span<const double> distances_m);

struct FittedPlane {
  rt::Vec3 position_m;  ///< centroid of the points
  rt::Vec3 normal;      ///< unit length
  Residuals residuals;
};
struct FittedSphere {
  rt::Vec3 position_m;
  double radius_m = 0;
  Residuals residuals;
};
struct FittedBox {
  rt::Vec3 position_m;    ///< centre
  rt::Vec3 size_m;        ///< lengths of the edges
  rt::Vec3 rotation_deg;  ///< roll, pitch, yaw about the fixed axes, as of a fixture
  Residuals residuals;    ///< of the three corners; the height has none
};

inline constexpr std::size_t kMinPlanePoints = 3;
inline constexpr std::size_t kMinSpherePoints = 4;
/// Spread of a touch of a hand that rests on something, as it enters the expected error of a fit.
inline constexpr double kTouchNoise_m = 0.0005;
/// Largest expected error of the centre and of the radius of a sphere.
inline constexpr double kMaxSphereError_m = 0.005;
/// Shortest edge of a box that touches can measure: several times kTouchNoise_m.
inline constexpr double kMinEdge_m = 0.003;

/// The plane with the least sum of squared distances. Its normal points to the side of `free_side_m`, such as
/// the position of the camera. Errors: fewer than kMinPlanePoints, points nearly on a line.
base::Result<FittedPlane> fitPlane(std::span<const rt::Vec3> points_m, const rt::Vec3& free_side_m);

/// The sphere with the least sum of squared distances: the algebraic solution, refined by Gauss-Newton steps.
/// Errors: fewer than kMinSpherePoints, points nearly in a plane, points on so small a part of the sphere
/// that kTouchNoise_m changes its centre or its radius by more than kMaxSphereError_m.
/// Source: Ahn, Rauh, Warnecke, Least-squares orthogonal distances fitting of circle, sphere, ellipse,
/// hyperbola, and parabola, 2001, section 2.
base::Result<FittedSphere> fitSphere(std::span<const rt::Vec3> points_m);

/// The box of three corners of a face, in order along its edges, and any point on the opposite face. The
/// angle at the second corner is made a right one by turning both edges alike; the residuals are what that
/// moves the corners by. Errors: an edge below kMinEdge_m.
base::Result<FittedBox> fitBox(const std::array<rt::Vec3, 3>& corners_m, const rt::Vec3& opposite_m);

}  // namespace hapticd::tools
