// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/hard_cases/hard_rig.h"
#include "tests/unit/rt/fixture_rig.h"

// Passive hands that are pressed into random corners of forbidden regions and the live surface, over a
// connection that delays, jitters and loses packets.
namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;

constexpr double kDistance_m = 1;
constexpr double kDevice_kg = 0.045;

/// One direction of a connection. Packets arrive late, not at all, or after newer ones, which then count.
class Connection {
 public:
  Connection(double delay_s, double jitter_s, double loss)
      : delay_s_(delay_s), jitter_s_(jitter_s), loss_(loss) {}

  struct Packet {
    int number = -1;
    Vec3 first;
    Vec3 second;
  };

  void send(int tick, const Vec3& first, const Vec3& second, RandomShapes& random) {
    const double delay_s = delay_s_ + random.between(0, 1) * jitter_s_;
    if (random.between(0, 1) < loss_) return;
    flying_.push_back({tick + static_cast<int>(std::ceil(delay_s / kTick_s - 1e-9)), {tick, first, second}});
  }
  const Packet& received(int tick) {
    std::erase_if(flying_, [&](const Flying& flying) {
      if (flying.arrives > tick) return false;
      if (flying.packet.number > newest_.number) newest_ = flying.packet;
      return true;
    });
    return newest_;
  }
  /// Whole ticks, as the other side counts them.
  double longestDelay_s() const { return std::ceil((delay_s_ + jitter_s_) / kTick_s - 1e-9) * kTick_s; }

 private:
  struct Flying {
    int arrives;
    Packet packet;
  };
  double delay_s_;
  double jitter_s_;
  double loss_;
  std::vector<Flying> flying_;
  Packet newest_;
};

/// A device in a hand: a mass on a spring to where the hand wants to be, or without a spring pushed by 0.8 N.
/// It damps with 0.5 N s/m at least, 60 N/m do so too, and stiffer hands in proportion. Heavier ones damp as
/// much as makes them rest within two seconds by themselves: along a wall nothing else does.
struct Hand {
  double mass_kg;
  double stiffness_n_per_m;
  Vec3 anchor_m;
  Vec3 push_n;
  Vec3 place_m;
  Vec3 velocity_m_per_s;

  double damping_n_s_per_m() const { return std::max({0.5, stiffness_n_per_m / 120, 8 * mass_kg}); }
  double energy_j() const {
    const Vec3 off = place_m - anchor_m;
    return 0.5 * mass_kg * dot(velocity_m_per_s, velocity_m_per_s) + 0.5 * stiffness_n_per_m * dot(off, off) -
           dot(push_n, place_m);
  }
  void move(const Vec3& force_n) {
    constexpr int kSteps = 10;
    for (int i = 0; i < kSteps; ++i) {
      const Vec3 total_n = force_n + push_n - stiffness_n_per_m * (place_m - anchor_m) -
                           damping_n_s_per_m() * velocity_m_per_s;
      velocity_m_per_s += (kTick_s / kSteps / mass_kg) * total_n;
      place_m += (kTick_s / kSteps) * velocity_m_per_s;
    }
  }
};

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
    rig_.box.parameters().springs.stiffness_n_per_m = logBetween(random, 50, 2000);
    rig_.box.parameters().handle.device_mass_kg = kDevice_kg;
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
    const Vec3 command =
        state.number < 0
            ? Vec3{}
            : corner.box().tick(state.first, kTick_s, state.second, delay_s).command_force_n_in_world;
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
  pressIntoCorners(false, 30);
}
TEST_P(PassiveHand, ComesToRestBetweenARegionAndTheLiveSurfaceAndGainsNothing) {
  pressIntoCorners(true, 12);
}

INSTANTIATE_TEST_SUITE_P(Delay, PassiveHand, testing::Values(0, 0.002, 0.005, 0.01, 0.02),
                         [](const auto& delay) {
                           return fmt::format("{}ms", std::lround(delay.param * 1e3));
                         });

}  // namespace
}  // namespace hapticd::test
