// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Closed forms of the law's force on ideal surfaces: component along the outward normal in newtons; lengths
/// in metres, stiffness k in N/m.
namespace hapticd::test {

/// Plane, mean over all points within the ball; 0 <= h <= D.
double planeForceOfAll(double k, double D, double h);
/// Plane, mean over the N nearest points if N points fit into the ball; a_N is the radius of the disc of N
/// points.
double planeForceOfNearest(double k, double D, double a_N, double h);
/// Returns whichever of the two applies.
double planeForce(double k, double D, double a_N, double h);

/// Height and magnitude of the largest force above a plane (N nearest).
struct Peak {
  double h_m;
  double force_n;
};
Peak planePeak(double k, double D, double a_N);

/// Sphere of radius R. `side`: +1 outside, -1 inside, where the force is positive towards the centre.
double sphereForceOfAll(double k, double D, double R, int side, double h);
double sphereForceOfNearest(double k, double D, double R, double a_N, int side, double h);

/// Half-plane, above its edge, mean over all points within the ball: force away from the material.
double edgeLateralForce(double k, double D, double h);

}  // namespace hapticd::test
