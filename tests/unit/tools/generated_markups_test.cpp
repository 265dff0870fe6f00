// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/additions/addition_checks.h"
#include "rt/base/pose.h"
#include "rt/base/rotation.h"
#include "rt/fixtures/fixture.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticctl/additions/markups.h"

namespace hapticd::tools {
namespace {

using rt::rotated;
using rt::Vec3;
using Points = std::vector<Vec3>;

// Markups of 3D Slicer as landmarks and fixtures.

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

// Generated markups against what they were made of: curves against the spline of 3D Slicer as its equations
// say, planes against a product of matrices in RAS, points against their status. HAPTICD_GENERATED_FILES sets
// how many.

/// Numbers are written with six digits behind the point, in millimetres.
constexpr double kWritten_m = 1e-9;

std::string numbers(const std::vector<double>& all) {
  std::string text;
  for (const double number : all) text += (text.empty() ? "" : ",") + std::to_string(number);
  return text;
}

/// The slopes of a cubic spline over the numbers of its points: continuous curvature, and at its ends either
/// no slope or its beginning again. All equations at once, by elimination.
Points slopesOf(const Points& points, bool closed) {
  const std::size_t n = points.size();
  std::vector<std::vector<double>> rows(n, std::vector<double>(n));
  Points right(n);
  for (std::size_t i = 0; i < n; ++i) {
    rows[i][i] = 1;
    if (!closed && (i == 0 || i + 1 == n)) continue;
    const std::size_t before = (i + n - 1) % n, behind = (i + 1) % n;
    rows[i][i] = 4;
    rows[i][before] += 1;
    rows[i][behind] += 1;
    right[i] = 3 * (points[behind] - points[before]);
  }
  for (std::size_t i = 0; i < n; ++i) {  // its own number is the largest of each row: no row is exchanged
    for (std::size_t k = 0; k < n; ++k) {
      const double share = k == i ? 0 : rows[k][i] / rows[i][i];
      if (share == 0) continue;
      for (std::size_t j = i; j < n; ++j) rows[k][j] -= share * rows[i][j];
      right[k] = right[k] - share * right[i];
    }
  }
  for (std::size_t i = 0; i < n; ++i) right[i] = (1 / rows[i][i]) * right[i];
  return right;
}

Points splineThrough(const Points& points, bool closed, int steps) {
  const Points slopes = slopesOf(points, closed);
  Points curve{points.front()};
  for (std::size_t i = 0; i + (closed ? 0 : 1) < points.size(); ++i) {
    const std::size_t k = (i + 1) % points.size();
    for (int step = 1; step <= steps; ++step) {  // Hermite's basis
      const double t = static_cast<double>(step) / steps, u = 1 - t;
      curve.push_back(u * u * (1 + 2 * t) * points[i] + t * t * (1 + 2 * u) * points[k] +
                      t * u * u * slopes[i] - u * t * t * slopes[k]);
    }
  }
  return curve;
}

/// The places of a path as the force loop follows it.
Points placesOf(const config::FixtureSettings& path) {
  std::vector<rt::PathElement> elements(rt::kMaxPathElements);
  elements.resize(rt::smoothPath(path.points_m, path.bend_radius_m, elements));
  Points places;
  for (const rt::PathElement& e : elements) {
    for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const double s = share * e.length_m, k = e.curvature_per_m;
      places.push_back(k == 0 ? e.start_m_in_world + s * e.tangent_in_world
                              : e.start_m_in_world + (std::sin(s * k) / k) * e.tangent_in_world +
                                    ((1 - std::cos(s * k)) / k) * e.inward_in_world);
    }
  }
  return places;
}

double smallestRadius_m(const Points& line) {
  double least_m = 1e9;
  for (std::size_t i = 2; i < line.size(); ++i) {
    const Vec3 to = line[i - 1] - line[i - 2], from = line[i] - line[i - 1];
    const double turn = std::atan2(norm(cross(to, from)), dot(to, from));
    least_m = std::min(least_m, (norm(to) + norm(from)) / 2 / std::max(turn, 1e-9));
  }
  return least_m;
}

double farthest_m(const Points& places, const Points& line) {
  double most_m = 0;
  for (const Vec3& place : places) {
    double least_m = 1e9;
    for (std::size_t i = 1; i < line.size(); ++i) {
      const Vec3 along = line[i] - line[i - 1], to = place - line[i - 1];
      const double length = dot(along, along);
      const double share = length > 0 ? std::clamp(dot(to, along) / length, 0.0, 1.0) : 0;
      least_m = std::min(least_m, norm(to - share * along));
    }
    most_m = std::max(most_m, least_m);
  }
  return most_m;
}

class GeneratedMarkups : public testing::Test {
 protected:
  /// A file number, and what is chosen by it.
  void begin(unsigned number) {
    random.seed(number);
    ras = isTrue(0.5);
    micrometres = isTrue(0.3);
  }
  double between(double low, double high) { return std::uniform_real_distribution<>(low, high)(random); }
  bool isTrue(double share) { return between(0, 1) < share; }
  Vec3 direction() {
    const Vec3 any{between(-1, 1), between(-1, 1), between(-1, 1)};
    return norm(any) < 0.1 ? direction() : (1 / norm(any)) * any;
  }
  rt::Rotation rotation() {
    return rt::rotationOf({.position_m = {},
                           .roll_rad = between(-3, 3),
                           .pitch_rad = between(-1.5, 1.5),
                           .yaw_rad = between(-3, 3)});
  }

  /// A place in LPS as the file states it.
  std::string written(const Vec3& place_m) const {
    const double unit = micrometres ? 1e6 : 1e3, turn = ras ? -unit : unit;
    return numbers({turn * place_m.x, turn * place_m.y, unit * place_m.z});
  }
  std::string jsonFile(const std::string& type, const std::string& content) {
    folder.write("a.mrk.json", R"({"@schema":"markups-schema-v1.0.3.json#","markups":[{"type":")" + type +
                                   R"(","name":"made","coordinateSystem":")" + (ras ? "RAS" : "LPS") +
                                   R"(","coordinateUnits":")" + (micrometres ? "um" : "mm") + "\"," +
                                   content + "}]}");
    return folder.path() / "a.mrk.json";
  }
  /// Among the points are some that are not placed.
  std::string controlPoints(const Points& points) {
    std::string all;
    const auto add = [&](const std::string& position, const char* status) {
      all += (all.empty() ? "" : ",") + std::string(R"({"label":"p","position":[)") + position +
             R"(],"positionStatus":")" + status + "\"}";
    };
    for (const Vec3& each : points) {
      if (isTrue(0.1)) add(written(direction()), isTrue(0.5) ? "undefined" : "preview");
      add(written(each), "defined");
    }
    return R"("controlPoints":[)" + all + "]";
  }

  void checkCurve(std::size_t count, double step_m, bool closed, int steps) {
    Points control{0.1 * direction()};
    Vec3 along = direction();
    while (control.size() < count) {
      const Vec3 turned = along + between(0, 1) * direction();
      along = (1 / norm(turned)) * turned;
      control.push_back(control.back() + between(0.3, 1) * step_m * along);
    }
    const auto made = fixturesOfMarkups(jsonFile(closed ? "ClosedCurve" : "Curve", controlPoints(control)));
    ASSERT_TRUE(made) << made.error().text();
    const config::FixtureSettings& path = made->additions.fixtures.at(0);
    const auto problem = config::pathProblem(path.points_m, true);
    if (problem) {  // a cusp, which the box refuses
      ASSERT_NE(problem->what.find("turns by"), std::string::npos) << problem->what;
      return;
    }
    EXPECT_EQ(rt::isClosedPath(path.points_m), closed);
    const std::string& note = made->notes.back();
    const double stated_m = 1e-3 * std::atof(note.substr(note.find("within ") + 7).c_str());
    const Points spline = splineThrough(control, closed, steps), places = placesOf(path);
    const double off_m = std::max(farthest_m(places, spline), farthest_m(spline, places));
    constexpr double kChords_m = 2e-5;  // of the spline and of the arcs between their places here
    EXPECT_LE(off_m, stated_m + kChords_m) << note;
    if (path.points_m.size() == rt::kMaxPathPoints) {
      ++limited;
    } else if (smallestRadius_m(spline) > 2 * rt::kMinPointDistance_m) {
      ++followed;
      EXPECT_LE(off_m, 2e-4) << note;
    }
  }

  void checkPlane() {
    const rt::Rotation base = rotation(), object = rotation();
    const Vec3 base_mm = 100 * direction(), object_mm = 10 * direction();
    const bool is_turned = isTrue(0.7);
    const double unit = micrometres ? 1e3 : 1;
    // rows of a matrix in RAS, of which LPS negates the first two
    const auto rows = [&](const rt::Rotation& rotation, const Vec3& place_mm) {
      const std::array axes{rotated(rotation, {1, 0, 0}), rotated(rotation, {0, 1, 0}),
                            rotated(rotation, {0, 0, 1}), unit * place_mm};
      std::vector<double> all;
      for (const Vec3& a : axes) all.push_back(ras ? a.x : -a.x);
      for (const Vec3& a : axes) all.push_back(ras ? a.y : -a.y);
      for (const Vec3& a : axes) all.push_back(a.z);
      all.insert(all.end(), {0, 0, 0, 1});
      return numbers(all);
    };
    std::string content = R"("baseToNode":[)" + rows(base, base_mm) + "]";
    if (is_turned) content += R"(,"objectToBase":[)" + rows(object, object_mm) + "]";
    const auto made = fixturesOfMarkups(jsonFile("Plane", content));
    ASSERT_TRUE(made) << made.error().text();
    const Vec3 normal = rotated(base, is_turned ? rotated(object, {0, 0, 1}) : Vec3{0, 0, 1});
    const Vec3 place_m = 1e-3 * (base_mm + (is_turned ? rotated(base, object_mm) : Vec3{}));
    const config::FixtureSettings& plane = made->additions.fixtures.at(0);
    EXPECT_LT(norm(plane.normal - Vec3{-normal.x, -normal.y, normal.z}), 1e-5);
    EXPECT_LT(norm(plane.position_m - Vec3{-place_m.x, -place_m.y, place_m.z}), 1e-6);
  }

  void checkPoints() {
    micrometres = false;
    std::string rows, listed;
    std::vector<PlacedLandmark> placed;
    std::set<std::string> unplaced;
    for (int i = 0; i < 12 || placed.empty(); ++i) {
      const Vec3 place_m = 0.2 * direction();
      const std::string name = "p\"," + std::to_string(i), position = written(place_m);
      const int status = std::uniform_int_distribution(0, 4)(random);  // 4: an older file has none
      rows += std::to_string(i) + "," + position + ",0,0,0,1,1,1,0,\"p\"\"," + std::to_string(i) + "\",,";
      rows += status == 4 ? "\n" : "," + std::to_string(status) + ",0\n";
      if (status == 2 || status == 4)
        placed.push_back({name, place_m});
      else
        unplaced.insert(name);
    }
    folder.write("a.fcsv", std::string("# Markups fiducial file version = 5.6\n# CoordinateSystem = ") +
                               (ras ? "0\n" : "LPS\n") +
                               "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n" +
                               rows);
    const auto read = landmarksOfMarkups(folder.path() / "a.fcsv");
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->landmarks.size(), placed.size()) << rows;
    for (std::size_t i = 0; i < placed.size(); ++i) {
      EXPECT_EQ(read->landmarks[i].name, placed[i].name);
      EXPECT_LT(norm(read->landmarks[i].position_m - placed[i].position_m), kWritten_m);
    }
    EXPECT_EQ(read->unplaced, unplaced);
    EXPECT_EQ(read->notes.size(), unplaced.empty() ? 0U : 1U);
  }

  const test::TemporaryFolder folder;
  std::mt19937 random;
  bool ras = false;
  bool micrometres = false;
  int followed = 0,
      limited = 0;  // paths that follow their curve, and those that would need more points for it
};

TEST_F(GeneratedMarkups, AreReadAs3dSlicerShowsThem) {
  const char* const count = std::getenv("HAPTICD_GENERATED_FILES");
  const unsigned files = count != nullptr ? static_cast<unsigned>(std::atoi(count)) : 300;
  for (unsigned number = 0; number < files && !HasFailure(); ++number) {
    SCOPED_TRACE(number);
    begin(number);
    if (number % 4 == 2) {
      checkPlane();
    } else if (number % 4 == 3) {
      checkPoints();
    } else if (number % 40 == 0) {  // a centre line
      checkCurve(300, between(0.0005, 0.005), false, 12);
    } else {
      const bool closed = isTrue(0.4);
      checkCurve(std::uniform_int_distribution<std::size_t>(closed ? 3 : 2, 12)(random), 0.04, closed, 60);
    }
  }
  EXPECT_GT(followed, static_cast<int>(files / 4));
  EXPECT_GT(limited, 0);
}

}  // namespace
}  // namespace hapticd::tools
