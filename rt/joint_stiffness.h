// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "rt/vec3.h"

namespace hapticd::rt {

/// What springs that act at one place add up to: the tensor sum of K n n^T over their stiffnesses and unit
/// normals. Dampers add up in the same way. Thread: one.  RT: safe.
class JointStiffness {
 public:
  /// Adds a spring along a unit vector.
  void add(const Vec3& normal, double stiffness_n_per_m) noexcept {
    xx_ += stiffness_n_per_m * normal.x * normal.x;
    yy_ += stiffness_n_per_m * normal.y * normal.y;
    zz_ += stiffness_n_per_m * normal.z * normal.z;
    xy_ += stiffness_n_per_m * normal.x * normal.y;
    xz_ += stiffness_n_per_m * normal.x * normal.z;
    yz_ += stiffness_n_per_m * normal.y * normal.z;
  }
  /// Adds a spring in all directions across a unit vector; zero: in all directions.
  void addAcross(const Vec3& tangent, double stiffness_n_per_m) noexcept {
    xx_ += stiffness_n_per_m;
    yy_ += stiffness_n_per_m;
    zz_ += stiffness_n_per_m;
    add(tangent, -stiffness_n_per_m);
  }

  /// Returns the largest stiffness along any direction, the largest eigenvalue of the sum, by the
  /// trigonometric solution of its characteristic equation (Smith 1961).
  double largest_n_per_m() const noexcept {
    const double mean = (xx_ + yy_ + zz_) / 3;
    const double a = xx_ - mean;
    const double b = yy_ - mean;
    const double c = zz_ - mean;
    const double spread = std::sqrt((a * a + b * b + c * c + 2 * (xy_ * xy_ + xz_ * xz_ + yz_ * yz_)) / 6);
    if (!(spread > 0)) return mean;
    const double determinant =
        a * (b * c - yz_ * yz_) - xy_ * (xy_ * c - yz_ * xz_) + xz_ * (xy_ * yz_ - b * xz_);
    const double cosine = std::clamp(determinant / (2 * spread * spread * spread), -1.0, 1.0);
    return mean + 2 * spread * std::cos(std::acos(cosine) / 3);
  }

 private:
  double xx_ = 0, yy_ = 0, zz_ = 0, xy_ = 0, xz_ = 0, yz_ = 0;
};

/// Share of a spring's stiffness that the stiffness limit permits. It falls quickly where the delay grows or
/// another spring comes near, and recovers over seconds. Thread: one.  RT: safe.
class StiffnessShare {
 public:
  static constexpr double kFall_per_s = 10;
  static constexpr double kRise_per_s = 0.2;

  double value() const noexcept { return value_; }
  /// Sets where the share is going, > 0..1.
  void aimAt(double share) noexcept { aim_ = share; }
  /// Moves the share; it rises by at most `rise_per_s`.
  void advance(double period_s, double rise_per_s = kRise_per_s) noexcept {
    value_ = std::clamp(aim_, value_ - kFall_per_s * period_s, value_ + rise_per_s * period_s);
  }
  /// Moves the share while the spring exerts no force: down at once.
  void advanceFree(double period_s) noexcept { value_ = std::min(aim_, value_ + kRise_per_s * period_s); }
  /// The same for a spring that may be stiff at once where it acts next.
  void arrive() noexcept { value_ = aim_; }

 private:
  double value_ = 1;
  double aim_ = 1;
};

}  // namespace hapticd::rt
