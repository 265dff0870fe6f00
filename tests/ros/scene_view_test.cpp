// SPDX-License-Identifier: Apache-2.0
// Which depth frames are shown in ROS 2, and what fixtures become there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "tools/hapticd-ros/scene/depth_source.h"
#include "tools/hapticd-ros/scene/fixture_markers.h"

namespace hapticd::tools::ros {
namespace {

/// Numbers of the frames that are chosen of `count` that come every `period_ns`, each up to `late_ns` late.
std::vector<int> chosenFrames(int rate_hz, int count, std::int64_t period_ns, std::int64_t late_ns) {
  FrameChoice choice(rate_hz);
  std::mt19937_64 random(7);
  std::vector<int> numbers;
  const std::int64_t start_ns = 400 * rt::kNsPerSecond;
  for (int i = 0; i < count; ++i) {
    const auto late = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(late_ns + 1));
    if (choice.takes(start_ns + i * period_ns + late)) numbers.push_back(i);
  }
  return numbers;
}

TEST(FrameChoice, TakesAllOfACameraThatIsNoFaster) {
  EXPECT_EQ(chosenFrames(30, 300, 33'400'000, 10'000'000).size(), 300U);
  EXPECT_EQ(chosenFrames(30, 300, 200'000'000, 50'000'000).size(), 300U);
}

TEST(FrameChoice, KeepsTheMeanRateOfAFasterOne) {
  for (const int rate_hz : {1, 7, 10, 20}) {
    // 100 s at 30 frames a second; what is saved at the begin gives one more
    const std::size_t count = chosenFrames(rate_hz, 3000, 33'333'333, 10'000'000).size();
    EXPECT_NEAR(static_cast<double>(count), 100.0 * rate_hz, 2) << rate_hz;
  }
}

Json entry(const Json& definition, bool enabled = true) {
  return {{"name", definition.at("name")}, {"definition", definition}, {"enabled", enabled}};
}
std::vector<Marker> markersOf(const Json& definition, const FixtureSurroundings& surroundings = {}) {
  return fixtureMarkers(Json::array({entry(definition)}), surroundings);
}
Json listOf(const rt::Vec3& v) {
  return {v.x, v.y, v.z};
}

class RandomPlaces {
 public:
  double number(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  rt::Vec3 vector() { return {number(-1, 1), number(-1, 1), number(-1, 1)}; }
  rt::RigidPose pose() { return {vector(), rt::quaternionOf(3 * vector())}; }

 private:
  std::mt19937 random_{11};
};

/// Sums and products of numbers of about one, in double precision.
constexpr double kRounding = 1e-12;
void expectNear(const rt::Vec3& a, const rt::Vec3& b) {
  EXPECT_LT(rt::norm(a - b), kRounding) << a.x << " " << a.y << " " << a.z;
}

TEST(FixtureMarkers, OfASphereAreItsBall) {
  RandomPlaces random;
  for (int i = 0; i < 20; ++i) {
    const rt::Vec3 at = random.vector();
    const double radius_m = random.number(0.01, 0.5);
    const auto markers =
        markersOf({{"name", "s"}, {"kind", "sphere"}, {"position_m", listOf(at)}, {"radius_m", radius_m}});
    ASSERT_EQ(markers.size(), 1U);
    EXPECT_EQ(markers[0].name, "s");
    EXPECT_EQ(markers[0].kind, Marker::Kind::sphere);
    expectNear(markers[0].T_frame_marker.position_m_in_world, at);
    expectNear(markers[0].scale_m, {2 * radius_m, 2 * radius_m, 2 * radius_m});
  }
}

TEST(FixtureMarkers, OfABoxAreTurnedByRollPitchAndYawInThisOrder) {
  RandomPlaces random;
  constexpr double kRadPerDeg = std::numbers::pi / 180;
  for (int i = 0; i < 20; ++i) {
    const rt::Vec3 at = random.vector();
    const rt::Vec3 angles = 180 * random.vector();
    const rt::Vec3 size{random.number(0.01, 1), random.number(0.01, 1), random.number(0.01, 1)};
    const auto markers = markersOf({{"name", "b"},
                                    {"kind", "box"},
                                    {"position_m", listOf(at)},
                                    {"size_m", listOf(size)},
                                    {"rotation_deg", listOf(angles)}});
    ASSERT_EQ(markers.size(), 1U);
    EXPECT_EQ(markers[0].kind, Marker::Kind::cube);
    expectNear(markers[0].scale_m, size);
    // a corner, turned about the fixed axes one after the other
    rt::Vec3 p = 0.5 * size;
    const double roll = kRadPerDeg * angles.x, pitch = kRadPerDeg * angles.y, yaw = kRadPerDeg * angles.z;
    p = {p.x, std::cos(roll) * p.y - std::sin(roll) * p.z, std::sin(roll) * p.y + std::cos(roll) * p.z};
    p = {std::cos(pitch) * p.x + std::sin(pitch) * p.z, p.y, std::cos(pitch) * p.z - std::sin(pitch) * p.x};
    p = {std::cos(yaw) * p.x - std::sin(yaw) * p.y, std::sin(yaw) * p.x + std::cos(yaw) * p.y, p.z};
    expectNear(rt::placed(markers[0].T_frame_marker, 0.5 * size), at + p);
  }
}

TEST(FixtureMarkers, OfAPlaneAreASquareInItAndAnArrowToTheFreeSide) {
  RandomPlaces random;
  for (const char* side : {"out", "in"}) {
    const rt::Vec3 at = random.vector(), normal = random.vector();
    const auto markers = markersOf({{"name", "p"},
                                    {"kind", "plane"},
                                    {"side", side},
                                    {"position_m", listOf(at)},
                                    {"normal", listOf(normal)}});
    ASSERT_EQ(markers.size(), 2U);
    EXPECT_EQ(markers[0].kind, Marker::Kind::cube);
    const rt::Vec3 corner =
        rt::placed(markers[0].T_frame_marker, {markers[0].scale_m.x / 2, markers[0].scale_m.y / 2, 0});
    EXPECT_NEAR(rt::dot(corner - at, normal), 0, kRounding);
    EXPECT_LT(markers[0].colour[3], 0.5F) << "what is behind it must be seen";
    EXPECT_EQ(markers[1].kind, Marker::Kind::arrow);
    ASSERT_EQ(markers[1].points_m.size(), 2U);
    expectNear(markers[1].points_m[0], at);
    const double towards = rt::dot(markers[1].points_m[1] - at, normal);
    EXPECT_GT(side == std::string("in") ? -towards : towards, 0);
  }
}

TEST(FixtureMarkers, OfACapsuleReachFromEndToEnd) {
  RandomPlaces random;
  for (int i = 0; i < 20; ++i) {
    const rt::Vec3 at = random.vector(), end = random.vector();
    const auto markers = markersOf({{"name", "c"},
                                    {"kind", "capsule"},
                                    {"position_m", listOf(at)},
                                    {"end_m", listOf(end)},
                                    {"radius_m", 0.03}});
    ASSERT_EQ(markers.size(), 3U);
    expectNear(markers[0].T_frame_marker.position_m_in_world, at);
    expectNear(markers[1].T_frame_marker.position_m_in_world, end);
    EXPECT_EQ(markers[2].kind, Marker::Kind::cylinder);
    const double half_m = markers[2].scale_m.z / 2;
    expectNear(rt::placed(markers[2].T_frame_marker, {0, 0, -half_m}), at);
    expectNear(rt::placed(markers[2].T_frame_marker, {0, 0, half_m}), end);
    EXPECT_EQ((std::set{markers[0].id, markers[1].id, markers[2].id}.size()), 3U);
  }
  // ends at one place: a ball
  EXPECT_EQ(markersOf({{"name", "c"}, {"kind", "capsule"}, {"radius_m", 0.03}}).size(), 1U);
}

TEST(FixtureMarkers, OfAConeHaveItsAngleAboutItsAxis) {
  RandomPlaces random;
  const rt::Vec3 tip = random.vector(), axis = random.vector();
  const auto markers = markersOf({{"name", "c"},
                                  {"kind", "cone"},
                                  {"position_m", listOf(tip)},
                                  {"axis", listOf(axis)},
                                  {"half_angle_deg", 25}});
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_EQ(markers[0].kind, Marker::Kind::triangles);
  ASSERT_FALSE(markers[0].points_m.empty());
  ASSERT_EQ(markers[0].points_m.size() % 3, 0U);
  for (std::size_t i = 0; i < markers[0].points_m.size(); ++i) {
    const rt::Vec3 p = rt::placed(markers[0].T_frame_marker, markers[0].points_m[i]) - tip;
    if (i % 3 == 0) {
      expectNear(p, {});
    } else {
      const double cosine = rt::dot(p, axis) / (rt::norm(p) * rt::norm(axis));
      EXPECT_NEAR(cosine, std::cos(25 * std::numbers::pi / 180), kRounding);
    }
  }
}

TEST(FixtureMarkers, OfGuidanceAreItsLineAndItsPoint) {
  const auto path =
      markersOf({{"name", "p"}, {"kind", "path"}, {"points_m", {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}}});
  ASSERT_EQ(path.size(), 1U);
  EXPECT_EQ(path[0].kind, Marker::Kind::line_strip);
  EXPECT_EQ(path[0].points_m, (std::vector<rt::Vec3>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
  EXPECT_GT(path[0].scale_m.x, 0);
  const auto point = markersOf({{"name", "p"}, {"kind", "point"}, {"position_m", {1, 2, 3}}});
  ASSERT_EQ(point.size(), 1U);
  EXPECT_EQ(point[0].kind, Marker::Kind::sphere);
  expectNear(point[0].T_frame_marker.position_m_in_world, {1, 2, 3});
}

TEST(FixtureMarkers, OfASolidAreItsLinesOnceTheyAreKnown) {
  const Json solid{{"name", "organ"},
                   {"kind", "solid"},
                   {"position_m", {1, 0, 0}},
                   {"rotation_deg", {0, 0, 90}},
                   {"solid", "abc"}};
  auto markers = markersOf(solid);
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_EQ(markers[0].kind, Marker::Kind::text);
  EXPECT_EQ(markers[0].text, "organ: solid");
  expectNear(markers[0].T_frame_marker.position_m_in_world, {1, 0, 0});
  FixtureSurroundings known;
  known.outlines["abc"] = {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {5, 5, 5, 6, 6, 6}};
  markers = markersOf(solid, known);
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_EQ(markers[0].kind, Marker::Kind::line_list);
  EXPECT_EQ(markers[0].points_m,
            (std::vector<rt::Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 1, 0}, {5, 5, 5}, {6, 6, 6}}));
  expectNear(rt::placed(markers[0].T_frame_marker, {1, 0, 0}), {1, 1, 0});
}

TEST(FixtureMarkers, SayWhatHasNoShapeAndWhatCannotBeUnderstood) {
  FixtureSurroundings surroundings;
  surroundings.T_world_camera = rt::RigidPose{{1, 2, 3}, {}};
  const Json fixtures = Json::array(
      {entry({{"name", "keep-off"}, {"kind", "standoff"}, {"clearance_m", 0.005}}),
       entry({{"name", "moving"}, {"kind", "sphere"}, {"frame", "tool"}, {"radius_m", 0.1}}),
       entry({{"name", "odd"}, {"kind", "sphere"}, {"position_m", {1, "near", 2}}, {"radius_m", 0.1}}),
       entry({{"name", "newer"}, {"kind", "torus"}, {"position_m", {4, 5, 6}}})});
  const auto markers = fixtureMarkers(fixtures, surroundings);
  ASSERT_EQ(markers.size(), 4U);
  std::set<double> heights;
  for (const Marker& marker : markers) {
    EXPECT_EQ(marker.kind, Marker::Kind::text) << marker.name;
    EXPECT_GT(marker.scale_m.z, 0);
    heights.insert(marker.T_frame_marker.position_m_in_world.y);
  }
  EXPECT_EQ(heights.size(), 4U) << "one below the other";
  EXPECT_EQ(markers[0].text, "keep-off: 5.0 mm off the surface");
  EXPECT_EQ(markers[1].text, "moving: sphere in tool, whose pose is not known");
  EXPECT_EQ(markers[3].text, "newer: torus");
  expectNear(markers[0].T_frame_marker.position_m_in_world, {1, 2, 3});
  expectNear(markers[3].T_frame_marker.position_m_in_world, {4, 5, 6});
}

TEST(FixtureMarkers, AreInTheWorldWhateverTheirFrame) {
  RandomPlaces random;
  FixtureSurroundings surroundings;
  surroundings.T_world_camera = random.pose();
  surroundings.frames["tool"] = random.pose();
  const rt::Vec3 at{0.1, 0.2, 0.3};
  for (const auto& [frame, pose] :
       std::map<std::string, rt::RigidPose>{{"camera", *surroundings.T_world_camera},
                                            {"tool", surroundings.frames.at("tool")},
                                            {"world", {}}}) {
    const Json ball{{"name", "b"}, {"kind", "point"}, {"frame", frame}, {"position_m", listOf(at)}};
    const auto markers = markersOf(ball, surroundings);
    ASSERT_EQ(markers.size(), 1U);
    EXPECT_EQ(markers[0].kind, Marker::Kind::sphere) << frame;
    expectNear(markers[0].T_frame_marker.position_m_in_world, rt::placed(pose, at));
    EXPECT_EQ(isInMovingFrame(ball), frame == "tool");
    // points of a line are in the frame of the marker
    const auto path =
        markersOf({{"name", "p"}, {"kind", "path"}, {"frame", frame}, {"points_m", {listOf(at), {1, 0, 0}}}},
                  surroundings);
    ASSERT_EQ(path.size(), 1U);
    expectNear(rt::placed(path[0].T_frame_marker, path[0].points_m.at(0)), rt::placed(pose, at));
  }
}

TEST(FixtureMarkers, HaveTheColourOfWhatTheyDo) {
  const auto colour = [](const Json& more, bool enabled = true) {
    Json definition{{"name", "b"}, {"kind", "sphere"}, {"radius_m", 0.1}};
    definition.update(more);
    return fixtureMarkers(Json::array({entry(definition, enabled)}), {}).at(0).colour;
  };
  const auto red = colour({{"side", "out"}});
  EXPECT_TRUE(red[0] > 0.8F && red[1] < 0.2F && red[2] < 0.2F);
  const auto blue = colour({{"side", "in"}});
  EXPECT_TRUE(blue[2] > 0.8F && blue[0] < 0.5F && blue[1] < 0.5F);
  const auto green = colour({{"kind", "point"}});
  EXPECT_TRUE(green[1] > 0.7F && green[0] < 0.3F && green[2] < 0.3F);
  const auto yellow = colour({{"side", "in"}, {"effect", "slow"}});
  EXPECT_TRUE(yellow[0] > 0.8F && yellow[1] > 0.8F && yellow[2] < 0.2F);
  const auto faint = colour({{"side", "out"}}, /*enabled=*/false);
  EXPECT_LT(faint[3], 0.5F * red[3]);
  EXPECT_GT(faint[3], 0);
}

}  // namespace
}  // namespace hapticd::tools::ros
