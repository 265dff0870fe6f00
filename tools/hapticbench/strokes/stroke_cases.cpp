// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "tools/hapticbench/strokes/strokes.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kMaxStrokeLength_m = 0.16;  // of a stroke
constexpr double kWallBehind_m = 0.12;       // from a body's front to the wall behind it
constexpr double kBlockThickness_m = 0.06;
constexpr double kBeforeEnd_m = 0.07;  // of a stroke that leaves its body
constexpr double kAfterEnd_m = 0.03;
// Of a rod's radius: a proxy moves aside by 1 / (1 - this) times what the HIP does, so that nearer to the
// axis nothing but the error of the rod's position is measured.
constexpr double kDeepestOnRod = 0.6;

/// Places the cases of one scene in front of the camera, a little different for each scene by chance.
/// Thread: one.
class CaseMaker {
 public:
  CaseMaker(const CasePlacement& placement, std::mt19937& random) : placement_(placement), random_(random) {
    constexpr double kAside_px = 20;
    column_ = 320 + uniform(-kAside_px, kAside_px);
    row_ = 240 + uniform(-kAside_px, kAside_px);
  }

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double distance_m() const { return placement_.distance_m; }
  double depth_m() const { return placement_.depth_m; }
  bool deadColumns() const { return placement_.dead_columns; }

  /// Length of a stroke; shorter near the camera, so that one that runs towards it stays in its range.
  double length_m() const { return std::min(kMaxStrokeLength_m, 0.25 * placement_.distance_m); }

  /// The point at the scene's distance on the ray through a point of the image.
  Vec3 at_m(double column, double row) const {
    const rt::DepthModelParameters camera;
    const Vec3 ray{(column - camera.cx_px) / camera.fx_px, -(row - camera.cy_px) / camera.fy_px, -1};
    return placement_.distance_m * ray;
  }
  /// The point that the scene is built around.
  Vec3 middle_m() const { return at_m(column_, row_); }

  /// A frame whose origin is there, whose z axis is `outward` and whose x axis is `along` as far as that
  /// lies across.
  static RigidFrame frame(const Vec3& origin_m, const Vec3& outward, const Vec3& along) {
    const Vec3 x = unitOf(along - dot(along, outward) * outward);
    return {origin_m, x, cross(outward, x), outward};
  }
  /// Facing away from the camera's axis by `tilt_rad` about the image's direction `axis_rad`, which is the x
  /// axis.
  RigidFrame tilted(double tilt_rad, double axis_rad) const {
    const Vec3 axis{std::cos(axis_rad), std::sin(axis_rad), 0};
    return frame(middle_m(), turned({0, 0, 1}, tilt_rad * axis), axis);
  }

  /// A stroke over the surface z = 0 whose middle is `middle_m`.
  StrokePath straight(const Vec3& middle_m, const Vec3& along, double length_m) const {
    return {.start_m = middle_m - (length_m / 2) * along,
            .outward = {0, 0, 1},
            .along = along,
            .length_m = length_m,
            .depth_m = depth_m()};
  }

  /// Returns the length of a stroke along the surface z = 0 before the body ends at the origin.
  double beforeEnd_m() const { return std::min(kBeforeEnd_m, length_m()); }
  /// A stroke over the surface z = 0 out over its end at the origin.
  StrokePath outOver(const Vec3& along) const { return toOrigin(along, kAfterEnd_m); }
  /// A stroke over the surface z = 0 as deep into another one, which it meets at the origin.
  StrokePath into(const Vec3& along) const { return toOrigin(along, depth_m()); }

  /// The wall that faces the camera behind the scene, in the frame of the scene's bodies.
  TrueBody wallBehind(const RigidFrame& bodies) const {
    const Vec3 outward = bodies.directionIn({0, 0, 1});
    const Vec3 on_wall = bodies.positionIn(middle_m() - Vec3{0, 0, kWallBehind_m});
    return ConvexBody{{{outward, dot(outward, on_wall)}}};
  }

 private:
  StrokePath toOrigin(const Vec3& along, double beyond_m) const {
    return {.start_m = -beforeEnd_m() * along,
            .outward = {0, 0, 1},
            .along = along,
            .length_m = beforeEnd_m() + beyond_m,
            .depth_m = depth_m()};
  }

  const CasePlacement& placement_;
  std::mt19937& random_;
  double column_;
  double row_;
};

using Cases = std::vector<StrokeCase>;

const TrueBody kHalfSpace = ConvexBody{{{{0, 0, 1}, 0}}};

Cases planes(CaseMaker& make, double tilt_rad) {
  Cases cases;
  for (const double axis_deg : {0.0, 45.0, 90.0}) {
    for (const double turn_deg : {0.0, 90.0}) {
      const double aside = make.uniform(-10, 10) * kDegree;
      const Vec3 along{std::cos(turn_deg * kDegree + aside), std::sin(turn_deg * kDegree + aside), 0};
      cases.push_back({.bodies = {kHalfSpace},
                       .T_camera_bodies = make.tilted(tilt_rad, axis_deg * kDegree + aside),
                       .path = make.straight({}, along, make.length_m())});
    }
  }
  return cases;
}

/// `deep`: as deep as strokes are on flat surfaces, which is beyond the axis of the thinnest rods.
Cases rods(CaseMaker& make, double diameter_m, bool deep) {
  struct Orientation {
    double turn_deg;   // of the axis in the image
    double tilt_deg;   // of the axis in depth
    double round_deg;  // of the contact around the axis, from the side that faces the camera
  };
  constexpr Orientation kOrientations[] = {{0, 0, 0},   {30, 0, 0}, {60, 0, 0},   {90, 0, 0},
                                           {20, 30, 0}, {0, 0, 45}, {90, 0, -45}, {55, 0, 30}};
  Cases cases;
  const double radius = diameter_m / 2;
  for (const Orientation& o : kOrientations) {
    const double turn = (o.turn_deg + make.uniform(-4, 4)) * kDegree;
    const Vec3 in_image{std::cos(turn), std::sin(turn), 0};
    const Vec3 axis = std::cos(o.tilt_deg * kDegree) * in_image + Vec3{0, 0, std::sin(o.tilt_deg * kDegree)};
    const Vec3 towards = unitOf(-make.middle_m() + dot(make.middle_m(), axis) * axis);
    const RigidFrame frame = CaseMaker::frame(make.middle_m() - radius * towards, towards, axis);
    const Vec3 outward = turned({0, 0, 1}, {o.round_deg * kDegree, 0, 0});
    StrokePath path{.start_m = radius * outward - (make.length_m() / 2) * Vec3{1, 0, 0},
                    .outward = outward,
                    .along = {1, 0, 0},
                    .length_m = make.length_m(),
                    .depth_m = deep ? make.depth_m() : std::min(make.depth_m(), kDeepestOnRod * radius)};
    cases.push_back({.bodies = {RodBody{radius, 2 * make.distance_m()}, make.wallBehind(frame)},
                     .T_camera_bodies = frame,
                     .path = path,
                     .held_in_front = deep});
  }
  return cases;
}

Cases balls(CaseMaker& make, double radius_m) {
  constexpr double kHalfArc_rad = 40 * kDegree;
  Cases cases;
  for (const double turn_deg : {0.0, 45.0, 90.0, 150.0}) {
    const double turn = (turn_deg + make.uniform(-5, 5)) * kDegree;
    const Vec3 outward = unitOf(-make.middle_m());
    RigidFrame frame =
        CaseMaker::frame(make.middle_m() - radius_m * outward, outward, {std::cos(turn), std::sin(turn), 0});
    const Vec3 from = turned({0, 0, 1}, {0, -kHalfArc_rad, 0});
    StrokePath path{.start_m = radius_m * from,
                    .outward = from,
                    .along = turned({1, 0, 0}, {0, -kHalfArc_rad, 0}),
                    .length_m = 2 * kHalfArc_rad * (radius_m - make.depth_m()),
                    .depth_m = make.depth_m(),
                    .bend_radius_m = radius_m};
    cases.push_back(
        {.bodies = {BallBody{radius_m}, make.wallBehind(frame)}, .T_camera_bodies = frame, .path = path});
  }
  return cases;
}

/// A block that faces the camera and ends at x = 0.
const TrueBody kBlock = ConvexBody{{{{0, 0, 1}, 0}, {{1, 0, 0}, 0}, {{0, 0, -1}, kBlockThickness_m}}};

constexpr double kBesideEdge_m[] = {0.003, 0.01, 0.02};

/// Along the edge of a block that faces the camera. `turn_rad`: of the edge in the image from upright.
Cases edges(CaseMaker& make, double turn_rad) {
  Cases cases;
  for (const double beside_m : kBesideEdge_m) {
    for (const bool opposite : {false, true}) {
      const double turn = turn_rad + (opposite ? std::numbers::pi : 0) + make.uniform(-2, 2) * kDegree;
      const RigidFrame frame = make.tilted(0, turn);
      cases.push_back({.bodies = {kBlock, make.wallBehind(frame)},
                       .T_camera_bodies = frame,
                       .path = make.straight({-beside_m, 0, 0}, {0, 1, 0}, make.length_m()),
                       .beside_edge_m = beside_m});
    }
  }
  return cases;
}

/// The two faces of a table's edge, both seen at 45 degrees; x points over the edge.
RigidFrame ridgeFrame(CaseMaker& make, double turn_rad) {
  const Vec3 across{std::cos(turn_rad), std::sin(turn_rad), 0};
  return CaseMaker::frame(make.middle_m(), unitOf(Vec3{0, 0, 1} - across), across);
}
const TrueBody kRidge = ConvexBody{{{{0, 0, 1}, 0}, {{1, 0, 0}, 0}}};

Cases ridges(CaseMaker& make) {
  Cases cases;
  for (const double beside_m : kBesideEdge_m) {
    for (const double turn_deg : {0.0, 45.0, 90.0}) {
      const double turn = (turn_deg + make.uniform(-3, 3)) * kDegree;
      cases.push_back({.bodies = {kRidge},
                       .T_camera_bodies = ridgeFrame(make, turn),
                       .path = make.straight({-beside_m, 0, 0}, {0, 1, 0}, make.length_m()),
                       .beside_edge_m = beside_m});
    }
  }
  return cases;
}

/// Out over the edge of a block, straight and obliquely, and over a ridge.
Cases leaves(CaseMaker& make) {
  Cases cases;
  const auto add = [&](const RigidFrame& frame, std::vector<TrueBody> bodies, const Vec3& along) {
    cases.push_back({.bodies = std::move(bodies),
                     .T_camera_bodies = frame,
                     .path = make.outOver(along),
                     .ends_at_m = make.beforeEnd_m()});
  };
  for (const double turn_deg : {0.0, 90.0, 180.0, 270.0, 45.0, 200.0}) {
    const RigidFrame frame = make.tilted(0, (turn_deg + make.uniform(-3, 3)) * kDegree);
    add(frame, {kBlock, make.wallBehind(frame)}, {1, 0, 0});
  }
  const RigidFrame frame = make.tilted(0, make.uniform(-3, 3) * kDegree);
  add(frame, {kBlock, make.wallBehind(frame)}, unitOf({1, 1, 0}));
  for (const double turn_deg : {0.0, 90.0}) {
    const double turn = (turn_deg + make.uniform(-3, 3)) * kDegree;
    add(ridgeFrame(make, turn), {kRidge}, {1, 0, 0});
  }
  return cases;
}

/// Out over the corner of a block that faces the camera.
Cases leavesCorner(CaseMaker& make) {
  const TrueBody block =
      ConvexBody{{{{0, 0, 1}, 0}, {{1, 0, 0}, 0}, {{0, 1, 0}, 0}, {{0, 0, -1}, kBlockThickness_m}}};
  Cases cases;
  for (const double turn_deg : {0.0, 90.0, 180.0, 225.0}) {
    const RigidFrame frame = make.tilted(0, (turn_deg + make.uniform(-3, 3)) * kDegree);
    cases.push_back({.bodies = {block, make.wallBehind(frame)},
                     .T_camera_bodies = frame,
                     .path = make.outOver(unitOf({1, 1, 0})),
                     .ends_at_m = make.beforeEnd_m()});
  }
  return cases;
}

/// Three faces that meet at the origin, their diagonal towards the camera; `turn_rad` about it.
RigidFrame cornerFrame(CaseMaker& make, double turn_rad) {
  const Vec3 towards = unitOf(-make.middle_m());
  const RigidFrame diagonal =
      CaseMaker::frame(make.middle_m(), towards, {std::cos(turn_rad), std::sin(turn_rad), 0});
  const auto axis = [&](double angle) {
    return unitOf(
        diagonal.directionOut({std::sqrt(2.0) * std::cos(angle), std::sqrt(2.0) * std::sin(angle), 1}));
  };
  const double third = 2 * std::numbers::pi / 3;
  return {make.middle_m(), axis(0), axis(third), axis(2 * third)};
}
const std::vector<Face> kThreeFaces{{{1, 0, 0}, 0}, {{0, 1, 0}, 0}, {{0, 0, 1}, 0}};

Cases cubeCorner(CaseMaker& make) {
  constexpr double kBeside_m = 0.01;
  Cases cases;
  const double before = make.beforeEnd_m();
  for (const double turn_deg : {0.0, 50.0}) {
    const RigidFrame frame = cornerFrame(make, (turn_deg + make.uniform(-3, 3)) * kDegree);
    StrokeCase one{.bodies = {ConvexBody{kThreeFaces}},
                   .T_camera_bodies = frame,
                   .path = {.start_m = {-kBeside_m, -before, 0},
                            .outward = {0, 0, 1},
                            .along = {0, 1, 0},
                            .length_m = before - kBeside_m,
                            .depth_m = make.depth_m()}};
    cases.push_back(one);
    one.path = {.start_m = {-0.002, -0.001, 0},
                .outward = {0, 0, 1},
                .along = {1, 0, 0},
                .length_m = 0,
                .depth_m = 0.01,
                .entry = unitOf({1, 1, 1})};
    cases.push_back(one);
  }
  return cases;
}

Cases innerEdge(CaseMaker& make) {
  Cases cases;
  for (const double turn_deg : {0.0, 45.0, 90.0}) {
    const double turn = (turn_deg + make.uniform(-3, 3)) * kDegree;
    const Vec3 across{std::cos(turn), std::sin(turn), 0};
    StrokeCase one{
        .bodies = {HollowBody{{{{0, 0, 1}, 0}, {{1, 0, 0}, 0}}}},
        .T_camera_bodies = CaseMaker::frame(make.middle_m(), unitOf(Vec3{0, 0, 1} - across), across),
        .path = make.straight({}, {0, 1, 0}, make.length_m())};
    one.path.outward = unitOf({1, 0, 1});
    cases.push_back(one);
    one.path = make.into({-1, 0, 0});
    cases.push_back(one);
  }
  return cases;
}

Cases innerCorner(CaseMaker& make) {
  Cases cases;
  for (const double turn_deg : {0.0, 50.0}) {
    const RigidFrame frame = cornerFrame(make, (turn_deg + make.uniform(-3, 3)) * kDegree);
    StrokeCase one{.bodies = {HollowBody{kThreeFaces}},
                   .T_camera_bodies = frame,
                   .path = {.start_m = {},
                            .outward = unitOf({1, 1, 1}),
                            .along = unitOf({1, -1, 0}),
                            .length_m = 0,
                            .depth_m = make.depth_m()}};
    cases.push_back(one);
    one.path = make.into(unitOf({-1, -1, 0}));
    cases.push_back(one);
  }
  return cases;
}

/// Left, right, top and bottom of the image.
struct Border {
  double column, row;           // of a pixel on it, at its middle
  double inwards_x, inwards_y;  // in the image, y up
};
std::vector<Border> borders(bool dead_columns) {
  // Half a pixel outside of the last pixel's middle; a real camera measures nothing from column 632 on.
  const double last_column = dead_columns ? 631.5 : 639.5;
  return {{-0.5, 240, 1, 0}, {last_column, 240, -1, 0}, {320, -0.5, 0, -1}, {320, 479.5, 0, 1}};
}

Cases alongBorder(CaseMaker& make) {
  Cases cases;
  for (const Border& border : borders(make.deadColumns())) {
    const double inside_px = make.uniform(25, 28);
    const Vec3 inwards{border.inwards_x, border.inwards_y, 0};
    const Vec3 place = make.at_m(border.column + inside_px * inwards.x, border.row - inside_px * inwards.y);
    cases.push_back({.bodies = {kHalfSpace},
                     .T_camera_bodies = CaseMaker::frame(place, {0, 0, 1}, cross(inwards, {0, 0, 1})),
                     .path = make.straight({}, {1, 0, 0}, make.length_m())});
  }
  return cases;
}

Cases acrossBorder(CaseMaker& make) {
  Cases cases;
  for (const Border& border : borders(make.deadColumns())) {
    const Vec3 inwards{border.inwards_x, border.inwards_y, 0};
    // Contact ends where the point of the surface in front of the HIP leaves the image.
    const Vec3 place = make.at_m(border.column, border.row);
    cases.push_back({.bodies = {kHalfSpace},
                     .T_camera_bodies = CaseMaker::frame(place, {0, 0, 1}, -inwards),
                     .path = make.outOver({1, 0, 0}),
                     .ends_at_m = make.beforeEnd_m(),
                     .ends_unseen = true});
  }
  return cases;
}

/// The plane moves at that speed: to the camera, away from it, and aside where it is tilted by 30 degrees.
Cases movingPlanes(CaseMaker& make, double speed_m_per_s) {
  struct Motion {
    Vec3 direction;
    double tilt_deg;
    double inwards;  // how fast the penetration of a still HIP grows, over the speed
  };
  const Motion motions[] = {{{0, 0, 1}, 0, 1}, {{0, 0, -1}, 0, -1}, {{0, 1, 0}, 30, -0.5}};
  constexpr double kShallow_m = 0.004;  // of a HIP that stays
  constexpr double kDeep_m = 0.02;
  constexpr double kStroke_s = 0.4;
  constexpr double kFramePeriod_s = 1.0 / 30;
  Cases cases;
  for (const Motion& motion : motions) {
    for (const HipMotion hip : {HipMotion::stays, HipMotion::strokes}) {
      const bool stays = hip == HipMotion::stays;
      StrokeCase one{.bodies = {kHalfSpace},
                     .T_camera_bodies = make.tilted(motion.tilt_deg * kDegree, 0),
                     .path = make.straight({}, unitOf({1, 0.3, 0}), kStroke_s * kStrokeSpeed_m_per_s),
                     .hip = hip};
      one.phase_s = make.uniform(0, kFramePeriod_s);
      if (stays) {
        one.stays_s = (kDeep_m - kShallow_m) / (std::abs(motion.inwards) * speed_m_per_s);
        one.path.depth_m = motion.inwards > 0 ? kShallow_m : kDeep_m;
      }
      one.motion.velocity_m_per_s = speed_m_per_s * motion.direction;
      const double moves_s = kSteady_s + (stays ? one.stays_s : kStroke_s);
      one.T_camera_bodies.origin_m += -0.5 * moves_s * one.motion.velocity_m_per_s;
      one.beyond_m += 0.5 * moves_s * speed_m_per_s;
      cases.push_back(std::move(one));
    }
  }
  return cases;
}

/// A block that turns about an axis through its middle, across the view: the mean motion of what the camera
/// sees is none. A HIP beside the axis is left or met by the surface.
Cases turningBlocks(CaseMaker& make, double speed_rad_per_s) {
  constexpr double kHalf_m = 0.06;
  constexpr double kBeside_m = 0.018;
  constexpr double kJudged_s = 0.3;
  constexpr double kFramePeriod_s = 1.0 / 30;
  const ConvexBody block{{{{0, 0, 1}, 0},
                          {{0, 0, -1}, kBlockThickness_m},
                          {{1, 0, 0}, kHalf_m},
                          {{-1, 0, 0}, kHalf_m},
                          {{0, 1, 0}, kHalf_m},
                          {{0, -1, 0}, kHalf_m}}};
  Cases cases;
  for (const bool upright : {false, true}) {
    for (const double side : {-1.0, 1.0}) {
      StrokeCase one{
          .bodies = {block}, .T_camera_bodies = make.tilted(0, 0), .path = {}, .hip = HipMotion::stays};
      const Vec3 beside = upright ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
      one.path = make.straight(side * kBeside_m * beside, beside, 0);
      one.stays_s = kJudged_s;
      one.phase_s = make.uniform(0, kFramePeriod_s);
      one.motion.spin_rad_per_s = upright ? Vec3{0, speed_rad_per_s, 0} : Vec3{speed_rad_per_s, 0, 0};
      cases.push_back(std::move(one));
    }
  }
  return cases;
}

/// The camera is held by hand: it sways by 3 mm and half a degree and turns slowly.
Cases handHeld(CaseMaker& make) {
  BodyMotion motion;
  motion.turning_rad_per_s = {0, 2 * kDegree, 1 * kDegree};
  motion.sway_m = {0.003, 0.003, 0.003};
  motion.sway_rad = {0.5 * kDegree, 0.5 * kDegree, 0.3 * kDegree};
  motion.sway_hz = 0.7;
  Cases cases;
  cases.push_back(planes(make, 20 * kDegree).front());
  cases.push_back(cases.front());
  cases.back().hip = HipMotion::stays;
  cases.back().stays_s = 1;
  cases.push_back(balls(make, 0.05).front());
  cases.push_back(rods(make, 0.04, false).front());
  for (StrokeCase& one : cases) one.motion = motion;
  return cases;
}

/// The motions of organs: how they are called on the command line.
struct OrganMotion {
  const char* name;
  Beat beat;
  double judged_s;  ///< whole periods
};
/// A heart of 72 beats a minute whose harmonics bring its acceleration to 3.0 m/s^2, breathing of 20 mm from
/// end to end, and a trembling of the whole scene with 1 mm to both sides.
const OrganMotion kOrgans[] = {{"heart", {.hz = 1.2, .amplitudes_m = {0.01, 0.005, 0.0025}}, 2.5},
                               {"breathing", {.hz = 0.25, .amplitudes_m = {0.01}}, 4},
                               {"tremor", {.hz = 8, .amplitudes_m = {0.001}}, 1}};

StrokeScene organScene(const OrganMotion& organ, bool is_ball) {
  constexpr double kNearest_m = 0.5;  // it comes up to 25 mm nearer
  StrokeScene scene;
  scene.name = std::string(organ.name) + (is_ball ? "_ball" : "_plane");
  scene.smooth = false;
  scene.moving = true;
  scene.nearest_m = kNearest_m;
  return scene;
}

/// A HIP that stays, at least 4 mm deep, in a surface that moves towards the camera and back.
Cases organs(CaseMaker& make, const OrganMotion& organ, bool is_ball) {
  constexpr double kShallowest_m = 0.004;
  constexpr double kFramePeriod_s = 1.0 / 30;
  constexpr double kRadius_m = 0.05;
  StrokeCase one = is_ball ? balls(make, kRadius_m).front() : planes(make, 20 * kDegree).front();
  if (is_ball) one.path.start_m = kRadius_m * unitOf(Vec3{0.3, 0, 1});
  if (is_ball) one.path.outward = unitOf(one.path.start_m);
  one.path.along = unitOf(cross({0, 1, 0}, one.path.outward));
  one.path.length_m = 0;
  one.path.bend_radius_m = 0;
  one.motion.beat = organ.beat;
  one.hip = HipMotion::stays;
  one.stays_s = organ.judged_s;
  one.phase_s = make.uniform(0, kFramePeriod_s);
  // where it stays the surface has already come on
  one.path.depth_m = kShallowest_m + organ.beat.displacement_m(kSteady_s + one.phase_s);
  return {one};
}

struct Entry {
  StrokeScene scene;
  std::function<Cases(CaseMaker&)> make;
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = [] {
    std::vector<Entry> list;
    for (const int tilt_deg : {0, 30, 45, 60}) {
      list.push_back({{.name = fmt::format("plane{}", tilt_deg), .flat = true},
                      [tilt_deg](CaseMaker& make) { return planes(make, tilt_deg * kDegree); }});
    }
    for (const auto& [diameter_mm, deep] : {std::pair(10, false), std::pair(20, false), std::pair(40, false),
                                            std::pair(80, false), std::pair(10, true), std::pair(20, true)}) {
      const double diameter_m = diameter_mm / 1000.0;
      list.push_back(
          {{.name = fmt::format("rod{}{}", diameter_mm, deep ? "_deep" : ""), .narrowest_m = diameter_m},
           [diameter_m, deep = deep](CaseMaker& make) { return rods(make, diameter_m, deep); }});
    }
    for (const int diameter_mm : {30, 50, 100, 200}) {
      const double radius_m = diameter_mm / 2000.0;
      list.push_back({{.name = fmt::format("sphere{}", diameter_mm), .narrowest_m = 2 * radius_m},
                      [radius_m](CaseMaker& make) { return balls(make, radius_m); }});
    }
    for (const int turn_deg : {0, 22, 45}) {
      list.push_back({{.name = fmt::format("edge{}", turn_deg), .flat = true},
                      [turn_deg](CaseMaker& make) { return edges(make, turn_deg * kDegree); }});
    }
    list.push_back({{.name = "ridge", .flat = true}, ridges});
    list.push_back({{.name = "over_edge", .smooth = false}, leaves});
    list.push_back({{.name = "over_corner", .smooth = false}, leavesCorner});
    list.push_back({{.name = "cube_corner", .smooth = false}, cubeCorner});
    list.push_back({{.name = "inner_edge", .smooth = false}, innerEdge});
    list.push_back({{.name = "inner_corner", .smooth = false}, innerCorner});
    list.push_back({{.name = "border_along", .flat = true}, alongBorder});
    list.push_back({{.name = "border_across", .smooth = false}, acrossBorder});
    for (const double speed : {0.1, 0.3, 0.5}) {
      constexpr double kNearest_m =
          0.42;  // a plane that comes nearer is half of 0.6 s of motion nearer at the end
      list.push_back({{.name = fmt::format("moving{:g}", speed),
                       .smooth = false,
                       .moving = true,
                       .nearest_m = kNearest_m + 0.3 * speed},
                      [speed](CaseMaker& make) { return movingPlanes(make, speed); }});
    }
    for (const double speed : {0.2, 0.6}) {
      list.push_back({{.name = fmt::format("turning{:g}", speed), .smooth = false, .moving = true},
                      [speed](CaseMaker& make) { return turningBlocks(make, speed); }});
    }
    for (const OrganMotion& organ : kOrgans) {
      for (const bool is_ball : {false, true}) {
        list.push_back({organScene(organ, is_ball),
                        [&organ, is_ball](CaseMaker& make) { return organs(make, organ, is_ball); }});
      }
    }
    list.push_back({{.name = "hand_held", .smooth = false, .moving = true, .narrowest_m = 0.04}, handHeld});
    return list;
  }();
  return all;
}

}  // namespace

double StrokeScene::spans_px(double distance_m) const {
  return narrowest_m * rt::DepthModelParameters{}.fx_px / distance_m;
}

bool isSeen(const StrokeScene& scene, double distance_m) {
  constexpr double kMin_px = 7.9;
  return distance_m >= scene.nearest_m && scene.spans_px(distance_m) >= kMin_px;
}

const std::vector<StrokeScene>& strokeScenes() {
  static const std::vector<StrokeScene> scenes = [] {
    std::vector<StrokeScene> list;
    for (const Entry& entry : entries()) list.push_back(entry.scene);
    return list;
  }();
  return scenes;
}

Cases strokeCases(const StrokeScene& scene, const CasePlacement& placement, std::mt19937& random) {
  const auto is_it = [&scene](const Entry& entry) { return entry.scene.name == scene.name; };
  CaseMaker make(placement, random);
  return std::ranges::find_if(entries(), is_it)->make(make);
}

}  // namespace hapticd::tools
