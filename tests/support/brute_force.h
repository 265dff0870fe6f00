// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

/// An independent implementation of the paper's equations in double precision over all pixels, sharing no
/// code with the product, whose results are compared with it.
namespace hapticd::test {

using Vector = std::array<double, 3>;

double distanceBetween(const Vector& a, const Vector& b);

/// Returns the 640 x 480 raw values of a file with a header of one line and little-endian pixels.
std::vector<std::uint16_t> rawPixelsOf(const std::filesystem::path& file);

/// Evaluates eq. (1)-(2) with Table I for every pixel, row by row: metres, x right, y up, looking along -z.
/// Omits raw 2047 and depths outside 0.4..4 m (the defaults of near and far).
std::vector<Vector> pointsOf(std::span<const std::uint16_t> raw);

struct SpringLaw {
  double stiffness_n_per_m = 500;  // k_s
  double radius_m = 0.04;          // D_thresh
  std::size_t min_points = 10;     // N_min
  std::size_t max_points = 100;    // N_max
};

/// Evaluates eq. (6)-(11) at one HIP.
class BruteForce {
 public:
  BruteForce(const std::vector<Vector>& points, const Vector& hip, const SpringLaw& law = {});

  /// Returns N of eq. (11).
  std::size_t points() const { return points_; }
  /// Returns F_HIP in newtons, with the nearest points in sorted order.
  const Vector& force_n() const { return forces_.front(); }
  /// Returns the smallest distance of `force_n` to a correct result. There are several where points are
  /// within 1e-6 m of the distance of the N_max-th: each choice among those is correct.
  double error_n(const Vector& force_n) const;

 private:
  std::size_t points_ = 0;
  std::vector<Vector> forces_;
};

}  // namespace hapticd::test
