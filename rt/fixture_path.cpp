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

/// The arc that replaces a corner, and the lines' ends that it joins.
struct Bend {
  Vec3 start_m;
  Vec3 end_m;
  Vec3 tangent;  ///< at the start
  Vec3 inward;   ///< at the start, to the centre
  double radius_m;
  double turn_rad;  ///< below kNone_rad: there is no arc
};

Bend bendAt(const Vec3& corner, const Vec3& before, const Vec3& behind, double bend_radius_m) {
  const Vec3 to = corner - before;
  const Vec3 from = behind - corner;
  const Vec3 tangent = unit(to);
  const Vec3 onward = unit(from);
  const double turn = std::atan2(norm(cross(tangent, onward)), dot(tangent, onward));
  if (turn < kNone_rad) return {corner, corner, tangent, {}, 0, turn};
  const double half_tangent = std::tan(turn / 2);
  const double room = 0.5 * std::min(norm(to), norm(from));
  const double radius = std::min(bend_radius_m, room / half_tangent);
  const double cut = radius * half_tangent;
  return {corner - cut * tangent,
          corner + cut * onward,
          tangent,
          unit(onward - dot(onward, tangent) * tangent),
          radius,
          turn};
}

}  // namespace

bool isClosedPath(std::span<const Vec3> points_m) noexcept {
  return points_m.size() > 3 && norm(points_m.back() - points_m.front()) < kLeastPointDistance_m;
}

std::size_t smoothPath(std::span<const Vec3> points_m, double bend_radius_m,
                       std::span<PathElement> elements) {
  Builder path(elements);
  const bool closed = isClosedPath(points_m);
  const std::size_t corners = points_m.size() - 1;  // of a closed path, whose last point stands for the first
  const auto bend = [&](std::size_t i) {
    const Vec3& before = points_m[i > 0 ? i - 1 : corners - 1];
    const Vec3& behind = closed && i + 1 == corners ? points_m.front() : points_m[i + 1];
    return bendAt(points_m[i], before, behind, bend_radius_m);
  };
  Vec3 from = closed ? bend(0).end_m : points_m.front();
  const auto pass = [&](const Bend& next) {
    path.line(from, next.start_m);
    if (next.turn_rad >= kNone_rad)
      path.arc(next.start_m, next.tangent, next.inward, next.radius_m, next.turn_rad);
    from = next.end_m;
  };
  for (std::size_t i = 1; i < corners; ++i) pass(bend(i));
  if (closed) {
    pass(bend(0));
  } else {
    path.line(from, points_m.back());
  }
  return path.count();
}

}  // namespace hapticd::rt
