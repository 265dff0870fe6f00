// SPDX-License-Identifier: Apache-2.0
// Markups of 3D Slicer as landmarks and fixtures.
#include "tools/hapticctl/additions/markups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

class Markups : public testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& content) {
    folder.write(name, content);
    return (folder.path() / name).string();
  }
  /// A file with one markup of these points.
  std::string curve(const std::string& type, const std::string& name, const std::string& positions) {
    return file(name + ".mrk.json",
                R"({"@schema":"https://raw.githubusercontent.com/Slicer/Slicer/main/)"
                R"(Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",)"
                R"("markups":[{"type":")" +
                    type + R"(","coordinateSystem":"LPS","controlPoints":[)" + positions + "]}]}");
  }
  static std::string point(double x, double y, double z, const std::string& label = "") {
    return R"({"label":")" + label + R"(","position":[)" + std::to_string(x) + "," + std::to_string(y) + "," +
           std::to_string(z) + R"(],"positionStatus":"defined"})";
  }

  const test::TemporaryFolder folder;
};

TEST_F(Markups, OfPointsAreLandmarks) {
  const auto landmarks =
      landmarksOfMarkups(curve("Fiducial", "F", point(12.5, -40, 7, "tip") + "," + point(0, 0, 1, "left")));
  ASSERT_TRUE(landmarks) << landmarks.error().text();
  ASSERT_EQ(landmarks->size(), 2U);
  EXPECT_EQ(landmarks->front().name, "tip");
  EXPECT_LT(norm(landmarks->front().position_m - Vec3{0.0125, -0.04, 0.007}), 1e-12);
  const auto twice =
      landmarksOfMarkups(curve("Fiducial", "G", point(0, 0, 0, "tip") + "," + point(0, 0, 1, "tip")));
  ASSERT_FALSE(twice);
  EXPECT_NE(twice.error().what.find("two points \"tip\""), std::string::npos) << twice.error().text();
  EXPECT_FALSE(landmarksOfMarkups(curve("Line", "L", point(0, 0, 0) + "," + point(9, 0, 0))));
}

/// The path passes through the control points and keeps near the circle that they lie on.
TEST_F(Markups, OfACurveIsAPathThroughItsPoints) {
  std::string points;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * M_PI * i / 12;
    points += (i > 0 ? "," : "") + point(30 * std::cos(angle), 30 * std::sin(angle), 5);
  }
  const auto open = fixturesOfMarkups(curve("Curve", "open", points));
  const auto closed = fixturesOfMarkups(curve("ClosedCurve", "closed", points));
  ASSERT_TRUE(open && closed);
  for (const auto* made : {&*open, &*closed}) {
    const config::FixtureSettings& path = made->additions.fixtures.at(0);
    EXPECT_EQ(path.kind, rt::FixtureKind::path);
    EXPECT_EQ(path.name, made == &*open ? "open" : "closed");
    EXPECT_LE(path.points_m.size(), rt::kMaxPathPoints);
    EXPECT_TRUE(config::checkTogether(made->additions).empty());
    for (int i = 0; i < 12; ++i) {
      const double angle = 2 * M_PI * i / 12;
      const Vec3 control{0.03 * std::cos(angle), 0.03 * std::sin(angle), 0.005};
      const auto nearest =
          std::ranges::min(path.points_m, {}, [&](const Vec3& p) { return norm(p - control); });
      EXPECT_LT(norm(nearest - control), 1e-6) << "control point " << i;
    }
  }
  EXPECT_TRUE(rt::isClosedPath(closed->additions.fixtures[0].points_m));
  EXPECT_FALSE(rt::isClosedPath(open->additions.fixtures[0].points_m));
  for (const Vec3& p : closed->additions.fixtures[0].points_m)
    EXPECT_NEAR(std::hypot(p.x, p.y), 0.03, 0.0003);
}

TEST_F(Markups, OfManyPointsStayWithinThePointsOfAPath) {
  std::string points;
  for (int i = 0; i < 120; ++i) points += (i > 0 ? "," : "") + point(5 * i, (i % 2) * 3, 0);
  const auto made = fixturesOfMarkups(curve("Curve", "long", points));
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_LE(made->additions.fixtures[0].points_m.size(), rt::kMaxPathPoints);
  EXPECT_FALSE(fixturesOfMarkups(curve("Curve", "longer", [] {
    std::string all;
    for (int i = 0; i < 200; ++i) all += (i > 0 ? "," : "") + point(i, 0, 0);
    return all;
  }())));
}

TEST_F(Markups, OfABoxIsABoxInItsOrientation) {
  const std::string name =
      file("roi.mrk.json",
           R"({"@schema":"markups-schema-v1.0.3.json#","markups":[{"type":"ROI","name":"liver box",)"
           R"("coordinateSystem":"LPS","roiType":"Box","center":[1,2,3],"size":[20,30,40],)"
           R"("orientation":[0,-1,0,1,0,0,0,0,1],"controlPoints":[]}]})");
  const auto made = fixturesOfMarkups(name);
  ASSERT_TRUE(made) << made.error().text();
  const config::FixtureSettings& box = made->additions.fixtures.at(0);
  EXPECT_EQ(box.kind, rt::FixtureKind::box);
  EXPECT_EQ(box.name, "liver_box");
  EXPECT_LT(norm(box.size_m - Vec3{0.02, 0.03, 0.04}), 1e-12);
  EXPECT_LT(norm(box.position_m - Vec3{0.001, 0.002, 0.003}), 1e-12);
  EXPECT_LT(norm(box.rotation_deg - Vec3{0, 0, 90}), 1e-9);
}

TEST_F(Markups, AreKnownByTheirEndings) {
  EXPECT_TRUE(isMarkupFile("a.mrk.json"));
  EXPECT_TRUE(isMarkupFile("a.fcsv"));
  EXPECT_FALSE(isMarkupFile("a.json"));
  EXPECT_FALSE(isMarkupFile("a.yaml"));
}

}  // namespace
}  // namespace hapticd::tools
