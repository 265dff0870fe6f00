// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tools/hapticbench/godobject/godobject.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;
using Cases = std::vector<SceneCase>;

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;
constexpr double kAhead_m = 0.02;  // of a surface, where strokes begin

RigidFrame frameOf(const Vec3& origin_m, const Vec3& z, const Vec3& towards_x) {
  const Vec3 x = unitOf(towards_x - dot(towards_x, z) * z);
  return {origin_m, x, cross(z, x), z};
}

/// A frame that is known in another one, in the frame that that one is known in.
RigidFrame within(const RigidFrame& outer, const RigidFrame& inner) {
  return {outer.positionOut(inner.origin_m), outer.directionOut(inner.x), outer.directionOut(inner.y),
          outer.directionOut(inner.z)};
}

RigidFrame at(const Vec3& origin_m) {
  return {.origin_m = origin_m};
}

/// The point of a circle around the y axis, from the z axis towards x.
Vec3 onArc(double radius_m, double angle_rad) {
  return {radius_m * std::sin(angle_rad), 0, radius_m * std::cos(angle_rad)};
}

/// The pixels around what the camera sees at `place_m`.
ImageGap gapAround(const Vec3& place_m, double width_m, double height_m) {
  const rt::DepthModelParameters camera;
  const double column = camera.cx_px - camera.fx_px * place_m.x / place_m.z;
  const double row = camera.cy_px + camera.fy_px * place_m.y / place_m.z;
  const double half_width_px = -camera.fx_px * width_m / (2 * place_m.z);
  const double half_height_px = -camera.fy_px * height_m / (2 * place_m.z);
  return {column - half_width_px, column + half_width_px, row - half_height_px, row + half_height_px};
}

/// A scene in a frame of its own, whose origin is the scene's middle and whose z axis points to the camera,
/// turned in the image and tilted a little by chance. Thread: one.
class Stage {
 public:
  Stage(const ScenePlacement& placement, std::mt19937& random) : placement_(placement), random_(random) {
    constexpr double kAside_px = 20;
    const rt::DepthModelParameters camera;
    const double column = 320 + uniform(-kAside_px, kAside_px);
    const double row = 240 + uniform(-kAside_px, kAside_px);
    middle_m_ = placement.distance_m *
                Vec3{(column - camera.cx_px) / camera.fx_px, -(row - camera.cy_px) / camera.fy_px, -1};
    stand(uniform(0, 3) * kDegree);
  }

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double pressed_m() { return uniform(0.005, 0.008); }
  std::mt19937& random() { return random_; }
  const Vec3& middle_m() const { return middle_m_; }
  const RigidFrame& frame() const { return frame_; }

  /// Turns the frame anew, its z axis by `tilt_rad` away from the camera's axis; x then comes towards it.
  void stand(double tilt_rad) {
    const double turn = uniform(0, 2 * kPi);
    const Vec3 away{std::cos(turn), std::sin(turn), 0};
    const Vec3 z = std::cos(tilt_rad) * Vec3{0, 0, 1} - std::sin(tilt_rad) * away;
    frame_ = frameOf(middle_m_, z, away);
    if (tilt_rad < 10 * kDegree) turnBy(uniform(0, 2 * kPi));
  }
  void turnBy(double angle_rad) {
    frame_ = within(
        frame_,
        {{}, {std::cos(angle_rad), std::sin(angle_rad), 0}, {-std::sin(angle_rad), std::cos(angle_rad), 0}});
  }
  void stand(const RigidFrame& frame) { frame_ = frame; }

  Stage& add(const DistanceShape& shape, const RigidFrame& inside = {}) {
    bodies_.push_back({shape, within(frame_, inside)});
    return *this;
  }
  Stage& addWall(double behind_m = 0.4) {
    if (!placement_.has_wall) return *this;
    bodies_.push_back({PlaneShape{}, at(middle_m_ - Vec3{0, 0, behind_m})});
    beyond_m_ = behind_m + 0.02;
    return *this;
  }
  std::vector<DistanceBody>& bodies() { return bodies_; }

  /// A stroke along corners in the stage's frame.
  SceneCase along(const std::vector<Vec3>& corners) const {
    SceneCase one;
    one.bodies = bodies_;
    one.beyond_m = beyond_m_;
    for (const Vec3& corner : corners) one.path_m.push_back(frame_.positionOut(corner));
    return one;
  }

 private:
  const ScenePlacement& placement_;
  std::mt19937& random_;
  Vec3 middle_m_;
  RigidFrame frame_;
  std::vector<DistanceBody> bodies_;
  double beyond_m_ = 0.15;
};

/// Adds an arc of a stroke around the y axis through `centre`.
void addArc(std::vector<Vec3>& corners, const Vec3& centre, double radius_m, double from_rad, double to_rad) {
  constexpr double kStep_rad = 1 * kDegree;
  const int steps = std::max(1, static_cast<int>(std::abs(to_rad - from_rad) / kStep_rad));
  for (int i = 0; i <= steps; ++i)
    corners.push_back(centre + onArc(radius_m, from_rad + (to_rad - from_rad) * i / steps));
}

Cases planes(Stage stage, double tilt_rad) {
  if (tilt_rad > 0) stage.stand(tilt_rad);
  const double down = -stage.pressed_m();
  const double turn = stage.uniform(0, 2 * kPi);
  const Vec3 along = 0.05 * Vec3{std::cos(turn), std::sin(turn), 0};
  stage.add(PlaneShape{});
  return {stage.along({-along + Vec3{0, 0, kAhead_m}, -along + Vec3{0, 0, down}, along + Vec3{0, 0, down}})};
}

/// A plane, across an upright band of it that is not measured.
Cases bands(Stage stage) {
  constexpr double kWidth_m = 0.06;
  const double turn = stage.uniform(-20, 20) * kDegree;
  const Vec3 across = stage.frame().directionIn({std::cos(turn), std::sin(turn), 0});
  const Vec3 along = 0.065 * unitOf({across.x, across.y, 0});
  const double down = -stage.pressed_m();
  stage.add(PlaneShape{});
  SceneCase one =
      stage.along({-along + Vec3{0, 0, kAhead_m}, -along + Vec3{0, 0, down}, along + Vec3{0, 0, down}});
  one.gaps = {gapAround(stage.middle_m(), kWidth_m, 1)};
  return {one};
}

Cases balls(Stage stage, double radius_m) {
  const double radius = radius_m - stage.pressed_m();
  const double from = -stage.uniform(30, 45) * kDegree;
  stage.add(BallShape{radius_m}, at({0, 0, -radius_m})).addWall();
  std::vector<Vec3> corners{Vec3{0, 0, -radius_m} + onArc(radius_m + kAhead_m, from)};
  addArc(corners, {0, 0, -radius_m}, radius, from, stage.uniform(30, 45) * kDegree);
  return {stage.along(corners)};
}

/// Along the rod and around it.
Cases rods(Stage stage, double radius_m) {
  constexpr double kHalf_m = 0.05;
  const double down = std::min(stage.pressed_m(), 0.6 * radius_m);
  const double tilt = stage.uniform(-20, 20) * kDegree;
  stage.stand(
      within(stage.frame(),
             {{}, {std::cos(tilt), 0, std::sin(tilt)}, {0, 1, 0}, {-std::sin(tilt), 0, std::cos(tilt)}}));
  stage.add(CapsuleShape{radius_m, 0.12}, at({0, 0, -radius_m})).addWall();
  const Vec3 outward = turned({0, 0, 1}, {stage.uniform(-20, 20) * kDegree, 0, 0});
  const auto place = [&](double x, double above) {
    return Vec3{x, 0, -radius_m} + (radius_m + above) * outward;
  };
  Cases cases{stage.along({place(-kHalf_m, kAhead_m), place(-kHalf_m, -down), place(kHalf_m, -down)})};
  std::vector<Vec3> around{place(0, kAhead_m)};
  const double from = std::atan2(-outward.y, outward.z);
  for (int i = 0; i <= 40; ++i) {
    const double angle = from + (from > 0 ? -1 : 1) * i * kDegree;
    around.push_back(Vec3{0, 0, -radius_m} + (radius_m - down) * Vec3{0, -std::sin(angle), std::cos(angle)});
  }
  cases.push_back(stage.along(around));
  return cases;
}

/// Along the bottom of an inner edge, and out of it along a wall.
Cases vees(Stage stage, double opening_rad) {
  constexpr double kAbove_m = 0.025;
  const double half = opening_rad / 2;
  const double down = stage.pressed_m();
  for (const double side : {-1.0, 1.0}) {
    const Vec3 inwards{-side * std::cos(half), 0, std::sin(half)};
    stage.add(PlaneShape{}, frameOf({}, inwards, {0, 1, 0}));
  }
  const Vec3 wall{std::sin(half), 0, std::cos(half)};
  const Vec3 into{std::cos(half), 0, -std::sin(half)};
  const Vec3 y{0, 0.035, 0};
  return {stage.along({Vec3{0, 0, kAbove_m} - y, Vec3{0, 0, -down} - y, Vec3{0, 0, -down} + y}),
          stage.along({{0, 0, kAbove_m}, {0, 0, -down}, 0.06 * wall + down * into})};
}

/// A ball half sunk in a table: down over its limb onto the table, and a free hand that does the same beside
/// it.
Cases halfSunk(Stage stage, bool hand_is_free) {
  constexpr double kRadius_m = 0.03;
  constexpr double kBeside_m = 0.005;
  constexpr double kEnd_m = 0.065;
  Cases cases;
  for (const double tilt_rad : {0.0, 45 * kDegree}) {
    Stage one = stage;
    if (tilt_rad > 0) {
      one.stand(tilt_rad);
      // what is behind the ball is hidden
      one.turnBy(one.uniform(-70, 70) * kDegree);
    }
    one.add(PlaneShape{}).add(BallShape{kRadius_m});
    const double above = hand_is_free ? kBeside_m : -one.pressed_m();
    const double radius = kRadius_m + above;
    std::vector<Vec3> corners{{0, 0, kRadius_m + kAhead_m}};
    addArc(corners, {}, radius, 0, std::acos(above / radius));
    corners.push_back({kEnd_m, 0, above});
    cases.push_back(one.along(corners));
  }
  return cases;
}

/// Along the side of a plate, as far below its front.
Cases plateSide(Stage stage, double least_below_m, double most_below_m) {
  const Vec3 half{0.05, 0.08, 0.01};
  constexpr double kAlong_m = 0.04;
  stage.add(BoxShape{half}, at({0, 0, -half.z})).addWall();
  Cases cases;
  for (int i = 0; i < 2; ++i) {
    const double z = -stage.uniform(least_below_m, most_below_m);
    const double in = half.x - stage.pressed_m();
    const double from = i == 0 ? -kAlong_m : kAlong_m;
    cases.push_back(stage.along({{half.x + 0.03, from, z}, {in, from, z}, {in, -from, z}}));
  }
  return cases;
}

/// In the hole of a ring: round its rim, and across the hole to the far rim.
Cases rings(Stage stage) {
  const RingShape ring{.inner_m = 0.04, .outer_m = 0.08, .half_thickness_m = 0.01};
  stage.add(ring, at({0, 0, -ring.half_thickness_m})).addWall();
  const double radius = ring.inner_m + stage.pressed_m();
  const double z = -stage.uniform(0.007, 0.013);
  std::vector<Vec3> round{{0, 0, 0.03}, {0, 0, z}};
  const std::size_t first = round.size();
  constexpr int kCorners = 180;
  for (int i = 0; i <= kCorners; ++i) {
    const double angle = 2 * kPi * i / kCorners;
    round.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
  }
  SceneCase rim = stage.along(round);
  rim.loop_corners = {first, round.size() - 1};
  const double y = stage.uniform(-0.01, 0.01);
  const double x = std::sqrt(radius * radius - y * y);
  return {rim, stage.along({{0, y, 0.03}, {0, y, z}, {-x, y, z}, {x, y, z}})};
}

/// Over one of two balls that touch, through the valley and over the other one.
Cases twoBalls(Stage stage) {
  constexpr double kRadius_m = 0.04;
  const double radius = kRadius_m - stage.pressed_m();
  Cases cases;
  stage.add(BallShape{kRadius_m}, at({-kRadius_m, 0, -kRadius_m}))
      .add(BallShape{kRadius_m}, at({kRadius_m, 0, -kRadius_m}))
      .addWall();
  for (const double valley_deg : {30.0, 50.0}) {
    const double from = -stage.uniform(30, 40) * kDegree;
    const double valley = valley_deg * kDegree;
    const Vec3 left{-kRadius_m, 0, -kRadius_m};
    std::vector<Vec3> corners{left + onArc(kRadius_m + kAhead_m, from)};
    addArc(corners, left, radius, from, valley);
    addArc(corners, {kRadius_m, 0, -kRadius_m}, radius, -valley, -from);
    cases.push_back(stage.along(corners));
  }
  return cases;
}

/// Three orthogonal directions as steep to the z axis of the stage.
RigidFrame cornerFrame() {
  const auto axis = [](double angle) {
    return unitOf({std::sqrt(2.0) * std::cos(angle), std::sqrt(2.0) * std::sin(angle), 1});
  };
  return {{}, axis(0), axis(2 * kPi / 3), axis(4 * kPi / 3)};
}

/// A concave corner of three faces: into it and out along an inner edge, and along a face into it.
Cases hollowCorner(Stage stage) {
  stage.stand(within(stage.frame(), cornerFrame()));
  for (const RigidFrame& face :
       {frameOf({}, {1, 0, 0}, {0, 1, 0}), frameOf({}, {0, 1, 0}, {0, 0, 1}), at({})})
    stage.add(PlaneShape{}, face);
  const double in = -0.7 * stage.pressed_m();
  const double far = 0.05;
  return {stage.along({{0.02, 0.02, 0.02}, {in, in, in}, {far, in, in}}),
          stage.along({{far, far, kAhead_m}, {far, far, in}, {in, in, in}, {in, far, in}})};
}

/// A cube's corner, over two of its edges. A proxy stays on a face as long as the HIP is below it, so that
/// the hand leaves each face at its edge before it presses the next one.
Cases cube(Stage stage) {
  constexpr double kHalf_m = 0.05;
  stage.stand(within(stage.frame(), cornerFrame()));
  stage.add(BoxShape{{kHalf_m, kHalf_m, kHalf_m}}, at({-kHalf_m, -kHalf_m, -kHalf_m})).addWall();
  const double in = stage.pressed_m();
  constexpr double kNearEdge_m = 0.0005;
  constexpr double kPast_m = 0.002;
  constexpr double kBelow_m = 0.015;
  return {stage.along({{-0.05, -0.02, kAhead_m},
                       {-0.05, -0.02, -in},
                       {-0.02, -0.02, -in},
                       {kPast_m, -0.02, -kNearEdge_m},
                       {kPast_m, -0.02, -kBelow_m},
                       {-in, -0.02, -kBelow_m},
                       {-kNearEdge_m, kPast_m, -kBelow_m},
                       {-0.02, kPast_m, -kBelow_m},
                       {-0.02, -in, -kBelow_m},
                       {-0.04, -in, -kBelow_m}})};
}

/// Closed loops on the inside of a half ball.
Cases bowls(Stage stage) {
  constexpr double kRadius_m = 0.08;
  constexpr int kLoops = 3;
  constexpr int kCorners = 120;
  stage.add(BowlShape{kRadius_m});
  const double lean = stage.uniform(10, 30) * kDegree;
  const double opening = stage.uniform(14, 20) * kDegree;
  const RigidFrame loop = frameOf({}, onArc(-1, lean), {0, 1, 0});
  const auto place = [&](double radius, double angle) {
    return loop.positionOut({radius * std::sin(opening) * std::cos(angle),
                             radius * std::sin(opening) * std::sin(angle), radius * std::cos(opening)});
  };
  const double radius = kRadius_m + stage.pressed_m();
  std::vector<Vec3> corners{place(kRadius_m - kAhead_m, 0)};
  std::vector<std::size_t> ends;
  for (int i = 0; i <= kLoops * kCorners; ++i) {
    if (i > 0 && i % kCorners == 0) ends.push_back(corners.size());  // what comes before settles
    corners.push_back(place(radius, 2 * kPi * i / kCorners));
  }
  SceneCase one = stage.along(corners);
  one.loop_corners = ends;
  return {one};
}

/// A plate whose back is 10 mm in front of a free hand passes it; `before_wall`: 30 mm behind the hand is a
/// wall.
SceneCase passing(Stage stage, bool before_wall) {
  constexpr double kGap_m = 0.01;
  constexpr double kWall_m = 0.03;
  constexpr double kStays_s = 2;
  const Vec3 half{0.06, 0.15, 0.01};
  const double speed = stage.uniform(0.2, 0.4);
  const Vec3 start{-0.5 * kStays_s * speed, stage.uniform(-0.05, 0.05), kGap_m + half.z};
  stage.add(BoxShape{half}, at(start));
  stage.bodies().back().velocity_m_per_s = stage.frame().directionOut({speed, 0, 0});
  if (before_wall) {
    stage.add(PlaneShape{}, at({0, 0, -kWall_m}));
  } else {
    stage.addWall();
  }
  SceneCase one = stage.along({{0, 0, 0}});
  one.stays_s = kStays_s;
  return one;
}

/// Where the camera sees a hand that is at least so far from everything.
bool isFreeInSight(const DistanceScene& scene, const Vec3& place_m, double least_m) {
  return scene.signedDistance(place_m, 0) >= least_m && scene.behindSight_m(place_m, 0) < 0;
}

Vec3 randomIn(Stage& stage, double half_m) {
  const double x = stage.uniform(-half_m, half_m);
  const double y = stage.uniform(-half_m, half_m);
  return {x, y, stage.uniform(-half_m, half_m)};
}

/// The same bodies with a hand that moves by chance from the beginning of the stroke, 5 to 15 mm from them
/// and in the camera's sight, and back the same way.
SceneCase withFreeHand(SceneCase one, Stage& stage) {
  constexpr double kNearest_m = 0.005;
  constexpr double kFarthest_m = 0.015;
  constexpr double kStride_m = 0.015;
  constexpr std::size_t kCorners = 14;
  constexpr int kTries = 400;
  const DistanceScene scene(one.bodies, {}, {}, 0);
  std::vector<Vec3> way{one.path_m.front()};
  for (int i = 0; i < kTries && way.size() < kCorners; ++i) {
    const Vec3& from = way.back();
    Vec3 to = from + kStride_m * unitOf(randomIn(stage, 1));
    const double level = stage.uniform(kNearest_m, kFarthest_m);
    for (int round = 0; round < 3; ++round) {
      const NearestSurface nearest = scene.nearest(to, 0);
      to += (level - nearest.distance_m) * nearest.outward;
    }
    bool is_free = true;
    constexpr int kPlaces = 20;
    for (int place = 0; place <= kPlaces && is_free; ++place)
      is_free = isFreeInSight(scene, from + (1.0 * place / kPlaces) * (to - from), kNearest_m);
    if (is_free) way.push_back(to);
  }
  one.path_m = way;
  one.path_m.insert(one.path_m.end(), way.rbegin() + 1, way.rend());
  one.loop_corners = {0, one.path_m.size() - 1};
  return one;
}

/// Free hands at two of the other scenes, chosen by chance.
Cases freeHands(Stage stage) {
  constexpr int kScenes = 3;
  using Make = std::function<Cases(Stage)>;
  const Make makes[] = {[](Stage s) { return balls(s, 0.025); },
                        [](Stage s) { return rods(s, 0.01); },
                        [](Stage s) { return vees(s, 60 * kDegree); },
                        [](Stage s) { return halfSunk(s, false); },
                        [](Stage s) { return plateSide(s, 0.003, 0.015); },
                        rings,
                        twoBalls,
                        hollowCorner,
                        cube,
                        bowls};
  std::vector<std::size_t> order(std::size(makes));
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::shuffle(order, stage.random());
  Cases cases;
  for (int i = 0; i < kScenes; ++i)
    cases.push_back(withFreeHand(makes[order[static_cast<std::size_t>(i)]](stage).back(), stage));
  return cases;
}

/// A body by chance, and how deep a hand may be pressed into it.
struct RandomBody {
  DistanceShape shape;
  double most_pressed_m;
  double inner_m;  ///< radius of a ball that fits into it
};
RandomBody randomConvex(Stage& stage) {
  constexpr double kShare = 0.5;
  const double radius = stage.uniform(0.012, 0.05);
  switch (static_cast<int>(stage.uniform(0, 3))) {
    case 0:
      return {BallShape{radius}, kShare * radius, radius};
    case 1:
      return {CapsuleShape{0.7 * radius, stage.uniform(0.03, 0.1)}, 0.7 * kShare * radius, 0.7 * radius};
    default: {
      const Vec3 half{stage.uniform(0.02, 0.06), stage.uniform(0.02, 0.06), stage.uniform(0.01, 0.04)};
      const double thinnest = std::min({half.x, half.y, half.z});
      return {BoxShape{half}, kShare * thinnest, thinnest};
    }
  }
}
RigidFrame randomFrame(Stage& stage, const Vec3& origin_m) {
  return frameOf(origin_m, unitOf(randomIn(stage, 1)), unitOf(randomIn(stage, 1)));
}

/// Bodies by chance of each kind: returns how deep a hand may be pressed into them.
double addConvex(Stage& stage) {
  const RandomBody body = randomConvex(stage);
  stage.add(body.shape, randomFrame(stage, {})).addWall();
  return body.most_pressed_m;
}
double addConcave(Stage& stage) {
  stage.stand(stage.uniform(0, 15) * kDegree);
  switch (static_cast<int>(stage.uniform(0, 4))) {
    case 0: {
      const double half = stage.uniform(25, 70) * kDegree;
      for (const double side : {-1.0, 1.0})
        stage.add(PlaneShape{}, frameOf({}, {side * std::cos(half), 0, std::sin(half)}, {0, 1, 0}));
      break;
    }
    case 1:
      stage.stand(within(stage.frame(), cornerFrame()));
      for (const Vec3& normal : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
        stage.add(PlaneShape{}, frameOf({}, normal, {normal.y, normal.z, normal.x}));
      break;
    case 2:
      stage.add(BowlShape{stage.uniform(0.03, 0.08)});
      break;
    default: {
      const double inner = stage.uniform(0.02, 0.05);
      const double outer = inner + stage.uniform(0.02, 0.04);
      stage.add(RingShape{inner, outer, stage.uniform(0.006, 0.012)}).addWall();
    }
  }
  return 0.008;
}
double addTouching(Stage& stage) {
  const RandomBody first = randomConvex(stage);
  stage.add(first.shape, randomFrame(stage, {}));
  double most_pressed = first.most_pressed_m;
  if (stage.uniform(0, 1) < 0.5) {
    stage.add(PlaneShape{}, frameOf({0, 0, -stage.uniform(0, first.inner_m)},
                                    turned({0, 0, 1}, {stage.uniform(-40, 40) * kDegree, 0, 0}), {1, 0, 0}));
    return most_pressed;
  }
  const int others = stage.uniform(0, 1) < 0.5 ? 1 : 2;
  for (int i = 0; i < others; ++i) {
    const RandomBody other = randomConvex(stage);
    Vec3 centre = stage.frame().positionOut(0.1 * unitOf(randomIn(stage, 1)));
    for (int round = 0; round < 10; ++round) {
      const NearestSurface nearest = stage.bodies().front().nearest(centre, 0);
      centre += (other.inner_m - nearest.distance_m) * nearest.outward;
    }
    stage.add(other.shape, randomFrame(stage, stage.frame().positionIn(centre)));
    most_pressed = std::min(most_pressed, other.most_pressed_m);
  }
  stage.addWall();
  return most_pressed;
}
double addThin(Stage& stage) {
  const double radius = stage.uniform(8, 14) / 2 * -stage.middle_m().z / rt::DepthModelParameters{}.fx_px;
  const double tilt = stage.uniform(0, 30) * kDegree;
  stage.stand(tilt);
  if (stage.uniform(0, 1) < 0.5) {
    stage.add(CapsuleShape{radius, 0.1}).addWall();
  } else {
    stage.add(BoxShape{{0.08, radius, 0.01}}).addWall();
  }
  return 0.6 * radius;
}

/// A stroke by chance: from a free place that the camera sees into the surface nearest to it, then along
/// that; it ends where the force of the god-object exceeds 5 N, where the HIP comes within a pixel and 1 mm
/// of leaving through another face, or where the camera could not know what holds it.
SceneCase wandering(Stage& stage, std::vector<ImageGap> gaps, double most_pressed_m) {
  constexpr int kTries = 300;
  constexpr int kCorners = 40;
  constexpr std::size_t kFewest = 8;
  constexpr double kStride_m = 0.002;
  constexpr double kMost_n = 5;
  constexpr double kStiffness_n_per_m = 500;
  const double margin = 0.001 - stage.middle_m().z / rt::DepthModelParameters{}.fx_px;
  SceneCase one = stage.along({});
  one.gaps = std::move(gaps);
  const DistanceScene scene(one.bodies, {}, {}, 0);
  for (int i = 0; i < kTries && one.path_m.size() < kFewest; ++i) {
    const Vec3 start = stage.middle_m() + randomIn(stage, 0.07);
    NearestSurface nearest = scene.nearest(start, 0);
    if (nearest.distance_m > 0.03 || !isFreeInSight(scene, start, 0.012)) continue;
    const double pressed = std::min(stage.pressed_m(), most_pressed_m);
    Vec3 place = start - nearest.distance_m * nearest.outward;
    Vec3 along = unitOf(cross(nearest.outward, randomIn(stage, 1)));
    const double bend = stage.uniform(-3, 3) * kDegree;
    GodObject ideal(scene);
    one.path_m = {start};
    Vec3 hip = start;
    for (int corner = 0; corner < kCorners; ++corner) {
      const Vec3 next = place - pressed * nearest.outward;
      const int ticks = std::max(1, static_cast<int>(norm(next - hip) / 1e-4));
      bool holds = true;
      for (int tick = 1; tick <= ticks && holds; ++tick) {
        const Vec3 there = hip + (1.0 * tick / ticks) * (next - hip);
        const Vec3 pull = ideal.follow(there, 0) - there;
        const double inside = std::max(-scene.signedDistance(there, 0), 0.0);
        holds = kStiffness_n_per_m * norm(pull) < kMost_n &&
                inside >= std::min(0.9 * norm(pull), margin) - 1e-6 && isKnown(scene, there, there + pull, 0);
      }
      if (!holds) break;
      one.path_m.push_back(next);
      hip = next;
      place += kStride_m * along;
      for (int round = 0; round < 5; ++round) {
        nearest = scene.nearest(place, 0);
        place += -nearest.distance_m * nearest.outward;
      }
      along = turned(along - dot(along, nearest.outward) * nearest.outward, bend * nearest.outward);
      if (!(norm(along) > 0.01)) break;
      along = unitOf(along);
    }
  }
  return one;
}

/// Strokes over bodies by chance; none where no place for one was found.
Cases wanderingOver(Stage stage, double (*add)(Stage&), bool with_gaps) {
  constexpr std::size_t kFewest = 8;
  const double most_pressed = add(stage);
  std::vector<ImageGap> gaps;
  for (int i = static_cast<int>(stage.uniform(1, 4)); with_gaps && i > 0; --i) {
    const bool is_band = stage.uniform(0, 1) < 0.5;
    const Vec3 place = stage.middle_m() + randomIn(stage, 0.04);
    gaps.push_back(gapAround(place, stage.uniform(0.005, 0.03), is_band ? 1 : stage.uniform(0.005, 0.03)));
  }
  const SceneCase one = wandering(stage, gaps, most_pressed);
  return one.path_m.size() < kFewest ? Cases{} : Cases{one};
}

GodObjectScene entry(std::string name, SceneGroup kind, std::function<Cases(Stage)> make) {
  return {.name = std::move(name),
          .kind = kind,
          .make = [make = std::move(make)](const ScenePlacement& placement, std::mt19937& random) {
            return make(Stage(placement, random));
          }};
}

}  // namespace

const std::vector<GodObjectScene>& godObjectScenes() {
  static const std::vector<GodObjectScene> scenes = [] {
    std::vector<GodObjectScene> all{
        entry("plane", SceneGroup::front, [](Stage stage) { return planes(stage, 0); }),
        entry("plane40", SceneGroup::front, [](Stage stage) { return planes(stage, 40 * kDegree); })};
    for (const int mm : {50, 100}) {
      all.push_back(entry(fmt::format("ball{}", mm), SceneGroup::front,
                          [mm](Stage stage) { return balls(stage, mm / 2000.0); }));
    }
    for (const int mm : {20, 40}) {
      all.push_back(entry(fmt::format("rod{}", mm), SceneGroup::front,
                          [mm](Stage stage) { return rods(stage, mm / 2000.0); }));
    }
    for (const int deg : {60, 90, 120}) {
      all.push_back(entry(fmt::format("vee{}", deg), SceneGroup::crease,
                          [deg](Stage stage) { return vees(stage, deg * kDegree); }));
    }
    all.push_back(entry("halfsunk", SceneGroup::other, [](Stage stage) { return halfSunk(stage, false); }));
    all.push_back(entry("besidesunk", SceneGroup::free, [](Stage stage) { return halfSunk(stage, true); }));
    all.push_back(
        entry("plateside", SceneGroup::side, [](Stage stage) { return plateSide(stage, 0.003, 0.015); }));
    all.push_back(
        entry("plateside3", SceneGroup::side, [](Stage stage) { return plateSide(stage, 0.003, 0.003); }));
    all.push_back(entry("ring", SceneGroup::side, rings));
    all.push_back(entry("twoballs", SceneGroup::other, twoBalls));
    all.push_back(entry("hollowcorner", SceneGroup::other, hollowCorner));
    all.push_back(entry("cube", SceneGroup::other, cube));
    all.push_back(entry("bowl", SceneGroup::other, bowls));
    all.push_back(entry("band", SceneGroup::front, bands));
    all.push_back(entry("freehand", SceneGroup::free, freeHands));
    all.push_back(entry("passing", SceneGroup::free, [](Stage stage) {
      return Cases{passing(stage, false), passing(stage, true)};
    }));
    all.back().at_m = 2;
    return all;
  }();
  return scenes;
}

const std::vector<GodObjectScene>& randomScenes() {
  const auto by_chance = [](std::string name, double (*add)(Stage&), bool with_gaps = false) {
    return entry(std::move(name), SceneGroup::random,
                 [add, with_gaps](Stage stage) { return wanderingOver(stage, add, with_gaps); });
  };
  static const std::vector<GodObjectScene> scenes{
      by_chance("convex", addConvex), by_chance("concave", addConcave), by_chance("touching", addTouching),
      by_chance("thin", addThin), by_chance("gaps", addConvex, true)};
  return scenes;
}

}  // namespace hapticd::tools
