// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace hapticd::rt {

/// A position in metres, a velocity in metres per second or a force in newtons; the name of each variable
/// states which, and in which frame (`world`, `camera`). Not an Eigen vector, because those are not trivially
/// copyable and the channels need that.
struct Vec3 {
  double x = 0;
  double y = 0;
  double z = 0;

  constexpr Vec3& operator+=(const Vec3& other) noexcept {
    x += other.x;
    y += other.y;
    z += other.z;
    return *this;
  }
  friend constexpr Vec3 operator+(Vec3 a, const Vec3& b) noexcept { return a += b; }
  friend constexpr Vec3 operator-(const Vec3& a, const Vec3& b) noexcept {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend constexpr Vec3 operator-(const Vec3& a) noexcept { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(double factor, const Vec3& a) noexcept {
    return {factor * a.x, factor * a.y, factor * a.z};
  }
  friend constexpr bool operator==(const Vec3&, const Vec3&) noexcept = default;
};

constexpr double dot(const Vec3& a, const Vec3& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
constexpr Vec3 cross(const Vec3& a, const Vec3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec3& a) noexcept {
  return std::sqrt(dot(a, a));
}
inline bool isFinite(const Vec3& a) noexcept {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

}  // namespace hapticd::rt
