// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/hard_cases/hard_rig.h"
#include "tests/support/passive_hand.h"
#include "tests/support/sanitizer.h"
#include "tests/unit/rt/fixtures/random_fixtures.h"

namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;

// Passive hands that are pressed into random corners and hollows of forbidden regions and the live surface,
// over a connection that delays, jitters and loses packets.

constexpr double kDistance_m = 1;
constexpr double kDevice_kg = 0.045;

/// What a case is: hand, device and connection.
struct Case {
  double hand_n_per_m;
  double mass_kg;
  double delay_s;
  bool poor;  ///< jitter of 5 ms and 5 % loss
};
std::string nameOf(const Case& c) {
  return fmt::format("hand {} N/m, {} g, delay {} ms{}", c.hand_n_per_m, c.mass_kg * 1e3, c.delay_s * 1e3,
                     c.poor ? ", jitter and loss" : "");
}

/// Where a hand is pressed: a box in front of a scene, with fixtures.
class PressedPlace {
 public:
  const Vec3& point() const { return point_; }
  const Vec3& outward() const { return outward_; }
  /// Where the hand begins, without a force.
  const Vec3& start() const { return start_; }
  tools::OfflineBox& box() { return rig_.box; }

 protected:
  PressedPlace(const tools::TrueSceneParameters& scene, rt::ForceLaw law)
      : scene_(scene, fineCameraFor(kDistance_m)), rig_(law, scene_.depthModel()) {
    rig_.box.start().device_mass_kg = kDevice_kg;
    // A device that becomes warm would give way.
    rig_.box.parameters().safety.continuous_force_n = rig_.box.parameters().safety.max_force_n;
    rig_.show(scene_);
    rig_.box.setAdditions(set_.get(), nullptr);
  }
  /// A direction at up to 60 degrees from another one.
  static Vec3 nextTo(const Vec3& other, RandomShapes& random) {
    Vec3 direction = random.direction();
    while (dot(direction, other) < 0.5) direction = random.direction();
    return direction;
  }
  rt::Fixture& add(rt::FixtureKind kind, const rt::Shape& shape, RandomShapes& random) {
    rt::Fixture& fixture = set_->fixtures[set_->count++];
    fixture.kind = kind;
    fixture.identity = set_->count;
    fixture.definition = set_->count;
    fixture.shape = shape;
    fixture.stiffness_n_per_m = logBetween(random, 100, 5000);
    fixture.max_force_n = logBetween(random, 1, 20);
    ++set_->generation;
    return fixture;
  }

  TrueScene scene_;
  HardRig rig_;
  std::unique_ptr<rt::FixtureSet> set_ = std::make_unique<rt::FixtureSet>();
  Vec3 point_;
  Vec3 outward_;
  Vec3 start_;
};

/// Two or three planes that meet in a point, the live surface among them where there is one.
class Corner : public PressedPlace {
 public:
  Corner(RandomShapes& random, bool with_surface)
      : PressedPlace(
            {.kind = SceneKind::plane, .distance_m = kDistance_m, .tilt_rad = random.between(-0.4, 0.4)},
            with_surface ? rt::ForceLaw::surface : rt::ForceLaw::nearest_springs) {
    rig_.box.parameters().force.stiffness_n_per_m = logBetween(random, 50, 2000);
    const TrueScene::Approach approach = scene_.approach(0);
    point_ = with_surface ? approach.surface_m_in_world
                          : approach.surface_m_in_world - 0.3 * approach.inward_in_world;
    const Vec3 surface = -approach.inward_in_world;
    const Vec3 axis = with_surface ? nextTo(surface, random) : random.direction();
    if (with_surface) normals_.push_back(surface);
    const int planes = (with_surface ? 1 : 2) + (random.between(0, 1) > 0.5 ? 1 : 0);
    for (int i = 0; i < planes; ++i) addPlane(axis, random);
    // In the middle of the normals, so that nothing leads out of the corner along a crease.
    for (const Vec3& normal : normals_) outward_ += normal;
    outward_ = (1 / norm(outward_)) * outward_;
    start_ = point_ + 0.01 * outward_;
  }

 private:
  /// Adds a plane at 30 degrees to the others at least: a blunter corner gives way to the side so easily that
  /// a hand without a spring creeps there for seconds.
  void addPlane(const Vec3& axis, RandomShapes& random) {
    constexpr double kBlunt = 0.87;
    constexpr int kTrials = 100;
    Vec3 normal = nextTo(axis, random);
    for (int i = 0;
         i < kTrials && std::ranges::any_of(normals_, [&](const Vec3& n) { return dot(n, normal) > kBlunt; });
         ++i)
      normal = nextTo(axis, random);
    normals_.push_back(normal);
    add(rt::FixtureKind::plane,
        {.kind = rt::ShapeKind::plane, .position_m_in_world = point_, .axis_in_world = normal}, random);
  }

  std::vector<Vec3> normals_;
};

/// What a hand may be pressed into where the proxy cannot follow it in one direction or more.
enum class HollowKind : std::uint8_t { box, cone, sphere, capsule, solid, surface, standoff, mixed };
constexpr const char* kHollowNames[] = {"box",   "cone",    "sphere",   "capsule",
                                        "solid", "surface", "standoff", "mixed"};

class Hollow : public PressedPlace {
 public:
  Hollow(RandomShapes& random, HollowKind kind)
      : PressedPlace({.kind = SceneKind::inner_corner, .distance_m = kDistance_m},
                     isLive(kind) ? rt::ForceLaw::surface : rt::ForceLaw::nearest_springs) {
    rig_.box.parameters().force.stiffness_n_per_m = logBetween(random, 50, isLive(kind) ? 1000 : 2000);
    const Vec3 crease = scene_.approach(0).surface_m_in_world;
    start_ = crease + Vec3{0, random.between(-0.02, 0.02), isLive(kind) ? 0.02 : 0.3};
    outward_ = nextTo({0, 0, 1}, random);
    switch (kind) {
      case HollowKind::surface:
        break;
      case HollowKind::standoff:
        addStandoff(random);
        break;
      case HollowKind::mixed:
        addMixed(random);
        break;
      default:
        addHollow(kind, random);
    }
    point_ = isLive(kind) ? crease + 0.005 * random.direction() : start_ - random.between(0, 0.01) * outward_;
    rig_.box.setAdditions(set_.get(), nullptr);
  }

 private:
  static bool isLive(HollowKind kind) {
    return kind == HollowKind::surface || kind == HollowKind::standoff || kind == HollowKind::mixed;
  }
  void addStandoff(RandomShapes& random) {
    rt::Fixture& standoff = add(rt::FixtureKind::standoff, {}, random);
    standoff.clearance_m = random.between(0.002, 0.015);
    rig_.box.parameters().standoff_clearance_m = standoff.clearance_m;
  }
  /// A region around the start that keeps the hand inside; the hand is pressed towards a corner of it if it
  /// has some.
  void addHollow(HollowKind kind, RandomShapes& random) {
    rt::Shape shape{
        .position_m_in_world = start_, .axis_in_world = random.direction(), .rotation = random.rotation()};
    const double small_m = random.between(0.002, 0.02);
    if (kind == HollowKind::box || kind == HollowKind::solid) {
      shape.kind = rt::ShapeKind::box;
      shape.half_size_m = {small_m, random.between(0.002, 0.02), random.between(0.002, 0.02)};
      const bool edge = random.between(0, 1) < 0.4;
      outward_ = rotated(shape.rotation, Vec3{1, random.between(0.5, 2), edge ? 0 : random.between(0.5, 2)});
      outward_ = (1 / norm(outward_)) * outward_;
    } else if (kind == HollowKind::cone) {
      const double half_angle = random.between(0.15, 1.3);
      shape.kind = rt::ShapeKind::cone;
      shape.half_angle_sine = std::sin(half_angle);
      shape.half_angle_cosine = std::cos(half_angle);
      shape.position_m_in_world = start_ - small_m * shape.axis_in_world;
      outward_ = nextTo(shape.axis_in_world, random);
    } else {
      shape.kind = kind == HollowKind::sphere ? rt::ShapeKind::sphere : rt::ShapeKind::capsule;
      shape.radius_m = small_m;
      shape.length_m = random.between(0, 0.02);
    }
    if (kind != HollowKind::solid) {
      add(kindOf(shape.kind), shape, random).side = rt::FixtureSide::in;
      return;
    }
    rt::Fixture& solid = add(rt::FixtureKind::solid, shape, random);
    solid.side = rt::FixtureSide::in;
    solid.grid = anyGrid(random);
    // Somewhere in it, where there is room for the hand.
    Vec3 place;
    do place = random.place(0.015);
    while (distanceAt(solid.grid, place).distance_m > -0.001);
    solid.shape.position_m_in_world = start_ - rotated(shape.rotation, place);
  }
  /// Up to 16 members of all kinds but guidance that leave the start free, besides the live surface.
  void addMixed(RandomShapes& random) {
    FixtureRig shapes;
    const int count = static_cast<int>(random.between(0, 15));
    for (int i = 0; i < count; ++i) addAny(shapes, random, {});
    *set_ = *shapes.set;
    for (rt::Fixture& fixture : set_->fixtures) fixture.enabled = !rt::isGuidance(fixture.kind);
    for (std::size_t i = 0; i < set_->count; ++i) {
      rt::Fixture& fixture = set_->fixtures[i];
      fixture.shape.position_m_in_world += start_;
      for (std::size_t k = 0; k < fixture.element_count; ++k)
        set_->elements[fixture.first_element + k].start_m_in_world += start_;
    }
    addStandoff(random);
  }
};

struct Outcome {
  double gained_j = 0;        ///< most that the hand had more than at the start
  double before_m = 0;        ///< peak to peak, in the half second before two seconds
  double peak_to_peak_m = 0;  ///< after two seconds
  /// The same of a hand that creeps: how much longer its path is than its displacement. A hand without a
  /// spring goes on to where it is in balance as fast as its own damping lets it.
  double wander_m = 0;
  rt::Cause cause = rt::Cause::none;  ///< why the force was held at zero; none: it never was
};

Outcome press(PressedPlace& corner, const Case& c, RandomShapes& random) {
  const Vec3& out = corner.outward();
  Hand hand{.mass_kg = c.mass_kg,
            .stiffness_n_per_m = c.hand_n_per_m,
            .anchor_m = corner.point() - 0.015 * out + 0.003 * random.direction(),
            .push_n = c.hand_n_per_m > 0 ? Vec3{} : -0.8 * out,
            .place_m = corner.start(),
            .velocity_m_per_s = -0.1 * out + 0.05 * random.direction()};
  constexpr int kEngage = 600;
  const double jitter_s = c.poor ? 0.0025 : 0;
  const double loss = c.poor ? 0.05 : 0;
  Connection up(c.delay_s / 2, jitter_s, loss);
  Connection down(c.delay_s / 2, jitter_s, loss);
  const double delay_s = up.longestDelay_s() + down.longestDelay_s() + (c.poor ? kTick_s : 0);
  for (int i = 0; i < kEngage; ++i) corner.box().tick(hand.place_m, kTick_s, {}, delay_s);
  const double energy_j = hand.energy_j();
  Outcome outcome;
  Vec3 rested;
  Vec3 least;
  Vec3 most;
  double path_m = 0;
  constexpr int kTicks = 2500;
  constexpr int kRest = 2000;
  constexpr int kBefore = 1500;
  for (int tick = 0; tick < kTicks; ++tick) {
    up.send(tick, hand.place_m, hand.velocity_m_per_s, random);
    const Connection::Packet& state = up.received(tick);
    Vec3 command;
    if (state.number >= 0) {
      const rt::Tick result = corner.box().tick(state.first, kTick_s, state.second, delay_s);
      command = result.command_force_n_in_world;
      if (result.mode != rt::Mode::engaged) outcome.cause = result.cause;
    }
    down.send(tick, command, {}, random);
    const Vec3 before = hand.place_m;
    hand.move(down.received(tick).first);
    outcome.gained_j = std::max(outcome.gained_j, hand.energy_j() - energy_j);
    if (tick < kBefore) continue;
    const Vec3& p = hand.place_m;
    if (tick == kRest) outcome.before_m = norm(most - least);
    if (tick == kBefore || tick == kRest) rested = least = most = p;
    least = {std::min(least.x, p.x), std::min(least.y, p.y), std::min(least.z, p.z)};
    most = {std::max(most.x, p.x), std::max(most.y, p.y), std::max(most.z, p.z)};
    if (tick >= kRest) path_m += norm(p - before);
  }
  outcome.peak_to_peak_m = norm(most - least);
  outcome.wander_m = path_m - norm(hand.place_m - rested);
  return outcome;
}

class PassiveHand : public testing::TestWithParam<double> {
 protected:
  static void pressIntoCorners(bool with_surface, unsigned corners) {
    for (const double hand_n_per_m : {0.0, 60.0, 400.0}) {
      for (const double mass_kg : {0.045, 0.1, 0.3}) {
        for (const bool poor : {false, true}) {
          const Case c{hand_n_per_m, mass_kg, GetParam(), poor};
          for (unsigned seed = 1; seed <= corners; ++seed) {
            RandomShapes random(seed);
            Corner corner(random, with_surface);
            const Outcome outcome = press(corner, c, random);
            EXPECT_EQ(outcome.cause, rt::Cause::none) << nameOf(c) << ", corner " << seed;
            EXPECT_LE(outcome.gained_j, 1e-9) << nameOf(c) << ", corner " << seed;
            const double moving_m = hand_n_per_m > 0 ? outcome.peak_to_peak_m : outcome.wander_m;
            EXPECT_LT(moving_m, 1e-4) << nameOf(c) << ", corner " << seed;
          }
        }
      }
    }
  }
};

TEST_P(PassiveHand, ComesToRestInACornerOfRegionsAndGainsNothing) {
  pressIntoCorners(false, kMemoryOfSanitizer ? 2 : 30);
}
TEST_P(PassiveHand, ComesToRestBetweenARegionAndTheLiveSurfaceAndGainsNothing) {
  pressIntoCorners(true, kMemoryOfSanitizer ? 1 : 12);
}

class PassiveHandInAHollow : public testing::TestWithParam<int> {};

TEST_P(PassiveHandInAHollow, ComesToRestAndGainsNothing) {
  constexpr double kDelays_s[] = {0, 0.002, 0.005, 0.01, 0.02};
  const bool mixed = GetParam() == static_cast<int>(HollowKind::mixed);
  // of mixed sets so many that a share of one in a hundred is more than chance
  const unsigned hollows = kMemoryOfSanitizer ? 10 : mixed ? 1000 : 250;
  unsigned restless = 0;
  for (unsigned seed = 1; seed <= hollows; ++seed) {
    RandomShapes random(seed);
    const Case c{random.between(0, 1) < 0.7 ? 60.0 : 400.0, logBetween(random, 0.045, 0.3),
                 kDelays_s[seed % std::size(kDelays_s)], random.between(0, 1) < 0.3};
    Hollow hollow(random, HollowKind{static_cast<std::uint8_t>(GetParam())});
    const Outcome outcome = press(hollow, c, random);
    EXPECT_EQ(outcome.cause, rt::Cause::none) << nameOf(c) << ", hollow " << seed;
    EXPECT_LE(outcome.gained_j, 1e-9) << nameOf(c) << ", hollow " << seed;
    // Where several members act, the stiffness that the limit permits rises for seconds, and the hand with
    // it.
    const double moving_m = mixed ? outcome.wander_m : outcome.peak_to_peak_m;
    // A heavy hand without much of a lag to be damped swings longer than that.
    const bool fades = outcome.peak_to_peak_m < outcome.before_m / 2;
    if (moving_m < 1e-4 || fades) continue;
    ++restless;
    EXPECT_TRUE(mixed) << nameOf(c) << ", hollow " << seed << " moves by " << moving_m;
  }
  // What the limit permits may rise until the hand touches one more member, and fall again: 0.15 mm to and
  // fro.
  EXPECT_LE(restless, hollows / 100);
}

INSTANTIATE_TEST_SUITE_P(Kind, PassiveHandInAHollow, testing::Range(0, 8),
                         [](const auto& kind) { return kHollowNames[kind.param]; });

INSTANTIATE_TEST_SUITE_P(Delay, PassiveHand, testing::Values(0, 0.002, 0.005, 0.01, 0.02),
                         [](const auto& delay) {
                           return fmt::format("{}ms", std::lround(delay.param * 1e3));
                         });

// Random sets of fixtures, the live surface among them: the hand that goes round a closed path never gets
// more energy than it gave.

/// Work of a force on a hand along a path, by the trapezoidal rule with a bound of its error. Where the force
/// bends by K within a step dx the error is at most K dx^2 / 8, and where it steps by J at most J dx / 2;
/// both show in the second difference of the force, K dx or J.
class BoundedWork {
 public:
  void add(const Vec3& place_m, const Vec3& force_n) {
    if (samples_ > 0) {
      const double moved_m = norm(place_m - place_m_);
      const Vec3 change_n = force_n - force_n_;
      got_j_ += 0.5 * dot(force_n + force_n_, place_m - place_m_);
      const double bend_n = samples_ > 1 ? norm(change_n - change_n_) : norm(change_n);
      error_j_ += bend_n * moved_m / (bend_n > kStep_n ? 2 : 8);
      gained_j_ = std::max(gained_j_, got_j_ - error_j_);
      change_n_ = change_n;
    }
    place_m_ = place_m;
    force_n_ = force_n;
    ++samples_;
  }
  double got_j() const { return got_j_; }
  double error_j() const { return error_j_; }
  /// The most that the hand surely had got at any time.
  double gained_j() const { return gained_j_; }

 private:
  static constexpr double kStep_n = 0.05;  ///< several times what the stiffest spring bends by in a step
  int samples_ = 0;
  Vec3 place_m_;
  Vec3 force_n_;
  Vec3 change_n_;
  double got_j_ = 0;
  double error_j_ = 0;
  double gained_j_ = -std::numeric_limits<double>::infinity();
};

struct SeenScene {
  SceneKind scene;
  const char* name;
  bool with_law;  ///< the law's own force counts too
};

class LiveSet : public testing::TestWithParam<SeenScene> {
 protected:
  LiveSet()
      : scene_({.kind = GetParam().scene, .distance_m = kDistance_m, .tilt_rad = 0.2, .radius_m = 0.1},
               fineCameraFor(kDistance_m)) {
    const auto approach = scene_.approach(0);
    surface_m_ = approach.surface_m_in_world;
    outward_ = -1 * approach.inward_in_world;
    if (GetParam().scene == SceneKind::inner_corner) surface_m_ += Vec3{0, 0, 0.02};
  }

  /// Adds stand-offs and shapes that exert no force at the HIP's start, 25 mm before the surface.
  static std::unique_ptr<rt::FixtureSet> anySet(RandomShapes& random, const Vec3& start) {
    FixtureRig shapes;
    shapes.parameters.force.stiffness_n_per_m = 15'000;
    const int count = static_cast<int>(random.between(0, 8));
    for (int i = 0; i < count; ++i) addAny(shapes, random, {});
    const int standoffs = 1 + static_cast<int>(random.between(0, 3));
    for (int i = 0; i < standoffs; ++i) {
      rt::Fixture& standoff = shapes[shapes.add(rt::FixtureKind::standoff, {}, logBetween(random, 20, 3000))];
      standoff.clearance_m = random.between(0.002, 0.02);
      standoff.max_force_n = logBetween(random, 0.2, 20);
    }
    auto set = std::make_unique<rt::FixtureSet>(*shapes.set);
    for (std::size_t i = 0; i < set->count; ++i) {
      rt::Fixture& fixture = set->fixtures[i];
      fixture.shape.position_m_in_world += start;
      for (std::size_t k = 0; k < fixture.element_count; ++k)
        set->elements[fixture.first_element + k].start_m_in_world += start;
    }
    return set;
  }

  TrueScene scene_;
  Vec3 surface_m_;
  Vec3 outward_;
};

TEST_P(LiveSet, GivesTheHandNoMoreThanItGot) {
  constexpr unsigned kSets = kMemoryOfSanitizer ? 3 : 30;
  constexpr int kSteps = 40'000;
  int pressed = 0;
  double worst_j = -std::numeric_limits<double>::infinity();
  double largest_error_j = 0;
  for (unsigned seed = 1; seed <= kSets; ++seed) {
    RandomShapes random(seed);
    HardRig rig(rt::ForceLaw::surface, scene_.depthModel());
    rt::LiveParameters& parameters = rig.box.parameters();
    parameters.safety.contact_damping = rt::ContactDamping::off;
    parameters.safety.stiffness_limit = rt::StiffnessLimit::off;
    parameters.safety.passivity_control = false;
    parameters.standoff_clearance_m = 0.02;
    const Vec3 start = surface_m_ + 0.025 * outward_;
    const auto set = anySet(random, start);
    rig.box.setAdditions(set.get(), nullptr);
    rig.show(scene_);
    const ClosedPath path(random, start);
    // Half the size, so that the hand stays within reach of the surface.
    const auto placeAt = [&](int step) {
      return start + 0.5 * (path.at(static_cast<double>(step) / kSteps) - start);
    };
    for (int i = 0; i < 5; ++i) rig.tick(start);
    BoundedWork work;
    double least_j = 0;
    for (int step = 0; step <= kSteps; ++step) {
      const Vec3 place = placeAt(step);
      const rt::Tick tick = rig.tick(place);
      const Vec3 of_law = GetParam().with_law ? tick.law_force_n_in_world : Vec3{};
      work.add(place, of_law + tick.fixture_force_n_in_world + tick.guidance_force_n_in_world);
      least_j = std::min(least_j, work.got_j());
    }
    EXPECT_LE(work.gained_j(), 1e-6) << "set " << seed << ", path integrated within " << work.error_j();
    worst_j = std::max(worst_j, work.gained_j());
    largest_error_j = std::max(largest_error_j, work.error_j());
    if (least_j < -1e-3) ++pressed;
  }
  EXPECT_GT(pressed, kSets / 2) << "most hands press on something";
  EXPECT_LT(largest_error_j, 1e-3);
  RecordProperty("most_gained_uj", std::to_string(1e6 * worst_j));
}

// The law's force on a curved surface comes from patches of what the camera sees and is no exact gradient:
// alone it gives up to 1e-5 J on a ball and 8e-5 J in a bowl. What is over it has to hold there as well.
INSTANTIATE_TEST_SUITE_P(Scenes, LiveSet,
                         testing::Values(SeenScene{SceneKind::plane, "Plane", true},
                                         SeenScene{SceneKind::inner_corner, "InnerCorner", true},
                                         SeenScene{SceneKind::bowl, "Bowl", false},
                                         SeenScene{SceneKind::sphere, "Ball", false}),
                         [](const auto& scene) { return scene.param.name; });

}  // namespace
}  // namespace hapticd::test
