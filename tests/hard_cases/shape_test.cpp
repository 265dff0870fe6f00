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
#include "tests/hard_cases/hard_rig.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/strokes/strokes.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/occluded_scene.h"

namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::OccludedMoment;
using tools::OccludedSceneParameters;
using tools::OccluderShape;
using tools::SceneKind;
using tools::SceneNoise;
using tools::TrueScene;
using tools::TrueSceneParameters;

// Shapes that are difficult for force laws: hollows, edges, thin plates, corners, steps.

constexpr double kDistance_m = 1;

TrueScene sceneOf(TrueSceneParameters parameters, double middle_m = kDistance_m) {
  parameters.distance_m = kDistance_m;
  return TrueScene(parameters, fineCameraFor(middle_m));
}

/// Returns the component of the force out of the surface.
double outward_n(const rt::Tick& tick, const Vec3& inward) {
  return -dot(tick.law_force_n_in_world, inward);
}

TEST_P(EachConstraint, AHollowDoesNotAttract) {
  TrueScene bowl = sceneOf({.kind = SceneKind::bowl}, kDistance_m - 0.03);
  HardRig rig(GetParam(), bowl.depthModel());
  rig.show(bowl);
  const auto approach = bowl.approach(0);
  rig.jumpTo(approach.surface_m_in_world - 0.03 * approach.inward_in_world);
  for (int step = 0; step <= 300; ++step) {
    const double above = 0.03 - step * 1e-4;
    const rt::Tick tick = rig.moveTo(approach.surface_m_in_world - above * approach.inward_in_world);
    ASSERT_GE(outward_n(tick, approach.inward_in_world), 0) << above;
    // rounding of the hollow by its resolution: edge^2 / (8 R) = 0.25 mm
    if (above > 0.0015) {
      ASSERT_EQ(tick.law_force_n_in_world, Vec3{}) << above;
    }
  }
}

TEST(HardCase, ThePapersLawAttractsInAHollowAccordingToItsClosedForm) {
  TrueScene bowl = sceneOf({.kind = SceneKind::bowl}, kDistance_m - 0.03);
  HardRig rig(rt::ForceLaw::nearest_springs, bowl.depthModel());
  rig.show(bowl);
  const auto approach = bowl.approach(0);
  const rt::Tick tick = rig.tick(approach.surface_m_in_world);
  // F_N(0) = -k a_N (D/3 - a_N/4) / R with a_N^2 = N_max / (pi f_x f_y / Z^2)
  const double density = 594.214342 * 591.040537 / std::pow(bowl.parameters().distance_m, 2);
  const double disc = std::sqrt(100 / (M_PI * density));
  const double expected = -500 * disc * (0.04 / 3 - disc / 4) / 0.05;
  EXPECT_NEAR(outward_n(tick, approach.inward_in_world), expected, 0.1 * std::abs(expected));
}

TEST_P(EachConstraint, AHalfPlanesEdgeHoldsTheProxyAndPushesOut) {
  TrueScene edge = sceneOf({.kind = SceneKind::half_plane});
  HardRig rig(GetParam(), edge.depthModel());
  rig.show(edge);
  for (const double beside_m : {0.03, 0.02, 0.015}) {
    rig.box.core().release();
    rig.jumpTo({-beside_m, 0.003, -kDistance_m + 0.03});
    rig.moveTo({-beside_m, 0.003, -kDistance_m + 0.029});
    const rt::Tick tick = rig.moveTo({-beside_m, 0.003, -kDistance_m - 0.01});
    EXPECT_EQ(tick.contact, rt::ContactState::contact) << beside_m;
    EXPECT_NEAR(tick.law_force_n_in_world.z, 5, 0.35) << beside_m;  // one just noticeable difference
  }
}

TEST_P(EachConstraint, AThinPlateIsNotPushedThroughUpTo20Newton) {
  for (const double thickness : {0.005, 0.01}) {
    TrueScene plate = sceneOf({.kind = SceneKind::thin_plate, .plate_thickness_m = thickness});
    HardRig rig(GetParam(), plate.depthModel());
    rig.show(plate);
    rig.jumpTo({0.001, 0.002, -kDistance_m + 0.03});
    double before = 0;
    for (int step = 0; step <= 750; ++step) {
      const rt::Tick tick = rig.moveTo({0.001, 0.002, -kDistance_m + 0.03 - step * 1e-4});
      ASSERT_GE(tick.law_force_n_in_world.z, before - 0.05) << "step " << step;
      before = tick.law_force_n_in_world.z;
    }
    EXPECT_GT(before, 20);
  }
}

TEST(HardCase, ThePapersLawReversesBehindAThinPlate) {
  TrueScene plate = sceneOf({.kind = SceneKind::thin_plate});
  HardRig rig(rt::ForceLaw::nearest_springs, plate.depthModel());
  rig.show(plate);
  EXPECT_GT(rig.tick({0, 0, -kDistance_m + 0.01}).law_force_n_in_world.z, 5);
  EXPECT_LT(rig.tick({0, 0, -kDistance_m - 0.01}).law_force_n_in_world.z, -5);
}

TEST_P(EachConstraint, AFastHipDoesNotGetThroughAThinPlate) {
  for (const double speed_m_per_s : {1.0, 5.0}) {
    TrueScene plate = sceneOf({.kind = SceneKind::thin_plate, .plate_thickness_m = 0.005});
    HardRig rig(GetParam(), plate.depthModel());
    rig.show(plate);
    for (int start = 0; start < 20; ++start) {  // at all phases of the step
      rig.box.core().release();
      rig.jumpTo({0, 0, -kDistance_m + 0.06 + start * 1e-4});
      rig.tick(rig.hip());
      const rt::Tick tick = rig.moveTo({0, 0, -kDistance_m - 0.03}, speed_m_per_s * kTick_s);
      ASSERT_GT(tick.law_force_n_in_world.z, 0.9 * 0.03 * rig.stiffness_n_per_m()) << speed_m_per_s;
    }
  }
}

TEST_P(EachConstraint, RestsInAnInnerCornerWithoutShaking) {
  TrueScene corner = sceneOf({.kind = SceneKind::inner_corner}, kDistance_m - 0.05);
  HardRig rig(GetParam(), corner.depthModel());
  rig.show(corner);
  const auto approach = corner.approach(0);
  rig.jumpTo(approach.surface_m_in_world - 0.06 * approach.inward_in_world);
  const Vec3 end = approach.surface_m_in_world + 0.01 * approach.inward_in_world + Vec3{0.002, 0, 0};
  rig.moveTo(end);
  rt::Tick before = rig.tick(end);
  for (int i = 0; i < 200; ++i) before = rig.tick(end);
  EXPECT_EQ(before.contact == rt::ContactState::free, false);
  EXPECT_GT(outward_n(before, approach.inward_in_world), 3);
  for (int i = 0; i < 300; ++i) {
    const rt::Tick tick = rig.tick(end);
    // a tenth of the just noticeable difference
    ASSERT_LE(norm(tick.law_force_n_in_world - before.law_force_n_in_world), 0.01) << "tick " << i;
    before = tick;
  }
}

TEST_P(EachConstraint, AConvexEdgeIsCrossedWithoutAForceJump) {
  TrueScene edge = sceneOf({.kind = SceneKind::convex_edge}, kDistance_m + 0.05);
  HardRig rig(GetParam(), edge.depthModel());
  rig.show(edge);
  rig.jumpTo({-0.03, 0, -kDistance_m + 0.05});
  // 10 mm below the left face
  rig.moveTo({-0.03 + 0.01 / std::sqrt(2.0), 0, -kDistance_m - 0.03 - 0.01 / std::sqrt(2.0)});
  const Vec3 along{1 / std::sqrt(2.0), 0, 1 / std::sqrt(2.0)};
  const Vec3 start = rig.hip();
  Vec3 before = rig.tick(start).blended_force_n_in_world;
  constexpr double kStep_m = 1e-4;
  const double max_n = rig.stiffness_n_per_m() * (kStep_m + rt::kFastestSurface_m_per_s * kTick_s);
  for (int step = 1; step <= 500; ++step) {
    const Vec3 force = rig.moveTo(start + (step * kStep_m) * along).blended_force_n_in_world;
    // the ideal constraint releases at once when the HIP leaves through the other face; the blend does not
    ASSERT_LE(norm(force - before), max_n) << "step " << step;
    before = force;
  }
  EXPECT_EQ(before, Vec3{});
}

TEST(HardCase, WhereFlatFacesMeetTheForceIsThatOfTheTrueEdge) {
  constexpr double kExact_jnd = 0.3;
  constexpr double kInNoise_jnd = 1;
  const std::vector<tools::StrokesRow> rows =
      tools::measureStrokes({.laws = {"surface"},
                             .scenes = {"ridge", "cube_corner", "inner_edge", "inner_corner"},
                             .distances_m = {0.6, 1},
                             .noises = {tools::SceneNoise::none, tools::SceneNoise::sensor},
                             .variants = 3,
                             .seeds = 1});
  ASSERT_EQ(rows.size(), 16U);
  for (const tools::StrokesRow& row : rows) {
    const bool exact = row.noise == tools::SceneNoise::none;
    SCOPED_TRACE(row.scene.name + (exact ? " exact at " : " in noise at ") + std::to_string(row.distance_m));
    EXPECT_LT(row.figures.error.error_jnd.rms(), exact ? kExact_jnd : kInNoise_jnd);
    EXPECT_EQ(row.figures.lost_ticks, 0);
    EXPECT_EQ(row.figures.wrong_side_ticks, 0);
  }
}

TEST(HardCase, OnAThinRodTheForceIsThatOfTheRodAndNoEdges) {
  constexpr double kMostByFloor = 2;
  const std::vector<tools::StrokesRow> rows = tools::measureStrokes({.laws = {"surface"},
                                                                     .scenes = {"rod20"},
                                                                     .distances_m = {0.6},
                                                                     .noises = {tools::SceneNoise::sensor},
                                                                     .seeds = 1});
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_LT(rows[0].errorByFloor().value(), kMostByFloor);
}

TEST_P(EachLaw, AStepInDepthIsStrokedWithoutAForceJump) {
  TrueScene step_scene = sceneOf({.kind = SceneKind::step});
  HardRig rig(GetParam(), step_scene.depthModel());
  rig.show(step_scene);
  rig.jumpTo({-0.04, 0.003, -kDistance_m + 0.03});
  rig.moveTo({-0.04, 0.003, -kDistance_m - 0.004});
  Vec3 before = rig.tick(rig.hip()).blended_force_n_in_world;
  constexpr double kStep_m = 1e-4;
  double largest = 0;
  for (int step = 1; step <= 800; ++step) {
    const Vec3 force =
        rig.moveTo({-0.04 + step * kStep_m, 0.003, -kDistance_m - 0.004}).blended_force_n_in_world;
    largest = std::max(largest, norm(force - before));
    before = force;
  }
  // springs: the slope of the steepest law plus a change of the N_max-th point; laws with a proxy: what the
  // HIP's displacement and the blend explain
  const double explained_n = rig.stiffness_n_per_m() * (kStep_m + rt::kFastestSurface_m_per_s * kTick_s);
  EXPECT_LE(largest, rt::hasProxy(GetParam()) ? explained_n : 0.8);
}

// The law `surface` at the outlines and sides of bodies.

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
