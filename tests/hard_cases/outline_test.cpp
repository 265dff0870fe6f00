// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <ostream>
#include <random>

#include "rt/laws/force_blend.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/occluded_scene.h"

// The law `surface` at the outlines and sides of bodies.
namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::OccludedMoment;
using tools::OccludedSceneParameters;
using tools::OccluderShape;
using tools::SceneNoise;

constexpr double kTick_s = 0.001;
constexpr long kSettle_ticks = 400;  // twelve frames
constexpr double kBackground_m = 0.35;
constexpr double kRow_m = 0.0117;  // off the lattice of pixels

/// A shipped box that looks at a scene, tick by tick, and what of the law's force is to be bounded.
class Watched {
 public:
  Watched(const OccludedSceneParameters& body, double wall_m, SceneNoise noise, std::uint32_t seed,
          const std::function<OccludedMoment(long tick)>& moment)
      : camera_(cameraFor(body, wall_m, noise)),
        scene_(body, camera_, noise, seed),
        box_(tools::shippedBox("surface", wall_m, camera_)),
        player_(*box_,
                tools::renderedStream([this, moment](long tick, std::uint64_t number, rt::DepthFrame& frame) {
                  scene_.render(moment(tick), number, frame);
                })) {}

  Vec3 force_n(const Vec3& hip) {
    const long number = player_.nextTick();
    const Vec3 force = player_.tick(hip).law_force_n_in_world;
    const double step_n = norm(force - force_before_);
    if (number > 0) {
      const double hip_step_n = stiffness_n_per_m() * norm(hip - hip_before_);
      if (!player_.frameIsNew()) beyond_hand_n_ = std::max(beyond_hand_n_, step_n - 3 * hip_step_n);
      fall_n_ = std::max(fall_n_, norm(force_before_) - norm(force) - 3 * hip_step_n);
    }
    largest_n_ = std::max(largest_n_, norm(force));
    force_before_ = force;
    hip_before_ = hip;
    return force;
  }

  double stiffness_n_per_m() const { return box_->parameters().force.stiffness_n_per_m; }
  double pitch_m(double depth_m) const { return depth_m / camera_.fx_px; }
  /// Largest step of the force between two ticks of one frame, beyond three times what the HIP's motion
  /// makes: a proxy that slides on a curved surface moves farther than the HIP.
  double beyondHand_n() const { return beyond_hand_n_; }
  /// Largest fall of the force in one tick, of a new frame as well, beyond the same.
  double fall_n() const { return fall_n_; }
  double largest_n() const { return largest_n_; }
  /// What the law allows itself in a tick without a motion of the hand: the proxy, and the place that the
  /// spring pulls to, each move by no more than the fastest surface.
  double allowance_n() const { return 2 * stiffness_n_per_m() * rt::kFastestSurface_m_per_s * kTick_s; }

 private:
  static rt::DepthModelParameters cameraFor(const OccludedSceneParameters& body, double wall_m,
                                            SceneNoise noise) {
    constexpr double kBefore_m = 0.15;
    if (noise != SceneNoise::none) return {};
    return tools::fineDepthModel(wall_m - kBefore_m, std::max(wall_m, body.background_m) + 0.1);
  }

  rt::DepthModelParameters camera_;
  tools::OccludedScene scene_;
  std::unique_ptr<tools::OfflineBox> box_;
  tools::FramePlayer player_;
  Vec3 force_before_;
  Vec3 hip_before_;
  double beyond_hand_n_ = 0;
  double fall_n_ = 0;
  double largest_n_ = 0;
};

/// A block beside the optical axis, and the random numbers of a test.
struct Block {
  double wall_m;
  bool visible_side;  ///< the camera sees its side at a grazing angle
  SceneNoise noise;
  std::uint32_t seed;

  double edge_m() const { return 0.1 * wall_m; }
  double inward() const { return visible_side ? 1 : -1; }
  OccludedSceneParameters body() const {
    OccludedSceneParameters body;
    body.background_m = wall_m + kBackground_m;
    (visible_side ? body.left_m : body.right_m) = edge_m();
    return body;
  }
  Vec3 at(double inside_m, double below_m, double row_m = kRow_m) const {
    return {edge_m() + inward() * inside_m, row_m, -(wall_m + below_m)};
  }
  Watched watched() const {
    return {body(), wall_m, noise, seed, [wall = wall_m](long) { return OccludedMoment{.wall_m = wall}; }};
  }
};

class Dice {
 public:
  explicit Dice(std::uint32_t seed) : random_(seed) {}
  double between(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  bool coin() { return between(0, 1) < 0.5; }
  std::uint32_t seed() { return static_cast<std::uint32_t>(random_()); }
  SceneNoise noise() {
    const double value = between(0, 3);
    return value < 1 ? SceneNoise::none : value < 2 ? SceneNoise::sensor : SceneNoise::harsh;
  }
  Block block(double farthest_m = 2) { return {between(0.6, farthest_m), coin(), noise(), seed()}; }

 private:
  std::mt19937 random_;
};

std::ostream& operator<<(std::ostream& out, const Block& block) {
  return out << "block at " << block.wall_m << " m, " << (block.visible_side ? "visible" : "hidden")
             << " side, noise " << nameOf(block.noise) << ", seed " << block.seed;
}

TEST(Outline, AHandThatEntersFromTheSideIsPushedOutOfTheSide) {
  Dice dice(1);
  for (int i = 0; i < 12; ++i) {
    Block block = dice.block(1.6);
    // The camera measures a visible side as a surface; noise rounds its edge.
    if (block.visible_side) block.noise = SceneNoise::none;
    const double below_m = dice.between(0.008, 0.025);
    const double speed_m_per_s = dice.between(0.05, 0.5);
    SCOPED_TRACE(testing::Message() << block << ", " << below_m << " m below, " << speed_m_per_s << " m/s");
    Watched hand = block.watched();
    constexpr double kOutside_m = 0.02;
    constexpr double kInside_m = 0.035;
    const long ticks = kSettle_ticks + std::lround((kOutside_m + kInside_m) / speed_m_per_s / kTick_s);
    // The outline is known to two pixels. A hidden side is taken to extend along the line of sight.
    const double unsure_m = 2 * hand.pitch_m(block.wall_m) + below_m * block.edge_m() / block.wall_m + 0.001;
    for (long tick = 0; tick <= ticks; ++tick) {
      const double moved_m =
          speed_m_per_s * kTick_s * static_cast<double>(std::max(0L, tick - kSettle_ticks));
      const double inside_m = moved_m - kOutside_m;
      const Vec3 force = hand.force_n(block.at(inside_m, below_m));
      if (inside_m < -unsure_m) {
        ASSERT_LE(norm(force), 0.1) << inside_m;
      }
      // as long as the side is nearer than the front for certain
      constexpr double kFrontNoise_m = 0.004;
      if (inside_m < unsure_m || inside_m > below_m - unsure_m - kFrontNoise_m) continue;
      const double cosine = -block.inward() * force.x / std::max(1e-9, norm(force));
      ASSERT_GE(cosine, std::cos(std::numbers::pi / 6)) << inside_m << " m inside";
      ASSERT_NEAR(norm(force), hand.stiffness_n_per_m() * inside_m, hand.stiffness_n_per_m() * unsure_m);
    }
    EXPECT_LE(hand.beyondHand_n(), hand.allowance_n());
    // The front is nearer in the end.
    EXPECT_GE(hand.largest_n(), 0.5 * hand.stiffness_n_per_m() * below_m);
  }
}

TEST(Outline, AHandThatMovesAboutAnOutlineFeelsNoStepWithinAFrame) {
  Dice dice(2);
  for (int i = 0; i < 16; ++i) {
    const Block block = dice.block();
    const double speed_m_per_s = dice.between(0.02, 0.5);
    SCOPED_TRACE(testing::Message() << block << ", " << speed_m_per_s << " m/s");
    Watched hand = block.watched();
    Vec3 hip = block.at(dice.between(-0.02, 0.02), -0.03);
    for (long tick = 0; tick < kSettle_ticks; ++tick) hand.force_n(hip);
    for (int leg = 0; leg < 8; ++leg) {
      const Vec3 to =
          block.at(dice.between(-0.02, 0.02), dice.between(-0.01, 0.025), kRow_m + dice.between(-0.02, 0.02));
      const Vec3 from = hip;
      const long ticks = std::max(1L, std::lround(norm(to - from) / speed_m_per_s / kTick_s));
      for (long tick = 1; tick <= ticks; ++tick) {
        hip = from + (static_cast<double>(tick) / static_cast<double>(ticks)) * (to - from);
        hand.force_n(hip);
      }
    }
    EXPECT_LE(hand.beyondHand_n(), hand.allowance_n());
  }
}

TEST(Outline, ASurfaceWhoseOutlinePassesOverAPressingHandLetsGoSlowly) {
  Dice dice(3);
  for (int i = 0; i < 12; ++i) {
    const Block block{1, true, dice.noise(), dice.seed()};
    constexpr double kSpeed_m_per_s = 0.1;
    constexpr double kComing_m = 0.06;
    constexpr double kBefore_m = 0.02;
    const auto wallAt = [&](long tick) {
      const double moved_m =
          kSpeed_m_per_s * kTick_s * static_cast<double>(std::max(0L, tick - kSettle_ticks));
      return OccludedMoment{.wall_m = block.wall_m - std::min(kComing_m, moved_m)};
    };
    Watched hand(block.body(), block.wall_m, block.noise, block.seed, wallAt);
    const double inside_m = dice.between(0.9, 2.4) * hand.pitch_m(block.wall_m);
    SCOPED_TRACE(testing::Message() << block << ", " << inside_m << " m inside");
    const Vec3 hip = block.at(inside_m, -kBefore_m);
    const long ticks = kSettle_ticks + std::lround(kComing_m / kSpeed_m_per_s / kTick_s);
    for (long tick = 0; tick < ticks; ++tick) hand.force_n(hip);
    EXPECT_GT(hand.largest_n(), 1) << "it presses";
    // From all of a contact to none in three frames; noise of the surface comes on top of it.
    EXPECT_LE(hand.fall_n(), hand.largest_n() / 100 + hand.allowance_n());
  }
}

TEST(Outline, ABodyThatPassesBeforeAFreeHandDoesNotMoveIt) {
  Dice dice(4);
  for (int i = 0; i < 16; ++i) {
    const double wall_m = dice.coin() ? 1 : 2;
    constexpr double kInFront_m = 0.03;  // of the wall
    const double gap_m = dice.between(0.02, 0.1);
    OccludedSceneParameters body;
    body.occluder = dice.coin() ? OccluderShape::box : OccluderShape::elliptic_cylinder;
    body.thickness_m = dice.coin() ? 0.02 : 0.08;
    body.width_m = body.occluder == OccluderShape::box ? 0.08 : body.thickness_m;
    body.back_m = wall_m - kInFront_m - gap_m;
    body.projector_shadow = true;
    const double speed_m_per_s = (dice.coin() ? 1 : -1) * dice.between(0.1, 0.6);
    const SceneNoise noise = dice.coin() ? SceneNoise::harsh : SceneNoise::sensor;
    SCOPED_TRACE(testing::Message() << (body.occluder == OccluderShape::box ? "plate" : "arm") << " of "
                                    << body.thickness_m << " m, " << gap_m << " m before the hand at "
                                    << wall_m << " m, " << speed_m_per_s << " m/s, noise " << nameOf(noise));
    const Vec3 hip{0.0213, kRow_m, -(wall_m - kInFront_m)};
    constexpr double kStart_m = 0.12;
    const double line_of_sight_m = hip.x * (body.back_m - body.thickness_m / 2) / -hip.z;
    const long passing = std::lround(2 * kStart_m / std::abs(speed_m_per_s) / kTick_s);
    const auto moment = [=](long tick) {
      const double moved_m =
          speed_m_per_s * kTick_s * static_cast<double>(std::clamp(tick - kSettle_ticks, 0L, passing));
      const double start_m = std::copysign(kStart_m, speed_m_per_s);
      return OccludedMoment{.wall_m = wall_m, .occluder_x_m = line_of_sight_m - start_m + moved_m};
    };
    Watched hand(body, wall_m, noise, dice.seed(), moment);
    for (long tick = 0; tick < kSettle_ticks + passing; ++tick) hand.force_n(hip);
    EXPECT_LE(hand.largest_n(), 0.1);
  }
}

/// Pushes a hand in by 40 mm along its line of sight, `beside_px` inside the outline. Returns the force in
/// the end.
double pushed_n(const Block& block, double beside_px, double speed_m_per_s) {
  constexpr double kFrom_m = -0.03;
  constexpr double kTo_m = 0.04;
  Watched hand = block.watched();
  const Vec3 foot = block.at(beside_px * hand.pitch_m(block.wall_m), 0);
  const long ticks = kSettle_ticks + std::lround((kTo_m - kFrom_m) / speed_m_per_s / kTick_s);
  Vec3 force;
  for (long tick = 0; tick <= ticks; ++tick) {
    const double moved_m = speed_m_per_s * kTick_s * static_cast<double>(std::max(0L, tick - kSettle_ticks));
    force = hand.force_n(((block.wall_m + kFrom_m + moved_m) / block.wall_m) * foot);
  }
  return beside_px > 0 ? force.z : hand.largest_n();
}

TEST(Outline, APushThreePixelsInsideItHolds) {
  Dice dice(5);
  for (int i = 0; i < 16; ++i) {
    Block block = dice.block();
    if (block.noise == SceneNoise::none) block.noise = SceneNoise::sensor;
    const double beside_px = dice.between(3, 8);
    const double speed_m_per_s = dice.between(0.05, 0.5);
    // 20 N at 500 N/m; noise at 2 m is some 10 mm
    EXPECT_GE(pushed_n(block, beside_px, speed_m_per_s), 10)
        << block << ", " << beside_px << " px inside, " << speed_m_per_s << " m/s";
  }
}

TEST(Outline, APushFourPixelsOutsideItFeelsNothing) {
  Dice dice(6);
  for (int i = 0; i < 16; ++i) {
    Block block = dice.block();
    const double beside_px = -dice.between(4, 10);
    const double speed_m_per_s = dice.between(0.05, 0.5);
    EXPECT_LE(pushed_n(block, beside_px, speed_m_per_s), 0.1)
        << block << ", " << beside_px << " px inside, " << speed_m_per_s << " m/s";
  }
}

}  // namespace
}  // namespace hapticd::test
