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
  ASSERT_EQ(landmarks->landmarks.size(), 2U);
  EXPECT_EQ(landmarks->landmarks[0].name, "tip");
  EXPECT_LT(norm(landmarks->landmarks[0].position_m - Vec3{0.0125, -0.04, 0.007}), 1e-12);
  const auto twice =
      landmarksOfMarkups(curve("Fiducial", "G", point(0, 0, 0, "tip") + "," + point(0, 0, 1, "tip")));
  ASSERT_FALSE(twice);
  EXPECT_NE(twice.error().what.find("two points \"tip\""), std::string::npos) << twice.error().text();
  EXPECT_FALSE(landmarksOfMarkups(curve("Line", "L", point(0, 0, 0) + "," + point(9, 0, 0))));
}

TEST_F(Markups, OfARingWhoseLastPointIsItsFirstAreClosedOnce) {
  std::string points;
  for (int i = 0; i <= 8; ++i)
    points += (i > 0 ? "," : "") + point(30 * std::cos(i * M_PI / 4), 30 * std::sin(i * M_PI / 4), 0);
  const auto made = fixturesOfMarkups(curve("ClosedCurve", "ring", points));
  ASSERT_TRUE(made) << made.error().text();
  const config::FixtureSettings& path = made->additions.fixtures.at(0);
  EXPECT_TRUE(rt::isClosedPath(path.points_m));
  EXPECT_TRUE(config::checkTogether(made->additions).empty());
  for (const Vec3& p : path.points_m) EXPECT_NEAR(norm(p), 0.03, 0.0005);
  EXPECT_TRUE(made->notes.back().ends_with("without repetitions of a point (1)")) << made->notes.back();
}

/// What a file with more than a box can hold, or less than a fixture needs, and the reason that is named.
TEST_F(Markups, ThatCannotBecomeFixturesAreNamedWithTheReason) {
  const std::string place = point(0, 0, 0) + "," + point(9, 0, 0);
  std::string lines, points;
  for (int i = 0; i < 20'000; ++i) {
    lines +=
        (i > 0 ? "," : "") + std::string(R"({"type":"Line","name":"same","controlPoints":[)") + place + "]}";
    points += (i > 0 ? "," : "") + point(i, 0, 0);
  }
  const auto refused = [&](const std::string& content) {
    const auto made = fixturesOfMarkups(content);
    EXPECT_FALSE(made);
    return made ? "" : made.error().what;
  };
  EXPECT_NE(refused(curve("Curve", "short", point(0, 0, 0))).find("it has 1 points (2 to"),
            std::string::npos);
  EXPECT_NE(refused(curve("Curve", "long", points)).find("it has 20000 points (2 to"), std::string::npos);
  EXPECT_NE(
      refused(file("many.mrk.json", R"({"@schema":"markups-schema-v1.0.3.json#","markups":[)" + lines + "]}"))
          .find("more than 16"),
      std::string::npos);
  const auto none =
      landmarksOfMarkups(file("none.fcsv", "# CoordinateSystem = LPS\n1,0,0,0,0,0,0,1,1,1,0,tip,,,0\n"));
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().what.find("left out: \"tip\""), std::string::npos) << none.error().text();
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
