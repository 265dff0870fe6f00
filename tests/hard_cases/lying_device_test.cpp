// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <string>

#include "drivers/handle/handle_frame.h"
#include "tests/rt/core_rig.h"
#include "tests/support/passive_hand.h"

// Devices whose velocity contradicts their positions, and whose forces act later than they say, in passive
// hands that are pressed into a region.
namespace hapticd::test {
namespace {

using rt::Cause;
using rt::Vec3;

constexpr double kEncoder_m = 55e-6;

/// What a device claims of its velocity.
enum class Claim : std::uint8_t {
  truth,
  nothing,
  wrong_sign,
  millimetres,
  zero,
  five_times,
  noise,
  constant,
  late,  ///< filtered, as devices do; no lie that the positions contradict
};
constexpr const char* kClaims[] = {
    "the truth",  "nothing",        "the wrong sign", "millimetres per second", "zero",
    "five times", "noise of 1 m/s", "-5 m/s",         "a mean over 20 ms"};

/// A device and the driver that reads it.
class Device {
 public:
  Device(Claim claim, unsigned seed)
      : claim_(claim), random_(seed), frame_(settings(), rt::HandleScaleParameters{}) {
    frame_.beginSession();
  }

  rt::HandleState measure(const Hand& hand, std::int64_t time_ns) {
    const auto rounded = [](double x) { return kEncoder_m * std::round(x / kEncoder_m); };
    const Vec3& p = hand.place_m;
    return frame_.stateOf({.position_m_in_handle = {rounded(p.x), rounded(p.y), rounded(p.z)},
                           .time_ns = time_ns,
                           .velocity_m_per_s_in_handle = claimed(hand.velocity_m_per_s),
                           .over_link = true});
  }

 private:
  static config::HandleSettings settings() {
    config::HandleSettings settings;
    settings.resolution_m = kEncoder_m;
    return settings;
  }
  std::optional<Vec3> claimed(const Vec3& v) {
    switch (claim_) {
      case Claim::truth:
        return v;
      case Claim::nothing:
        return std::nullopt;
      case Claim::wrong_sign:
        return -v;
      case Claim::millimetres:
        return 1000 * v;
      case Claim::zero:
        return Vec3{};
      case Claim::five_times:
        return 5 * v;
      case Claim::noise:
        return v + random_.place(1);
      case Claim::constant:
        break;
      case Claim::late:
        past_.push_back(v);
        if (past_.size() > kWindow) past_.pop_front();
        return (1.0 / static_cast<double>(past_.size())) *
               std::accumulate(past_.begin(), past_.end(), Vec3{});
    }
    return Vec3{0, 0, -5};
  }

  static constexpr std::size_t kWindow = 20;

  Claim claim_;
  std::deque<Vec3> past_;  // velocities
  RandomShapes random_;
  drivers::HandleFrame frame_;
};

struct Outcome {
  double given_j = 0;         ///< most energy that the hand has got
  bool contradicted = false;  ///< the device was found out
  Cause held = Cause::none;   ///< why the force was held at zero
  double hidden_latency_s = 0;
};

struct Case {
  Claim claim;
  double latency_s;
  double hand_n_per_m;
  double mass_kg;
  double stiffness_n_per_m;
  bool held_at_first = false;  ///< rigidly, until the knock is over
};
std::string nameOf(const Case& c) {
  return fmt::format("claims {}, {} ms late, hand of {} N/m and {} g, region of {} N/m",
                     kClaims[static_cast<std::size_t>(c.claim)], c.latency_s * 1e3, c.hand_n_per_m,
                     c.mass_kg * 1e3, c.stiffness_n_per_m);
}

/// Engages in free space, with a hand that goes to and fro meanwhile, and presses into the region for three
/// seconds.
Outcome press(const Case& c) {
  FixtureCore core;
  rt::LiveParameters& parameters = core.rig.directive.parameters;
  parameters.force.stiffness_n_per_m = 500;
  parameters.safety.max_slew_n_per_s = 2000;
  rt::Fixture& plane = core.add(rt::FixtureKind::plane, floor(-0.01));
  plane.stiffness_n_per_m = c.stiffness_n_per_m;
  plane.max_force_n = 4;
  core.rig.directive.engage = true;
  const Vec3 origin = core.origin;
  Hand hand{.mass_kg = c.mass_kg,
            .stiffness_n_per_m = c.hand_n_per_m,
            .anchor_m = origin,
            .push_n = {},
            .place_m = origin,
            .velocity_m_per_s = {}};
  Device device(c.claim, 1);
  Connection forces(c.latency_s, 0, 0);
  RandomShapes random(1);
  Outcome outcome;
  double given_j = 0;
  constexpr int kFree = 900;
  constexpr int kTicks = 3900;
  for (int tick = 0; tick < kTicks; ++tick) {
    if (tick < kFree) {
      hand.anchor_m = origin + Vec3{0.01 * std::sin(0.008 * tick), 0, 0};
    } else {
      hand.anchor_m = origin + Vec3{0, 0, -0.022};
      if (!(c.hand_n_per_m > 0)) hand.push_n = {0, 0, -1.2};
    }
    core.rig.handle = device.measure(hand, core.rig.now_ns + kPeriod_ns);
    const rt::Tick result = core.rig.step();
    forces.send(tick, result.command_force_n_in_world, {}, random);
    const Vec3 before = hand.place_m;
    const Vec3 force = forces.received(tick).first;
    if (!c.held_at_first || tick >= kFree) hand.move(force);
    given_j += dot(force, hand.place_m - before);
    outcome.given_j = std::max(outcome.given_j, given_j);
    outcome.contradicted =
        outcome.contradicted || result.handle.velocity_claim == rt::VelocityClaim::contradicted;
    outcome.hidden_latency_s = result.hidden_latency_s;
    if (result.mode != rt::Mode::holding) continue;
    outcome.held = result.cause;
    break;
  }
  return outcome;
}

class LyingDevice : public testing::TestWithParam<Claim> {};

TEST_P(LyingDevice, GivesTheHandLittleAndIsNamed) {
  const bool lies = GetParam() != Claim::truth && GetParam() != Claim::nothing && GetParam() != Claim::late;
  double most_j = 0;
  for (const double latency_s : {0.0, 0.002, 0.005, 0.01, 0.02}) {
    for (const double hand_n_per_m : {0.0, 60.0, 400.0}) {
      for (const double mass_kg : {0.045, 0.1, 0.3}) {
        for (const double stiffness_n_per_m : {300.0, 1000.0}) {
          const Case c{GetParam(), latency_s, hand_n_per_m, mass_kg, stiffness_n_per_m};
          const Outcome outcome = press(c);
          most_j = std::max(most_j, outcome.given_j);
          EXPECT_LE(outcome.given_j, 0.05) << nameOf(c);
          EXPECT_EQ(outcome.contradicted, lies) << nameOf(c);
          if (!lies) {
            EXPECT_EQ(outcome.held, Cause::none) << nameOf(c);
          }
          if (outcome.held != Cause::none) {
            EXPECT_EQ(outcome.held, Cause::handle_inconsistent) << nameOf(c);
          } else if (latency_s >= 0.002) {
            EXPECT_NEAR(outcome.hidden_latency_s, latency_s, 0.002) << nameOf(c);
          } else {
            EXPECT_LE(outcome.hidden_latency_s, latency_s + 0.002) << nameOf(c);
          }
        }
      }
    }
  }
  RecordProperty("most_mj", fmt::format("{:.1f}", most_j * 1e3));
}

// The knock cannot tell how late its forces act, so the longest latency counts.
TEST(HeldDevice, GivesTheHandLittleAlthoughItsLatencyIsHidden) {
  for (const double latency_s : {0.0, 0.005, 0.01, 0.02, 0.05}) {
    for (const double hand_n_per_m : {0.0, 60.0, 400.0}) {
      for (const double mass_kg : {0.045, 0.3}) {
        const Case c{Claim::nothing, latency_s, hand_n_per_m, mass_kg, 1000, true};
        const Outcome outcome = press(c);
        EXPECT_LE(outcome.given_j, 0.05) << nameOf(c);
        EXPECT_EQ(outcome.held, Cause::none) << nameOf(c);
        EXPECT_NEAR(outcome.hidden_latency_s, 0.06, 0.002) << nameOf(c);
      }
    }
  }
}

// Configured with 45 g: the knock shows that it is lighter.
TEST(LighterDevice, GivesTheHandLittle) {
  double most_j = 0;
  for (const double latency_s : {0.0, 0.005, 0.01, 0.02}) {
    for (const double hand_n_per_m : {0.0, 60.0, 400.0}) {
      for (const double stiffness_n_per_m : {300.0, 1000.0}) {
        const Case c{Claim::nothing, latency_s, hand_n_per_m, 0.01, stiffness_n_per_m};
        const Outcome outcome = press(c);
        most_j = std::max(most_j, outcome.given_j);
        EXPECT_LE(outcome.given_j, 0.05) << nameOf(c);
        EXPECT_EQ(outcome.held, Cause::none) << nameOf(c);
      }
    }
  }
  RecordProperty("most_mj", fmt::format("{:.1f}", most_j * 1e3));
}

INSTANTIATE_TEST_SUITE_P(Claims, LyingDevice,
                         testing::Values(Claim::truth, Claim::nothing, Claim::wrong_sign, Claim::millimetres,
                                         Claim::zero, Claim::five_times, Claim::noise, Claim::constant,
                                         Claim::late),
                         [](const auto& claim) {
                           std::string name = kClaims[static_cast<std::size_t>(claim.param)];
                           std::erase_if(name,
                                         [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
                           return name;
                         });

}  // namespace
}  // namespace hapticd::test
