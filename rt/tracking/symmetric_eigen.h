// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

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

}  // namespace hapticd::rt
