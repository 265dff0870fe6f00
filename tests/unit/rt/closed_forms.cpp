// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/rt/closed_forms.h"

#include <cmath>
#include <numbers>

namespace hapticd::test {

double planeForceOfAll(double k, double D, double h) {
  return k * h * (D - h) / (D + h);
}

double planeForceOfNearest(double k, double D, double a_N, double h) {
  const double S = std::hypot(h, a_N);
  return k * h * (2 * D / (h + S) - 1);
}

double planeForce(double k, double D, double a_N, double h) {
  return h * h + a_N * a_N <= D * D ? planeForceOfNearest(k, D, a_N, h) : planeForceOfAll(k, D, h);
}

Peak planePeak(double k, double D, double a_N) {
  // u = h + S solves u^3 + a_N^2 u - 4 D a_N^2 = 0; Newton's method from above
  const double a2 = a_N * a_N;
  double u = std::cbrt(4 * D * a2);
  for (int i = 0; i < 50; ++i) u -= (u * u * u + a2 * u - 4 * D * a2) / (3 * u * u + a2);
  return {(u * u - a2) / (2 * u), k / 2 * (2 * D - u - 2 * D * a2 / (u * u) + a2 / u)};
}

double sphereForceOfAll(double k, double D, double R, int side, double h) {
  const double L = R + side * h;
  const double q = side * (L * L - R * R);
  const double rest = std::pow(D, 4) / 12 - D * std::pow(h, 3) / 3 + std::pow(h, 4) / 4;
  return k / (L * (D * D - h * h)) * (q * (D - h) * (D - h) / 2 + side * rest);
}

double sphereForceOfNearest(double k, double D, double R, double a_N, int side, double h) {
  const double L = R + side * h;
  const double q = side * (L * L - R * R);
  const double S2 = h * h + a_N * a_N * L / R;
  const double S = std::sqrt(S2);
  const double rest = D * (S * S2 - std::pow(h, 3)) / 3 - (S2 * S2 - std::pow(h, 4)) / 4;
  return k / (L * (S2 - h * h)) * (q * (D * (S - h) - (S2 - h * h) / 2) + side * rest);
}

double edgeLateralForce(double k, double D, double h) {
  const double c = std::sqrt(D * D - h * h);
  return 4 * k / (std::numbers::pi * c * c) *
         (D * (c * D / 2 - h * h / 2 * std::log((c + D) / h)) - c * c * c / 3);
}

}  // namespace hapticd::test
