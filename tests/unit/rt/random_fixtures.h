// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "tests/unit/rt/fixture_rig.h"

/// Random fixtures that overlap, are nested in one another or touch, and closed paths of a hand through them.
namespace hapticd::test {

/// The paths of the hand stay in a ball of about this radius around the origin.
inline constexpr double kRoom_m = 0.06;

inline rt::FixtureKind kindOf(rt::ShapeKind kind) {
  switch (kind) {
    case rt::ShapeKind::plane:
      return rt::FixtureKind::plane;
    case rt::ShapeKind::sphere:
      return rt::FixtureKind::sphere;
    case rt::ShapeKind::box:
      return rt::FixtureKind::box;
    case rt::ShapeKind::capsule:
      return rt::FixtureKind::capsule;
    case rt::ShapeKind::cone:
      break;
  }
  return rt::FixtureKind::cone;
}

/// A shape whose boundary passes near the hand.
inline rt::Shape anyShape(RandomShapes& random) {
  rt::Shape shape{.kind = static_cast<rt::ShapeKind>(static_cast<int>(random.between(0, 4.999)))};
  shape.position_m_in_world = random.place(kRoom_m);
  shape.axis_in_world = random.direction();
  shape.rotation = random.rotation();
  shape.radius_m = random.between(0.005, 0.06);
  shape.length_m = random.between(0, 0.08);
  shape.half_size_m = {random.between(0.0005, 0.05), random.between(0.002, 0.05),
                       random.between(0.002, 0.05)};
  const double half_angle = random.between(0.2, 1.3);
  shape.half_angle_sine = std::sin(half_angle);
  shape.half_angle_cosine = std::cos(half_angle);
  return shape;
}

inline double logBetween(RandomShapes& random, double least, double most) {
  return std::exp(random.between(std::log(least), std::log(most)));
}

inline bool isFree(const rt::Fixture& fixture, const rt::Vec3& place) {
  const double distance = distanceFrom(fixture.shape, place).distance_m;
  return fixture.side == rt::FixtureSide::in ? distance < -fixture.clearance_m
                                             : distance > fixture.clearance_m;
}

/// Adds a random fixture that exerts no force at `start`.
inline void addAny(FixtureRig& rig, RandomShapes& random, const rt::Vec3& start) {
  const double stiffness = logBetween(random, 20, 5000);
  const double max_force_n = logBetween(random, 0.2, 20);
  const double kind = random.between(0, 1);
  std::size_t index = 0;
  if (kind < 0.8) {
    for (;;) {
      rt::Fixture candidate;
      candidate.shape = anyShape(random);
      candidate.side = random.between(0, 1) < 0.2 ? rt::FixtureSide::in : rt::FixtureSide::out;
      const bool nested = rig.set->count > 0 && random.between(0, 1) < 0.3;
      if (nested) {  // a margin around one that is there already, or of the same boundary
        const rt::Fixture& other =
            (*rig.set).fixtures[static_cast<std::size_t>(random.between(0, rig.set->count - 1e-9))];
        if (!rt::isGuidance(other.kind)) {
          candidate.shape = other.shape;
          candidate.side = other.side;
          candidate.clearance_m = random.between(0, 1) < 0.5 ? 0 : random.between(0, 0.01);
        }
      }
      const rt::Shape& shape = candidate.shape;
      const double least_m = std::min({shape.half_size_m.x, shape.half_size_m.y, shape.half_size_m.z});
      if (candidate.side == rt::FixtureSide::in && std::min(least_m, shape.radius_m) <= candidate.clearance_m)
        continue;
      if (!isFree(candidate, start)) continue;
      index = rig.add(kindOf(shape.kind), shape, stiffness);
      rig[index].side = candidate.side;
      rig[index].clearance_m = candidate.clearance_m;
      break;
    }
  } else if (kind < 0.9) {
    const rt::Vec3 place = random.place(kRoom_m);
    index = rig.add(rt::FixtureKind::point, {.kind = rt::ShapeKind::sphere, .position_m_in_world = place},
                    stiffness);
    rig[index].deadband_m = norm(place - start) + 0.001;
  } else {
    // through the start, so that it exerts no force there
    const rt::Vec3 first = random.place(kRoom_m);
    index = rig.addPath({first, 2 * start - first, random.place(kRoom_m), random.place(kRoom_m)}, 0.01,
                        stiffness);
    rig[index].deadband_m = 0.01;
  }
  rig[index].max_force_n = max_force_n;
}

/// A closed path through `start`, smooth, of about four times kRoom_m.
class ClosedPath {
 public:
  ClosedPath(RandomShapes& random, const rt::Vec3& start) : start_(start) {
    for (int k = 0; k < kHarmonics; ++k) {
      cosine_[k] = random.place(kRoom_m / (k + 1));
      sine_[k] = random.place(kRoom_m / (k + 1));
    }
  }
  /// `turn`: 0..1.
  rt::Vec3 at(double turn) const {
    rt::Vec3 place = start_;
    for (int k = 0; k < kHarmonics; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 1) * turn;
      place += (std::cos(angle) - 1) * cosine_[k] + std::sin(angle) * sine_[k];
    }
    return place;
  }

 private:
  static constexpr int kHarmonics = 3;
  rt::Vec3 start_;
  rt::Vec3 cosine_[kHarmonics];
  rt::Vec3 sine_[kHarmonics];
};

}  // namespace hapticd::test
