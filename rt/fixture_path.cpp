// SPDX-License-Identifier: Apache-2.0
#include "rt/fixture_path.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// Shorter lines and smaller turns count as none.
constexpr double kNone_m = 1e-9;
constexpr double kNone_rad = 1e-6;

Vec3 unit(const Vec3& v) noexcept {
  return (1 / norm(v)) * v;
}

/// Appends elements one after the other.
class Builder {
 public:
  explicit Builder(std::span<PathElement> elements) : elements_(elements) {}

  void line(const Vec3& from, const Vec3& to) {
    const Vec3 along = to - from;
    const double length = norm(along);
    if (length > kNone_m) add({from, (1 / length) * along, {}, length, 0, 0});
  }
  void arc(const Vec3& from, const Vec3& tangent, const Vec3& inward, double radius_m, double turn_rad) {
    add({from, tangent, inward, radius_m * turn_rad, 1 / radius_m, 0});
  }
  std::size_t count() const { return count_; }

 private:
  void add(PathElement element) {
    element.from_m = length_m_;
    length_m_ += element.length_m;
    elements_[count_++] = element;
  }

  std::span<PathElement> elements_;
  std::size_t count_ = 0;
  double length_m_ = 0;
};

}  // namespace

std::size_t smoothPath(std::span<const Vec3> points_m, double bend_radius_m,
                       std::span<PathElement> elements) {
  Builder path(elements);
  Vec3 from = points_m.front();
  for (std::size_t i = 1; i + 1 < points_m.size(); ++i) {
    const Vec3& corner = points_m[i];
    const Vec3 before = corner - points_m[i - 1];
    const Vec3 behind = points_m[i + 1] - corner;
    const Vec3 tangent = unit(before);
    const Vec3 onward = unit(behind);
    const double turn = std::atan2(norm(cross(tangent, onward)), dot(tangent, onward));
    if (turn < kNone_rad) {
      path.line(from, corner);
      from = corner;
      continue;
    }
    const double half_tangent = std::tan(turn / 2);
    const double room = 0.5 * std::min(norm(before), norm(behind));
    const double radius = std::min(bend_radius_m, room / half_tangent);
    const double cut = radius * half_tangent;
    const Vec3 start = corner - cut * tangent;
    path.line(from, start);
    path.arc(start, tangent, unit(onward - dot(onward, tangent) * tangent), radius, turn);
    from = corner + cut * onward;
  }
  path.line(from, points_m.back());
  return path.count();
}

}  // namespace hapticd::rt
