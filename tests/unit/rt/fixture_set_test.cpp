// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/support/path_work.h"
#include "tests/unit/rt/random_fixtures.h"

// Random sets of overlapping, nested and tangent fixtures against what defines them: the force is the
// negative gradient of a sum of energies, one for each fixture, so the hand never gets more than it gave, and
// each fixture acts as it does alone.
namespace hapticd::test {
namespace {

using rt::Vec3;

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
