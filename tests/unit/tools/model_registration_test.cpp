// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "config/additions/addition_checks.h"
#include "rt/base/pose.h"
#include "rt/fixtures/fixture.h"
#include "tools/lib/registration/model_registration.h"
#include "tools/lib/registration/touch.h"

namespace hapticd::tools {
namespace {

using config::FixtureSettings;
using config::RegionSettings;
using rt::Vec3;

// Landmarks of a model, and what was made in its frame, moved to the world.

/// Rounding of some dozens of operations on numbers below 10, also of angles in degrees.
constexpr double kRounding = 1e-9;
constexpr double kRadPerDeg = std::numbers::pi / 180;

const rt::PoseParameters kPose{{0.3, -0.2, -0.9}, 0.4, -0.7, 2.1};

Vec3 turned(const std::array<double, 9>& r, const Vec3& p) {
  return {r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
          r[6] * p.x + r[7] * p.y + r[8] * p.z};
}
Vec3 moved(const Vec3& p) {
  return kPose.position_m + turned(rt::rotationOf(kPose), p);
}

config::SceneAdditions model() {
  config::SceneAdditions additions;
  using Kind = rt::FixtureKind;
  additions.fixtures = {
      {.name = "a", .kind = Kind::sphere, .position_m = {0.01, 0.02, 0.03}, .radius_m = 0.02},
      {.name = "b", .kind = Kind::box, .position_m = {0.1, 0, 0}, .size_m = {0.01, 0.02, 0.03}},
      {.name = "c", .kind = Kind::plane, .position_m = {0, 0.1, 0}, .normal = {0, 0, 2}},
      {.name = "d", .kind = Kind::capsule, .position_m = {0, 0, 0.1}, .end_m = {0, 0.1, 0}, .radius_m = 0.01},
      {.name = "e", .kind = Kind::cone, .position_m = {0.1, 0.1, 0}, .axis = {0, 1, 0}},
      {.name = "f", .kind = Kind::path, .points_m = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}}},
      {.name = "g", .kind = Kind::standoff, .clearance_m = 0.005}};
  additions.fixtures[1].rotation_deg = {10, 20, 30};
  additions.regions = {{.name = "r", .position_m = {0.05, 0.06, 0.07}, .radius_m = 0.01},
                       {.name = "s", .shape = rt::ShapeKind::box, .size_m = {0.01, 0.01, 0.02}}};
  return additions;
}

TEST(ModelRegistration, MovesPlacesDirectionsEndsAndPoints) {
  const auto world = movedToWorld(model(), kPose);
  ASSERT_TRUE(world) << world.error().text();
  const auto& fixtures = world->fixtures;
  EXPECT_LT(norm(fixtures[0].position_m - moved({0.01, 0.02, 0.03})), kRounding);
  EXPECT_EQ(fixtures[0].radius_m, 0.02);
  EXPECT_LT(norm(fixtures[2].normal - turned(rt::rotationOf(kPose), {0, 0, 2})), kRounding);
  EXPECT_LT(norm(fixtures[3].end_m - moved({0, 0.1, 0})), kRounding);
  EXPECT_LT(norm(fixtures[4].axis - turned(rt::rotationOf(kPose), {0, 1, 0})), kRounding);
  EXPECT_LT(norm(fixtures[5].points_m[2] - moved({0.1, 0.1, 0})), kRounding);
  EXPECT_EQ(fixtures[6], model().fixtures[6]);
  EXPECT_LT(norm(world->regions[0].position_m - moved({0.05, 0.06, 0.07})), kRounding);
}

TEST(ModelRegistration, KeepsDistancesAndAllElse) {
  const auto world = movedToWorld(model(), kPose);
  ASSERT_TRUE(world);
  const config::SceneAdditions before = model();
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_NEAR(norm(world->fixtures[i].position_m - world->fixtures[k].position_m),
                  norm(before.fixtures[i].position_m - before.fixtures[k].position_m), kRounding);
    }
  }
  for (std::size_t i = 0; i < before.fixtures.size(); ++i) {
    EXPECT_EQ(world->fixtures[i].name, before.fixtures[i].name);
    EXPECT_EQ(world->fixtures[i].size_m, before.fixtures[i].size_m);
    EXPECT_EQ(world->fixtures[i].frame, "world");
  }
}

/// Rotation of a box by its angles.
std::array<double, 9> rotationOf(const Vec3& angles_deg) {
  return rt::rotationOf(
      {{}, kRadPerDeg * angles_deg.x, kRadPerDeg * angles_deg.y, kRadPerDeg * angles_deg.z});
}

// A corner of the box in the model, moved to the world, is the corner of the box in the world.
TEST(ModelRegistration, TurnsBoxesWithTheModel) {
  std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  std::uniform_real_distribution<double> angle(-180, 180);
  for (int trial = 0; trial < 100; ++trial) {
    config::SceneAdditions additions = model();
    const Vec3 rotation_deg{angle(random), angle(random) / 2, angle(random)};
    additions.fixtures[1].rotation_deg = rotation_deg;
    additions.regions[1].rotation_deg = rotation_deg;
    const auto world = movedToWorld(additions, kPose);
    ASSERT_TRUE(world);
    const Vec3 corner{0.005, -0.01, 0.015};
    EXPECT_LT(
        norm(world->fixtures[1].position_m + turned(rotationOf(world->fixtures[1].rotation_deg), corner) -
             moved(additions.fixtures[1].position_m + turned(rotationOf(rotation_deg), corner))),
        kRounding);
    EXPECT_LT(norm(world->regions[1].position_m + turned(rotationOf(world->regions[1].rotation_deg), corner) -
                   moved(turned(rotationOf(rotation_deg), corner))),
              kRounding);
  }
}

TEST(ModelRegistration, RefusesWhatIsNotInTheFrameOfTheModel) {
  config::SceneAdditions camera = model();
  camera.fixtures[0].frame = "camera";
  const auto refused = movedToWorld(camera, kPose);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().where, "fixture a");
  EXPECT_NE(refused.error().what.find("frame of the camera"), std::string::npos);
  config::SceneAdditions label = model();
  label.regions[0].place = rt::TissuePlace::label;
  ASSERT_FALSE(movedToWorld(label, kPose));
  EXPECT_EQ(movedToWorld(label, kPose).error().where, "region r");
}

TEST(ModelRegistration, TheCentreIsTheMeanOfWhatHasAPlace) {
  config::SceneAdditions additions;
  EXPECT_FALSE(centreOf(additions));
  additions.fixtures = {{.name = "g", .kind = rt::FixtureKind::standoff, .clearance_m = 0.005}};
  EXPECT_FALSE(centreOf(additions));
  additions.fixtures.push_back(
      {.name = "f", .kind = rt::FixtureKind::path, .points_m = {{0, 0, 0}, {2, 0, 0}}});
  additions.fixtures.push_back(
      {.name = "d", .kind = rt::FixtureKind::capsule, .position_m = {3, 0, 0}, .end_m = {3, 2, 0}});
  EXPECT_LT(norm(*centreOf(additions) - Vec3{2, 0.5, 0}), kRounding);
}

// The prediction against the error itself: landmarks of known noise, registered many times. The mean square
// of 4000 errors scatters by 3 %, the formula is of first order in the noise.
TEST(ModelRegistration, PredictsTheErrorAtATarget) {
  const std::vector<Vec3> landmarks{
      {0, 0, 0}, {0.1, 0, 0}, {0, 0.08, 0}, {0.05, 0.05, 0.06}, {-0.03, 0.04, 0.02}};
  const Vec3 target{0.12, -0.05, 0.1};
  std::mt19937 random(2);  // NOLINT(cert-msc51-cpp): the same each time
  std::normal_distribution<double> noise_m(0, 0.0005);
  double squares = 0;
  double predicted_squares = 0;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<PointPair> pairs;
    for (const Vec3& landmark : landmarks) {
      pairs.push_back(
          {"", landmark, moved(landmark) + Vec3{noise_m(random), noise_m(random), noise_m(random)}});
    }
    const auto fit = fitRigid(pairs);
    ASSERT_TRUE(fit);
    const Vec3 found = fit->T_world_camera.position_m + turned(rt::rotationOf(fit->T_world_camera), target);
    squares += std::pow(norm(found - moved(target)), 2);
    predicted_squares += std::pow(expectedTargetError_m(pairs, fit->rms_m, moved(target)), 2);
  }
  EXPECT_NEAR(std::sqrt(predicted_squares / squares), 1, 0.05);
}

TEST(ModelLandmarks, AreReadBesideFixturesAndBackFromTheirOwnText) {
  const auto read = landmarksFromText(
      "landmarks:\n  - {name: tip, position_m: [0.01, -0.02, 3e-2]}\n  - name: notch\n"
      "    position_m: [0, 0, 1]\nfixtures: []\n",
      "model.yaml");
  ASSERT_TRUE(read) << read.error()[0].text();
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[0].name, "tip");
  EXPECT_EQ((*read)[0].position_m, (Vec3{0.01, -0.02, 0.03}));
  const auto again = landmarksFromText(textOf(*read), "again.yaml");
  ASSERT_TRUE(again);
  EXPECT_EQ((*again)[1].name, "notch");
  EXPECT_EQ((*again)[1].position_m, (Vec3{0, 0, 1}));
}

TEST(ModelLandmarks, AreRefusedWithLineAndRemedy) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"fixtures: []\n", "m.yaml: has no list"},
      {"landmarks: 5\n", "has no list"},
      {"landmarks:\n  - {position_m: [0, 0, 0]}\n", "m.yaml:2: a landmark has no name"},
      {"landmarks:\n  - {name: a, position_m: [0, 0]}\n", "m.yaml:2: \"a\": position_m is not"},
      {"landmarks:\n  - {name: a, position_m: [0, 0, .nan]}\n", "position_m is not"},
      {"landmarks:\n  - {name: a, position_m: [0, 0, 50]}\n", "within -20..20 m"},
      {"landmarks:\n  - {name: a}\n", "position_m is not"},
      {"landmarks:\n  - {name: a, position_m: [0, 0, 0]}\n  - {name: a, position_m: [0, 0, 1]}\n",
       "m.yaml:3: \"a\" is there twice"},
      {"landmarks:\n  - {name: a, position_mm: [0, 0, 0]}\n", "there is no member \"position_mm\""},
      {"marks:\n  - {name: a, position_m: [0, 0, 0]}\n", ""}};
  for (const auto& [text, said] : cases) {
    const auto read = landmarksFromText(text, "m.yaml");
    ASSERT_FALSE(read) << text;
    EXPECT_NE(read.error()[0].text().find(said), std::string::npos) << read.error()[0].text();
    EXPECT_NE(read.error()[0].remedy, "") << text;
  }
}

TEST(ModelLandmarks, PairUpByName) {
  const std::vector<PlacedLandmark> model{{"a", {1, 0, 0}}, {"b", {2, 0, 0}}, {"c", {3, 0, 0}}};
  const auto pairs = pairsOf(model, {{"c", {0, 3, 0}}, {"a", {0, 1, 0}}});
  ASSERT_TRUE(pairs);
  ASSERT_EQ(pairs->size(), 2U);
  EXPECT_EQ((*pairs)[0].name, "a");
  EXPECT_EQ((*pairs)[0].camera_m, (Vec3{1, 0, 0}));
  EXPECT_EQ((*pairs)[1].world_m, (Vec3{0, 3, 0}));
  EXPECT_EQ(pairsOf(model, {{"d", {}}}).error().where, "d");
}

constexpr double kTolerance_m = 0.001;

/// Readings on a helix of radius 0.05 m and a rise of 0.02 m each turn.
std::vector<Vec3> helix(double turns, double noise_m) {
  std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  std::normal_distribution<double> normal(0, 1);
  std::vector<Vec3> readings;
  for (double angle = 0; angle < turns * 2 * std::numbers::pi; angle += 0.05) {
    const Vec3 off = noise_m * Vec3{normal(random), normal(random), normal(random)};
    readings.push_back(
        Vec3{0.05 * std::cos(angle), 0.05 * std::sin(angle), 0.02 * angle / (2 * std::numbers::pi)} + off);
  }
  return readings;
}

TEST(StrokePath, AStraightStrokeIsTwoPoints) {
  std::vector<Vec3> readings;
  for (int i = 0; i <= 100; ++i) readings.push_back({0.001 * i * i / 100, 0, -1});
  const auto path = pathOf(readings, kTolerance_m);
  ASSERT_TRUE(path);
  ASSERT_EQ(path->points_m.size(), 2U);
  EXPECT_LT(norm(path->points_m[0] - readings.front()), 1e-12);
  EXPECT_LE(norm(path->points_m[1] - readings.back()), kStrokeStep_m);
  EXPECT_NEAR(path->length_m, 0.1, kStrokeStep_m);
  EXPECT_LT(path->residuals.rms_m, kStrokeStep_m);
}

TEST(StrokePath, KeepsTheCornerOfAStroke) {
  std::vector<Vec3> readings;
  for (int i = 0; i <= 20; ++i) readings.push_back({0.005 * i, 0, -1});
  for (int i = 1; i <= 20; ++i) readings.push_back({0.1, 0.005 * i, -1});
  const auto path = pathOf(readings, kTolerance_m);
  ASSERT_TRUE(path);
  ASSERT_EQ(path->points_m.size(), 3U);
  EXPECT_LT(norm(path->points_m[1] - Vec3{0.1, 0, -1}), kStrokeStep_m);
}

TEST(StrokePath, StaysWithinItsToleranceOfTheStroke) {
  const auto path = pathOf(helix(3, 0), kTolerance_m);
  ASSERT_TRUE(path);
  EXPECT_EQ(path->tolerance_m, kTolerance_m);
  // a chord between readings of 2.5 mm lies 0.02 mm inside the circle
  EXPECT_LT(path->residuals.largest_m, kTolerance_m + 3e-5);
  EXPECT_GT(path->points_m.size(), 20U);
  EXPECT_LT(path->points_m.size(), 150U);
  EXPECT_FALSE(config::pathProblem(path->points_m, false));
}

TEST(StrokePath, OfATremblingHandIsAPathThatTheDaemonTakes) {
  const auto path = pathOf(helix(2, 1e-4), kTolerance_m);
  ASSERT_TRUE(path);
  EXPECT_FALSE(config::pathProblem(path->points_m, false));
  EXPECT_LT(path->residuals.largest_m, kTolerance_m + 6e-4) << "5 standard deviations more";
}

TEST(StrokePath, WidensItsToleranceWhereItTakesTooManyPoints) {
  const auto path = pathOf(helix(30, 0), 1e-4);
  ASSERT_TRUE(path);
  EXPECT_LE(path->points_m.size(), rt::kMaxPathPoints);
  EXPECT_GT(path->tolerance_m, 1e-4);
  EXPECT_LT(path->residuals.largest_m, path->tolerance_m + 3e-5);
}

TEST(StrokePath, ARestingHandAddsNothingToTheLength) {
  std::vector<Vec3> readings(500, Vec3{0, 0, -1});
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i].x = i % 2 == 0 ? 0.0004 : -0.0004;
  const auto still = pathOf(readings, kTolerance_m);
  ASSERT_FALSE(still);
  EXPECT_NE(still.error().what.find("the stroke is 0.0 mm long"), std::string::npos);
  EXPECT_NE(still.error().remedy, "");
}

TEST(StrokePath, NoReadingsAndBadReadingsAreRefused) {
  EXPECT_FALSE(pathOf({}, kTolerance_m));
  EXPECT_FALSE(pathOf(std::vector<Vec3>{{0, 0, 0}, {0.1, std::nan(""), 0}}, kTolerance_m));
}

}  // namespace
}  // namespace hapticd::tools
