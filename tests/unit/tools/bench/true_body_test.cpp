// SPDX-License-Identifier: Apache-2.0
// The exact bodies against methods that do not share their closed forms: alternating projections, sphere
// tracing and dense sampling of the surface.

#include "tools/lib/truth/body_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "drivers/camera/kinect_image.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

class Places {
 public:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vec3 inCube(double half_m) {
    return {between(-half_m, half_m), between(-half_m, half_m), between(-half_m, half_m)};
  }
  Vec3 direction() { return unitOf(inCube(1) + Vec3{0, 0, 1e-3}); }

 private:
  std::mt19937 random_{7};
};

/// Dykstra's alternating projections onto the half-spaces, which converge to the nearest common point.
Vec3 alternatingProjections(const std::vector<Face>& faces, const Vec3& p) {
  constexpr int kRounds = 20000;
  std::vector<Vec3> corrections(faces.size());
  Vec3 x = p;
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < faces.size(); ++i) {
      const Vec3 y = x + corrections[i];
      x = y - std::max(0.0, faces[i].above_m(y)) * faces[i].outward;
      corrections[i] = y - x;
    }
  }
  return x;
}

struct NamedBody {
  std::string name;
  TrueBody body;
};
std::vector<NamedBody> allBodies() {
  const std::vector<Face> block{
      {{0, 0, 1}, 0},     {{1, 0, 0}, 0.02},  {{-1, 0, 0}, 0.05},        {{0, 1, 0}, 0.03},
      {{0, -1, 0}, 0.03}, {{0, 0, -1}, 0.06}, {unitOf({1, 0, 1}), 0.005}};
  const std::vector<Face> corner{{unitOf({1, 0.1, 0}), 0}, {unitOf({0, 1, 0.2}), 0}, {{0, 0, 1}, 0}};
  return {{"block with a bevel", ConvexBody{block}},
          {"hollow corner", HollowBody{corner}},
          {"rod", RodBody{.radius_m = 0.02, .half_length_m = 0.05}},
          {"ball", BallBody{.radius_m = 0.04}}};
}

double distanceTo(const TrueBody& body, const Vec3& p) {
  return std::visit([&p](const auto& solid) { return solid.signedDistance(p); }, body);
}

TEST(TrueBody, FindsTheNearestCommonPointOfHalfSpacesAsAlternatingProjectionsDo) {
  constexpr double kConverged_m = 1e-7;  // what 20000 rounds leave between faces at 35 degrees and more
  Places places;
  for (const NamedBody& named : allBodies()) {
    const auto* convex = std::get_if<ConvexBody>(&named.body);
    if (convex == nullptr) continue;
    for (int i = 0; i < 40; ++i) {
      const Vec3 p = places.inCube(0.12);
      EXPECT_LT(norm(closestInAll(convex->faces, p) - alternatingProjections(convex->faces, p)),
                kConverged_m);
    }
  }
}

TEST(TrueBody, RaysMeetTheSurfaceWhereSphereTracingDoes) {
  constexpr double kFar_m = 1;
  constexpr double kTraced_m = 1e-9;
  constexpr double kGrazing_m = 1e-5;  // a ray that passes that near may go either way
  Places places;
  for (const NamedBody& named : allBodies()) {
    int met = 0;
    for (int i = 0; i < 400; ++i) {
      const bool hollow = std::holds_alternative<HollowBody>(named.body);
      const Vec3 origin = hollow ? Vec3{0.1, 0.1, 0.1} + places.inCube(0.05) : 0.5 * places.direction();
      const Vec3 direction = hollow ? places.direction() : unitOf(places.inCube(0.05) - origin);
      const double entry =
          std::visit([&](const auto& solid) { return solid.rayEntry(origin, direction); }, named.body);
      double traced = 0;
      double nearest = kFar_m;
      for (int step = 0; step < 20000 && traced < kFar_m; ++step) {
        const double distance = distanceTo(named.body, origin + traced * direction);
        nearest = std::min(nearest, distance);
        if (distance < kTraced_m) break;
        traced += distance;
      }
      if (nearest >= kTraced_m && nearest < kGrazing_m) continue;
      if (nearest >= kTraced_m) {
        EXPECT_GT(entry, kFar_m) << named.name;
      } else {
        ++met;
        // An oblique ray gets as far beyond the last step as the surface is oblique; 1e-3 is a grazing one.
        EXPECT_NEAR(entry, traced, kTraced_m / 1e-3) << named.name;
      }
    }
    EXPECT_GT(met, 50) << named.name;
  }
}

TEST(TrueBody, TheProxyOfARoundBodyIsItsNearestPoint) {
  const RodBody rod{.radius_m = 0.02, .half_length_m = 0.05};
  constexpr int kSteps = 2000;
  // The nearest sample lies within half a step of the true point, along the axis and around it.
  constexpr double kStep_m = 0.1 / kSteps;
  constexpr double kSampling_m = 2e-6;
  static_assert(kStep_m * kStep_m / (2 * 0.005) < kSampling_m);
  Places places;
  for (int i = 0; i < 20; ++i) {
    const double angle = places.between(-3, 3);
    const double inside = places.between(0.005, 0.019);
    const Vec3 hip{places.between(-0.04, 0.04), inside * std::cos(angle), inside * std::sin(angle)};
    double nearest = 1;
    for (int step = 0; step < kSteps; ++step) {
      const double around = 2 * M_PI * step / kSteps;
      const Vec3 place{hip.x, rod.radius_m * std::cos(around), rod.radius_m * std::sin(around)};
      nearest = std::min(nearest, norm(place - hip));
    }
    HoldingSide side;
    const auto held = rod.hold(hip, hip, side);
    ASSERT_TRUE(held);
    EXPECT_NEAR(norm(held->proxy_m - hip), nearest, kSampling_m);
    EXPECT_NEAR(rod.signedDistance(held->proxy_m), 0, 1e-15);
    EXPECT_NEAR(dot(held->outward, held->proxy_m - hip), norm(held->proxy_m - hip), 1e-15);
  }
}

TEST(TrueBody, ABlockHoldsTheProxyOnTheFaceThatTheHipCameThroughThoughAnotherIsNearer) {
  const ConvexBody block{{{{0, 0, 1}, 0}, {{1, 0, 0}, 0}}};
  HoldingSide side;
  EXPECT_FALSE(block.hold({-0.003, 0, 0.001}, {-0.003, 0, 0.002}, side));
  const auto held = block.hold({-0.003, 0, -0.008}, {-0.003, 0, 0.001}, side);
  ASSERT_TRUE(held);
  EXPECT_NEAR(norm(held->proxy_m - Vec3{-0.003, 0, 0}), 0, 1e-15);
  EXPECT_EQ(held->outward, (Vec3{0, 0, 1}));
  EXPECT_FALSE(block.hold({0.001, 0, -0.008}, {-0.003, 0, -0.008}, side));
  // Back through the side it is the side that holds.
  const auto aside = block.hold({-0.003, 0, -0.008}, {0.001, 0, -0.008}, side);
  ASSERT_TRUE(aside);
  EXPECT_EQ(aside->outward, (Vec3{1, 0, 0}));
}

TEST(TrueBody, TheProxySlidesOverAnObtuseEdgeWhereTheNextFaceHoldsItNearer) {
  // Two faces whose normals are 60 degrees apart meet at the origin.
  const Vec3 next{std::sin(M_PI / 3), 0, std::cos(M_PI / 3)};
  const ConvexBody body{{{{0, 0, 1}, 0}, {next, 0}}};
  HoldingSide side;
  Vec3 before{-0.02, 0, 0.001};
  EXPECT_FALSE(body.hold(before, before, side));
  for (double x = -0.02; x < 0.004; x += 0.001) {
    const Vec3 hip{x, 0, -0.008};
    const auto held = body.hold(hip, before, side);
    before = hip;
    if (!held) break;
    // The foot on the first face lies on the body's surface as long as it is not beyond the edge, x = 0.
    const Vec3 expected = x <= 1e-12 ? Vec3{x, 0, 0} : hip - dot(next, hip) * next;
    EXPECT_NEAR(norm(held->proxy_m - expected), 0, 1e-12) << x;
  }
}

TEST(TrueBody, ACreaseHoldsTheProxyInItsEdge) {
  const HollowBody crease{{{{0, 0, 1}, 0}, {{1, 0, 0}, 0}}};
  HoldingSide side;
  const auto held = crease.hold({-0.008, 0.1, -0.008}, {0.1, 0.1, 0.1}, side);
  ASSERT_TRUE(held);
  EXPECT_NEAR(norm(held->proxy_m - Vec3{0, 0.1, 0}), 0, 1e-15);
  EXPECT_NEAR(norm(held->outward - unitOf({1, 0, 1})), 0, 1e-15);
}

TEST(BodyScene, AMovingPlaneIsWhereItsVelocityHasCarriedItWhenATickAsks) {
  BodyMotion motion;
  motion.start_s = 1;
  motion.velocity_m_per_s = {0, 0, 0.1};
  const TrueBody plane = ConvexBody{{{{0, 0, 1}, 0}}};
  BodyScene scene({plane}, {.origin_m = {0, 0, -1}}, motion, {}, 1);
  EXPECT_NEAR(scene.trueDepth(100, 200, 0.5), 1, 1e-12);
  EXPECT_NEAR(scene.trueDepth(100, 200, 1.3), 0.97, 1e-12);
  IdealConstraint ideal(scene);
  const Vec3 hip{0, 0, -0.98};
  EXPECT_FALSE(ideal.follow(hip, 1.1));
  const auto held = ideal.follow(hip, 1.3);
  ASSERT_TRUE(held);
  EXPECT_NEAR(norm(held->proxy_m - Vec3{0, 0, -0.97}), 0, 1e-12);
}

TEST(BodyScene, TheCameraSeesEachBodyToItsRawUnit) {
  const rt::DepthModelParameters model;
  for (const NamedBody& named : allBodies()) {
    BodyScene scene({named.body}, {.origin_m = {-0.2, -0.2, -0.9}}, {}, model, 1);  // in front of all faces
    auto frame = std::make_unique<rt::DepthFrame>();
    scene.render(0, 1, SceneNoise::quantised, *frame);
    int seen = 0;
    for (int row = 0; row < drivers::kKinectHeight; row += 7) {
      for (int column = 0; column < drivers::kKinectWidth; column += 7) {
        const double depth = scene.trueDepth(column, row, 0);
        const std::uint16_t raw = frame->raw[row * drivers::kKinectWidth + column];
        if (depth < model.near_m || depth > model.far_m) {
          EXPECT_EQ(raw, drivers::kKinectNoMeasurement);
          continue;
        }
        ++seen;
        const double disparity = (1 / depth - model.b_per_m) / model.a_per_m;
        EXPECT_NEAR(raw, disparity, 0.5 + 1e-4) << named.name;  // single precision keeps 1e-4 of 2047
      }
    }
    EXPECT_GT(seen, 20) << named.name;
  }
}

TEST(BodyScene, ATurningSceneKeepsItsShape) {
  BodyMotion motion;
  motion.turning_rad_per_s = {0.1, -0.2, 0.05};
  motion.sway_m = {0.003, 0.002, 0.001};
  motion.sway_rad = {0.01, 0.02, 0};
  BodyScene scene({BallBody{0.05}}, {.origin_m = {0.1, 0, -1}}, motion, {}, 1);
  Places places;
  for (int i = 0; i < 20; ++i) {
    const double t = places.between(0, 2);
    const RigidFrame frame = scene.frameAt(t);
    EXPECT_NEAR(norm(cross(frame.x, frame.y) - frame.z), 0, 1e-12);
    const Vec3 p = places.inCube(0.2);
    EXPECT_NEAR(norm(frame.positionIn(frame.positionOut(p)) - p), 0, 1e-12);
    EXPECT_NEAR(scene.signedDistance(frame.positionOut(p), t), norm(p) - 0.05, 1e-12);
  }
}

TEST(Beat, BeginsAtRestAtOneEndAndMovesFromThereAlone) {
  const Beat heart{.hz = 1.2, .amplitudes_m = {0.01, 0.005, 0.0025}};
  EXPECT_EQ(heart.displacement_m(0), 0);
  EXPECT_LT(heart.displacement_m(1e-4), 1e-6);                 // no speed
  EXPECT_NEAR(heart.displacement_m(0.5 / 1.2), 0.025, 1e-12);  // 2 (a_1 + a_3): the ends of odd harmonics
  EXPECT_NEAR(heart.displacement_m(1 / 1.2), 0, 1e-12);
  double most_m_per_s2 = 0;
  constexpr double kStep_s = 1e-3;
  for (double t_s = kStep_s; t_s < 1; t_s += kStep_s) {
    const double change = heart.displacement_m(t_s + kStep_s) - 2 * heart.displacement_m(t_s) +
                          heart.displacement_m(t_s - kStep_s);
    most_m_per_s2 = std::max(most_m_per_s2, std::abs(change) / (kStep_s * kStep_s));
  }
  // (2 pi 1.2)^2 (0.01 + 4 0.005 + 9 0.0025) where all harmonics are at an end at once
  EXPECT_NEAR(most_m_per_s2, 2.985, 0.01);
}

}  // namespace
}  // namespace hapticd::tools
