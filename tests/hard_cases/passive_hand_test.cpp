// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/hard_cases/hard_rig.h"
#include "tests/support/passive_hand.h"
#include "tests/support/sanitizer.h"
#include "tests/unit/rt/fixtures/fixture_rig.h"

// Passive hands that are pressed into random corners of forbidden regions and the live surface, over a
// connection that delays, jitters and loses packets.
namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;

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

/// Two or three planes that meet in a point, the live surface among them where there is one.
class Corner {
 public:
  Corner(RandomShapes& random, bool with_surface)
      : scene_({.kind = SceneKind::plane, .distance_m = kDistance_m, .tilt_rad = random.between(-0.4, 0.4)},
               fineCameraFor(kDistance_m)),
        rig_(with_surface ? rt::ForceLaw::surface : rt::ForceLaw::nearest_springs, scene_.depthModel()) {
    rig_.box.parameters().force.stiffness_n_per_m = logBetween(random, 50, 2000);
    rig_.box.start().device_mass_kg = kDevice_kg;
    rig_.show(scene_);
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
    rig_.box.setAdditions(set_.get(), nullptr);
  }

  const Vec3& point() const { return point_; }
  const Vec3& outward() const { return outward_; }
  tools::OfflineBox& box() { return rig_.box; }

 private:
  static double logBetween(RandomShapes& random, double least, double most) {
    return std::exp(random.between(std::log(least), std::log(most)));
  }
  /// A direction at up to 60 degrees from another one.
  static Vec3 nextTo(const Vec3& other, RandomShapes& random) {
    Vec3 direction = random.direction();
    while (dot(direction, other) < 0.5) direction = random.direction();
    return direction;
  }
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
    rt::Fixture& plane = set_->fixtures[set_->count++];
    plane.kind = rt::FixtureKind::plane;
    plane.identity = set_->count;
    plane.definition = set_->count;
    plane.shape.kind = rt::ShapeKind::plane;
    plane.shape.position_m_in_world = point_;
    plane.shape.axis_in_world = normal;
    plane.stiffness_n_per_m = logBetween(random, 100, 5000);
    plane.max_force_n = logBetween(random, 1, 20);
    ++set_->generation;
  }

  TrueScene scene_;
  HardRig rig_;
  std::unique_ptr<rt::FixtureSet> set_ = std::make_unique<rt::FixtureSet>();
  Vec3 point_;
  std::vector<Vec3> normals_;
  Vec3 outward_;
};

struct Outcome {
  double gained_j = 0;        ///< most that the hand had more than at the start
  double peak_to_peak_m = 0;  ///< after two seconds
  /// The same of a hand that creeps: how much longer its path is than its displacement. A hand without a
  /// spring goes on to where it is in balance as fast as its own damping lets it.
  double wander_m = 0;
  rt::Cause cause = rt::Cause::none;  ///< why the force was held at zero; none: it never was
};

Outcome press(Corner& corner, const Case& c, RandomShapes& random) {
  const Vec3& out = corner.outward();
  Hand hand{.mass_kg = c.mass_kg,
            .stiffness_n_per_m = c.hand_n_per_m,
            .anchor_m = corner.point() - 0.015 * out + 0.003 * random.direction(),
            .push_n = c.hand_n_per_m > 0 ? Vec3{} : -0.8 * out,
            .place_m = corner.point() + 0.01 * out,
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
    if (tick < kRest) continue;
    const Vec3& p = hand.place_m;
    if (tick == kRest) rested = least = most = p;
    least = {std::min(least.x, p.x), std::min(least.y, p.y), std::min(least.z, p.z)};
    most = {std::max(most.x, p.x), std::max(most.y, p.y), std::max(most.z, p.z)};
    path_m += norm(p - before);
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

INSTANTIATE_TEST_SUITE_P(Delay, PassiveHand, testing::Values(0, 0.002, 0.005, 0.01, 0.02),
                         [](const auto& delay) {
                           return fmt::format("{}ms", std::lround(delay.param * 1e3));
                         });

}  // namespace
}  // namespace hapticd::test
