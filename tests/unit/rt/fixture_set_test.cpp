// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/support/path_work.h"
#include "tests/unit/rt/fixture_rig.h"

// Random sets of overlapping, nested and tangent fixtures against what defines them: the force is the
// negative gradient of a sum of energies, one for each fixture, so the hand never gets more than it gave, and
// each fixture acts as it does alone.
namespace hapticd::test {
namespace {

using rt::Fixture;
using rt::FixtureKind;
using rt::FixtureSide;
using rt::Shape;
using rt::ShapeKind;
using rt::Vec3;

/// The paths of the hand stay in a ball of about this radius around the origin.
constexpr double kRoom_m = 0.06;

FixtureKind kindOf(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::plane:
      return FixtureKind::plane;
    case ShapeKind::sphere:
      return FixtureKind::sphere;
    case ShapeKind::box:
      return FixtureKind::box;
    case ShapeKind::capsule:
      return FixtureKind::capsule;
    case ShapeKind::cone:
      break;
  }
  return FixtureKind::cone;
}

/// A shape whose boundary passes near the hand.
Shape anyShape(RandomShapes& random) {
  Shape shape{.kind = static_cast<ShapeKind>(static_cast<int>(random.between(0, 4.999)))};
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

double logBetween(RandomShapes& random, double least, double most) {
  return std::exp(random.between(std::log(least), std::log(most)));
}

bool isFree(const Fixture& fixture, const Vec3& place) {
  const double distance = distanceFrom(fixture.shape, place).distance_m;
  return fixture.side == FixtureSide::in ? distance < -fixture.clearance_m : distance > fixture.clearance_m;
}

/// Adds a random fixture that exerts no force at `start`.
void addAny(FixtureRig& rig, RandomShapes& random, const Vec3& start) {
  const double stiffness = logBetween(random, 20, 5000);
  const double max_force_n = logBetween(random, 0.2, 20);
  const double kind = random.between(0, 1);
  std::size_t index = 0;
  if (kind < 0.8) {
    for (;;) {
      Fixture candidate;
      candidate.shape = anyShape(random);
      candidate.side = random.between(0, 1) < 0.2 ? FixtureSide::in : FixtureSide::out;
      const bool nested = rig.set->count > 0 && random.between(0, 1) < 0.3;
      if (nested) {  // a margin around one that is there already, or of the same boundary
        const Fixture& other =
            (*rig.set).fixtures[static_cast<std::size_t>(random.between(0, rig.set->count - 1e-9))];
        if (!rt::isGuidance(other.kind)) {
          candidate.shape = other.shape;
          candidate.side = other.side;
          candidate.clearance_m = random.between(0, 1) < 0.5 ? 0 : random.between(0, 0.01);
        }
      }
      const Shape& shape = candidate.shape;
      const double least_m = std::min({shape.half_size_m.x, shape.half_size_m.y, shape.half_size_m.z});
      if (candidate.side == FixtureSide::in && std::min(least_m, shape.radius_m) <= candidate.clearance_m)
        continue;
      if (!isFree(candidate, start)) continue;
      index = rig.add(kindOf(shape.kind), shape, stiffness);
      rig[index].side = candidate.side;
      rig[index].clearance_m = candidate.clearance_m;
      break;
    }
  } else if (kind < 0.9) {
    const Vec3 place = random.place(kRoom_m);
    index = rig.add(FixtureKind::point, {.kind = ShapeKind::sphere, .position_m_in_world = place}, stiffness);
    rig[index].deadband_m = norm(place - start) + 0.001;
  } else {
    // through the start, so that it exerts no force there
    const Vec3 first = random.place(kRoom_m);
    index = rig.addPath({first, 2 * start - first, random.place(kRoom_m), random.place(kRoom_m)}, 0.01,
                        stiffness);
    rig[index].deadband_m = 0.01;
  }
  rig[index].max_force_n = max_force_n;
}

/// A closed path through `start`, smooth, of about four times kRoom_m.
class ClosedPath {
 public:
  ClosedPath(RandomShapes& random, const Vec3& start) : start_(start) {
    for (int k = 0; k < kHarmonics; ++k) {
      cosine_[k] = random.place(kRoom_m / (k + 1));
      sine_[k] = random.place(kRoom_m / (k + 1));
    }
  }
  /// `turn`: 0..1.
  Vec3 at(double turn) const {
    Vec3 place = start_;
    for (int k = 0; k < kHarmonics; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 1) * turn;
      place += (std::cos(angle) - 1) * cosine_[k] + std::sin(angle) * sine_[k];
    }
    return place;
  }

 private:
  static constexpr int kHarmonics = 3;
  Vec3 start_;
  Vec3 cosine_[kHarmonics];
  Vec3 sine_[kHarmonics];
};

/// A random set, and the hand at a place where none of its members exerts a force.
struct RandomSet {
  explicit RandomSet(unsigned seed) : random(seed), start(random.place(0.02)) {
    rig.parameters.springs.stiffness_n_per_m = 15'000;  // guidance is limited to a third ...
    rig.parameters.safety.max_force_n = 60;             // ... of these
    const int members = 1 + static_cast<int>(random.between(0, 15.999));
    for (int i = 0; i < members; ++i) addAny(rig, random, start);
  }

  RandomShapes random;
  FixtureRig rig;
  Vec3 start;
};

/// The fixtures as PathWork moves the hand through them.
struct FixtureSystem {
  FixtureRig& rig;

  Vec3 tick(const Vec3& place_m) {
    const rt::FixtureForces::Output output = rig.tick(place_m);
    return output.spring_force_n + output.guidance_force_n;
  }
  rt::FixturesMemory save() const { return rig.forces.memory(); }
  void restore(const rt::FixturesMemory& memory) { rig.forces.restore(memory); }
};

constexpr unsigned kSets = 10'000;
constexpr unsigned kParts = 4;

/// A part of the sets; the parts run side by side.
class FixtureSet : public testing::TestWithParam<unsigned> {
 protected:
  static void forEach(const auto& check) {
    for (unsigned seed = GetParam() + 1; seed <= kSets && !HasFatalFailure(); seed += kParts) check(seed);
  }
};

/// No energy is stored at the start, so the hand must have given at any time what it got until then. Nothing
/// moves but the hand.
TEST_P(FixtureSet, GivesTheHandNoMoreThanItGot) {
  int pressed = 0;
  forEach([&](unsigned seed) {
    RandomSet set(seed);
    const ClosedPath path(set.random, set.start);
    FixtureSystem system{set.rig};
    set.rig.jumpTo(set.start);
    PathWork<FixtureSystem> work(system, 5e-9);
    work.start(set.start);
    constexpr int kSteps = 60;
    double least_j = 0;
    for (int i = 1; i <= kSteps; ++i) {
      work.moveTo(path.at(static_cast<double>(i) / kSteps));
      least_j = std::min(least_j, work.got_j());
    }
    ASSERT_LE(work.gained_j(), 1e-6) << "set " << seed << ", path integrated within " << work.error_j()
                                     << " J";
    ASSERT_LT(work.error_j(), 1e-4) << "set " << seed;
    if (least_j < -1e-3) ++pressed;
  });
  EXPECT_GT(pressed, kSets / kParts / 2) << "most hands press on something";
}

/// Moves along the path in steps of 0.1 mm and compares each step of the force with that of its members'
/// proxies.
TEST_P(FixtureSet, ChangesTheForceNoMoreThanItsProxiesMove) {
  long steps = 0;
  long slipped = 0;
  forEach([&](unsigned seed) {
    RandomSet set(seed);
    const ClosedPath path(set.random, set.start);
    set.rig.jumpTo(set.start);
    Vec3 place = set.start;
    Vec3 force;
    rt::FixturesMemory before = set.rig.forces.memory();
    constexpr int kTurn = 3000;
    for (int i = 1; i <= kTurn && !HasFatalFailure(); ++i) {
      const Vec3 to = path.at(static_cast<double>(i) / kTurn);
      const double moved_m = norm(to - place);
      const rt::FixtureForces::Output output = set.rig.tick(to);
      const rt::FixturesMemory& now = set.rig.forces.memory();
      double explained_n = 0.01;
      for (std::size_t k = 0; k < set.rig.set->count; ++k) {
        const rt::RegionMemory& a = before.fixtures[k].region;
        const rt::RegionMemory& b = now.fixtures[k].region;
        if (rt::isGuidance(set.rig[k].kind)) {
          // as guidance.h states it
          if (before.fixtures[k].force_n > 0 || now.fixtures[k].force_n > 0)
            explained_n += set.rig[k].stiffness_n_per_m * moved_m + 0.05;
          continue;
        }
        if (!a.held && !b.held) continue;
        const Vec3 from = a.held ? a.proxy_m_in_world : place;
        const double proxy_moved_m = norm((b.held ? b.proxy_m_in_world : to) - from);
        // Along a flat boundary the spring turns nowhere; on a curved one its end at the proxy moves too.
        const bool turned = norm(a.normal_in_world - b.normal_in_world) > 1e-9;
        explained_n += set.rig[k].stiffness_n_per_m * (moved_m + (turned ? proxy_moved_m : 0));
        if (proxy_moved_m <= 2 * moved_m) continue;
        // The proxy slips around an edge, towards the hand: it pushes less.
        ++slipped;
        ASSERT_LE(b.depth_m, a.depth_m + moved_m + 1e-9)
            << "set " << seed << " step " << i << " fixture " << k;
      }
      ASSERT_LE(norm(output.spring_force_n + output.guidance_force_n - force), explained_n)
          << "set " << seed << " step " << i;
      force = output.spring_force_n + output.guidance_force_n;
      place = to;
      before = now;
      ++steps;
    }
  });
  EXPECT_LT(static_cast<double>(slipped), 0.02 * static_cast<double>(steps));
}

/// A member alone in a set of its own.
class Alone {
 public:
  Alone(const RandomSet& set, std::size_t index) {
    rig_.parameters = set.rig.parameters;
    *rig_.set = *set.rig.set;
    rig_.set->count = 1;
    rig_.set->fixtures[0] = set.rig.set->fixtures[index];
    rig_.jumpTo(set.start);
  }
  double force_n(const Vec3& place) {
    rig_.tick(place);
    return rig_.forces.memory().fixtures[0].force_n;
  }

 private:
  FixtureRig rig_;
};

TEST(FixtureSets, EachMemberPushesAsItDoesAlone) {
  constexpr unsigned kCompared = 300;
  for (unsigned seed = 1; seed <= kCompared; ++seed) {
    RandomSet set(seed);
    const ClosedPath path(set.random, set.start);
    std::vector<std::unique_ptr<Alone>> alone;
    for (std::size_t k = 0; k < set.rig.set->count; ++k) alone.push_back(std::make_unique<Alone>(set, k));
    set.rig.jumpTo(set.start);
    constexpr int kTurn = 1000;
    for (int i = 1; i <= kTurn; ++i) {
      const Vec3 place = path.at(static_cast<double>(i) / kTurn);
      set.rig.tick(place);
      for (std::size_t k = 0; k < alone.size(); ++k)
        ASSERT_EQ(set.rig.forces.memory().fixtures[k].force_n, alone[k]->force_n(place))
            << "set " << seed << " step " << i << " fixture " << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Part, FixtureSet, testing::Range(0U, kParts));

}  // namespace
}  // namespace hapticd::test
