// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Forces of the law on ideal surfaces, haptics.md 1.6 and 1.9: along the outward normal, newtons; lengths in
/// metres, stiffness k in N/m.
namespace hapticd::test {

/// Plane, all points within the ball averaged; 0 <= h <= D.
double planeForceOfAll(double k, double D, double h);
/// Plane, the N nearest averaged, where N of them fit into the ball; a_N is the radius of the disc of N
/// points.
double planeForceOfNearest(double k, double D, double a_N, double h);
/// What applies of the two.
double planeForce(double k, double D, double a_N, double h);

/// Height and size of the largest force above a plane (N nearest).
struct Peak {
  double h_m;
  double force_n;
};
Peak planePeak(double k, double D, double a_N);

/// Sphere of radius R. `side` is +1 outside and -1 inside, where the force counts towards the centre.
double sphereForceOfAll(double k, double D, double R, int side, double h);
double sphereForceOfNearest(double k, double D, double R, double a_N, int side, double h);

/// Half-plane, above its edge, all points within the ball averaged: away from the material.
double edgeLateralForce(double k, double D, double h);

}  // namespace hapticd::test
