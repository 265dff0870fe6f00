// SPDX-License-Identifier: Apache-2.0
#include "rt/base/half_space.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::rt {
namespace {

/// Violations below this do not count.
constexpr double kTolerance_m = 1e-12;
/// Of a unit vector: shorter remainders are treated as linearly dependent on the active normals.
constexpr double kDependent = 1e-7;

/// The constraints that hold with equality, at most three, with an orthonormal basis of their normals.
class ActiveSet {
 public:
  int size() const noexcept { return size_; }
  int at(int i) const noexcept { return index_[i]; }

  /// Splits `normal` into what is orthogonal to the active normals, and the coefficients of the active
  /// normals that make up the rest.
  Vec3 orthogonal(const Vec3& normal, double (&coefficient)[3]) const noexcept {
    Vec3 rest = normal;
    double along[3]{};
    for (int i = 0; i < size_; ++i) {
      along[i] = dot(rest, basis_[i]);
      rest = rest - along[i] * basis_[i];
    }
    // normal_j = sum over i <= j of upper_[i][j] basis_i: back substitution
    for (int j = size_ - 1; j >= 0; --j) {
      double sum = along[j];
      for (int k = j + 1; k < size_; ++k) sum -= upper_[j][k] * coefficient[k];
      coefficient[j] = sum / upper_[j][j];
    }
    return rest;
  }
  void add(int index, const Vec3& normal) noexcept {
    Vec3 rest = normal;
    for (int i = 0; i < size_; ++i) {
      upper_[i][size_] = dot(rest, basis_[i]);
      rest = rest - upper_[i][size_] * basis_[i];
    }
    const double length = norm(rest);
    upper_[size_][size_] = length;
    basis_[size_] = (1 / length) * rest;
    normal_[size_] = normal;
    index_[size_++] = index;
  }
  void remove(int position) noexcept {
    int kept_index[3];
    Vec3 kept_normal[3];
    int kept = 0;
    for (int i = 0; i < size_; ++i) {
      if (i == position) continue;
      kept_index[kept] = index_[i];
      kept_normal[kept++] = normal_[i];
    }
    size_ = 0;
    for (int i = 0; i < kept; ++i) add(kept_index[i], kept_normal[i]);
  }

 private:
  int size_ = 0;
  int index_[3]{};
  Vec3 normal_[3];
  Vec3 basis_[3];
  double upper_[3][3]{};
};

int mostViolated(std::span<const HalfSpace> half_spaces, const Vec3& place) noexcept {
  int worst = -1;
  double least_m = -kTolerance_m;
  for (std::size_t i = 0; i < half_spaces.size(); ++i) {
    const double room_m = half_spaces[i].room_m(place);
    if (room_m >= least_m) continue;
    least_m = room_m;
    worst = static_cast<int>(i);
  }
  return worst;
}

/// Brings one violated constraint into the active set. Returns false if that is impossible.
bool activate(std::span<const HalfSpace> half_spaces, int entering, ActiveSet& active, Vec3& place,
              std::span<double> multipliers) noexcept {
  const HalfSpace& constraint = half_spaces[static_cast<std::size_t>(entering)];
  double& own = multipliers[static_cast<std::size_t>(entering)];
  constexpr int kMaxDrops = 4;
  for (int drops = 0; drops < kMaxDrops; ++drops) {
    double coefficient[3]{};
    const Vec3 direction = active.orthogonal(constraint.normal, coefficient);
    const double slope = dot(direction, direction);
    const double full = slope > kDependent * kDependent ? -constraint.room_m(place) / slope
                                                        : std::numeric_limits<double>::infinity();
    double step = full;
    int leaving = -1;
    for (int i = 0; i < active.size(); ++i) {
      if (!(coefficient[i] > 0)) continue;
      const double most = multipliers[static_cast<std::size_t>(active.at(i))] / coefficient[i];
      if (most >= step) continue;
      step = most;
      leaving = i;
    }
    if (!std::isfinite(step)) return false;
    if (std::isfinite(full)) place += step * direction;
    for (int i = 0; i < active.size(); ++i)
      multipliers[static_cast<std::size_t>(active.at(i))] -= step * coefficient[i];
    own += step;
    if (leaving < 0) {
      active.add(entering, constraint.normal);
      return true;
    }
    multipliers[static_cast<std::size_t>(active.at(leaving))] = 0;
    active.remove(leaving);
  }
  return false;
}

}  // namespace

bool projectOnto(std::span<const HalfSpace> half_spaces, const Vec3& from_m, Vec3& place_m,
                 std::span<double> multipliers_m) HAPTICD_RT {
  std::ranges::fill(multipliers_m, 0.0);
  place_m = from_m;
  ActiveSet active;
  constexpr int kMaxSteps = 40;
  for (int step = 0; step < kMaxSteps; ++step) {
    const int violated = mostViolated(half_spaces, place_m);
    if (violated < 0) return true;
    if (!activate(half_spaces, violated, active, place_m, multipliers_m)) break;
  }
  place_m = from_m;
  for (std::size_t i = 0; i < half_spaces.size(); ++i)
    multipliers_m[i] = std::max(0.0, -half_spaces[i].room_m(from_m));
  return false;
}

}  // namespace hapticd::rt
