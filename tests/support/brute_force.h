// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

/// The paper's equations once more, in double precision, over all pixels, with nothing of the product: what
/// the product is compared with.
namespace hapticd::test {

using Vector = std::array<double, 3>;

double distanceBetween(const Vector& a, const Vector& b);

/// The 640 x 480 raw values of a file with a header of one line and little-endian pixels.
std::vector<std::uint16_t> rawPixelsOf(const std::filesystem::path& file);

/// Eq. (1)-(2) with Table I for every pixel, row by row: metres, x right, y up, looking along -z. Left out:
/// raw 2047, and depths outside 0.4..4 m (the defaults of near and far).
std::vector<Vector> pointsOf(std::span<const std::uint16_t> raw);

struct SpringLaw {
  double stiffness_n_per_m = 500;  // k_s
  double radius_m = 0.04;          // D_thresh
  std::size_t min_points = 10;     // N_min
  std::size_t max_points = 100;    // N_max
};

/// What eq. (6)-(11) say at one HIP.
class BruteForce {
 public:
  BruteForce(const std::vector<Vector>& points, const Vector& hip, const SpringLaw& law = {});

  /// N of eq. (11).
  std::size_t points() const { return points_; }
  /// F_HIP with the nearest points as sorting gives them, newtons.
  const Vector& force_n() const { return forces_.front(); }
  /// Smallest distance of `force_n` to a right answer. There are several where further points are less than
  /// 1e-6 m farther than the N_max-th, or that much nearer: each choice among those is right.
  double error_n(const Vector& force_n) const;

 private:
  std::size_t points_ = 0;
  std::vector<Vector> forces_;
};

}  // namespace hapticd::test
