// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/markups_reader.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::solids {
namespace {

using rt::Vec3;

constexpr double kRounding_m = 1e-12;
const std::string kSchema =
    R"("@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#")";

std::string fileWith(const std::string& markup) {
  return "{" + kSchema + R"(, "markups": [)" + markup + "]}";
}

void expectNear(const Vec3& read, const Vec3& expected) {
  EXPECT_LT(norm(read - expected), kRounding_m) << read.x << " " << read.y << " " << read.z;
}

TEST(Markups, OfAPointAreInLpsAndMetres) {
  for (const auto& [system, units, position] :
       {std::tuple{R"("LPS")", R"("mm")", "[12.5, -40, 7]"},
        std::tuple{R"("RAS")", R"(["mm", "UCUM", "millimeter"])", "[-12.5, 40, 7]"},
        std::tuple{R"("LPS")", R"("um")", "[12500, -40000, 7000]"}}) {
    const auto file = markupsFrom(
        fileWith(std::string(R"({"type": "Fiducial", "coordinateSystem": )") + system +
                 R"(, "coordinateUnits": )" + units + R"(, "controlPoints": [{"label": "tip", "position": )" +
                 position + R"(, "positionStatus": "defined"}]})"),
        "a.mrk.json");
    ASSERT_TRUE(file) << file.error().text();
    ASSERT_EQ(file->markups.size(), 1U);
    EXPECT_EQ(file->markups[0].points[0].label, "tip");
    expectNear(file->markups[0].points[0].position_m, {0.0125, -0.040, 0.007});
    EXPECT_TRUE(file->warnings.empty());
  }
}

TEST(Markups, WithoutAPositionAreLeftOut) {
  const auto file = markupsFrom(fileWith(R"({"type": "Curve", "name": "seam", "controlPoints": [
        {"position": [1, 0, 0]}, {"label": "b"}, {"position": null}, {"position": [9, 9, 9], "positionStatus": "preview"},
        {"position": [2, 0, 0], "positionStatus": "defined"}]})"),
                                "a.mrk.json");
  ASSERT_TRUE(file) << file.error().text();
  const Markup& curve = file->markups[0];
  EXPECT_EQ(curve.kind, MarkupKind::curve);
  ASSERT_EQ(curve.points.size(), 2U);
  EXPECT_EQ(curve.points[1].label, "point 5");
  expectNear(curve.points[1].position_m, {0.002, 0, 0});
  ASSERT_EQ(file->warnings.size(), 1U);
  EXPECT_TRUE(file->warnings[0].ends_with(
      R"(3 of 5 control points have no position and are left out: "b", "point 3", "point 4")"))
      << file->warnings[0];
}

TEST(Markups, OfARoiAreABoxWithItsAxes) {
  const std::string numbers =
      R"("center": [1, 2, 3], "size": [20, 30, 40], "orientation": [0, -1, 0, 1, 0, 0, 0, 0, 1], "roiType": "Box"})";
  const auto file = markupsFrom(fileWith(R"({"type": "ROI", )" + numbers), "a.mrk.json");
  ASSERT_TRUE(file) << file.error().text();
  ASSERT_TRUE(file->markups[0].box);
  const MarkupBox& box = *file->markups[0].box;
  expectNear(box.centre_m, {0.001, 0.002, 0.003});
  expectNear(box.size_m, {0.020, 0.030, 0.040});
  expectNear(box.axes[0], {0, 1, 0});
  expectNear(box.axes[1], {-1, 0, 0});
  expectNear(box.axes[2], {0, 0, 1});
  const auto ras =
      markupsFrom(fileWith(R"({"type": "ROI", "coordinateSystem": "RAS", )" + numbers), "a.mrk.json");
  ASSERT_TRUE(ras);
  expectNear(ras->markups[0].box->centre_m, {-0.001, -0.002, 0.003});
  expectNear(ras->markups[0].box->axes[0], {0, -1, 0});
}

TEST(Markups, OfAPlaneTakeItsNormalFromWhereItIs) {
  const std::string matrix = "[0, 0, 1, 10, 1, 0, 0, 20, 0, 1, 0, 30, 0, 0, 0, 1]";
  for (
      const std::string& content :
      {std::string(R"("center": [10, 20, 30], "normal": [2, 0, 0])"), R"("baseToNode": )" + matrix,
       std::string(
           R"("controlPoints": [{"position": [10, 20, 30]}, {"position": [10, 21, 30]}, {"position": [10, 20, 31]}])")}) {
    const auto file = markupsFrom(fileWith(R"({"type": "Plane", )" + content + "}"), "a.mrk.json");
    ASSERT_TRUE(file) << file.error().text();
    ASSERT_TRUE(file->markups[0].plane);
    expectNear(file->markups[0].plane->position_m, {0.010, 0.020, 0.030});
    expectNear(file->markups[0].plane->normal, {1, 0, 0});
  }
}

TEST(Markups, OfOlderFilesAreReadInTheirFrame) {
  const std::string columns = "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
  for (const auto& [system, position] : {std::pair{"0", "12.5,-40,7"}, std::pair{"RAS", "12.5,-40,7"},
                                         std::pair{"1", "-12.5,40,7"}, std::pair{"LPS", "-12.5,40,7"}}) {
    const auto file =
        markupsFrom(std::string("# Markups fiducial file version = 4.8\n# CoordinateSystem = ") + system +
                        "\n" + columns + "vtk_0," + position +
                        ",0,0,0,1,1,1,0,\"left, \"\"upper\"\"\",,\r\n1," + position + ",0,0,0,1,1,1,0,,,\n",
                    "a.fcsv");
    ASSERT_TRUE(file) << file.error().text();
    ASSERT_EQ(file->markups[0].points.size(), 2U);
    expectNear(file->markups[0].points[0].position_m, {-0.0125, 0.040, 0.007});
    EXPECT_EQ(file->markups[0].points[0].label, "left, \"upper\"");
    EXPECT_EQ(file->markups[0].points[1].label, "point 2");
  }
}

TEST(Markups, ThatAreWrongAreRefusedWithTheirPlace) {
  const test::TemporaryFolder folder;
  for (
      const std::string markup :
      {R"({"type": "Blob"})", R"({"type": "Fiducial", "coordinateSystem": "IJK"})",
       R"({"type": "Fiducial", "coordinateUnits": "inch"})",
       R"({"type": "Fiducial", "controlPoints": [{"position": [1, 2]}]})",
       R"({"type": "Fiducial", "controlPoints": [{"position": [1, 2, "3"]}]})",
       R"({"type": "Fiducial", "controlPoints": [{"position": [1, 2, 1e8]}]})",
       R"({"type": "ROI", "center": [0, 0, 0], "size": [1, 0, 1]})",
       R"({"type": "ROI", "center": [0, 0, 0], "size": [1, 1, 1], "orientation": [1, 0, 0, 0, 1, 0, 0, 0, -1]})",
       R"({"type": "Fiducial", "controlPoints": [{"position": [1, 2, 3], "positionStatus": "lost"}]})",
       R"({"type": "Plane"})", "7"}) {
    const auto file = markupsFrom(fileWith(markup), "a.mrk.json");
    ASSERT_FALSE(file) << markup;
    EXPECT_EQ(file.error().where, "a.mrk.json: markup 1") << markup;
    EXPECT_FALSE(file.error().remedy.empty()) << markup;
  }
  EXPECT_FALSE(markupsFrom("# CoordinateSystem = 2\n", "a.fcsv"));
  EXPECT_FALSE(markupsFrom("1,2,3,4\n", "a.fcsv"));
  EXPECT_FALSE(markupsFrom("# CoordinateSystem = LPS\n1,2,nan,4\n", "a.fcsv"));
  EXPECT_FALSE(markupsFrom("# CoordinateSystem = LPS\n1,2,3,4,0,0,0,1,1,1,0,a,,,4,0\n", "a.fcsv"));
  EXPECT_FALSE(markupsFrom("[]", "a.mrk.json"));
  EXPECT_FALSE(markupsFrom("{}", "a.txt"));
  EXPECT_FALSE(readMarkups(folder.path() / "missing.fcsv"));
}

/// Files that would overflow the stack, fill the memory, or be read for hours.
TEST(Markups, ThatAreHostileTakeLittle) {
  const std::size_t many = 100'000;
  EXPECT_FALSE(markupsFrom(fileWith(R"({"type": "Fiducial", "coordinateSystem": )" + std::string(many, '[') +
                                    std::string(many, ']') + "}"),
                           "a.mrk.json"));
  std::string lists;
  while (lists.size() < (std::size_t{15} << 20)) lists += "[],";
  EXPECT_FALSE(markupsFrom(fileWith(lists + "[]"), "a.mrk.json"));
  std::string rows =
      "# CoordinateSystem = LPS\n# columns = " + std::string(std::size_t{4} << 20, ',') + "z,y,x\n";
  for (std::size_t i = 0; i < many; ++i) rows += "a,1,2,3\n";
  EXPECT_FALSE(markupsFrom(rows, "a.fcsv"));
}

TEST(Markups, ThatAreTruncatedAnywhereAreRefused) {
  const std::string whole =
      fileWith(R"({"type": "Fiducial", "controlPoints": [{"label": "a", "position": [1, 2.5, -3]}]})");
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(markupsFrom(whole.substr(0, size), "a.mrk.json")) << size;
  EXPECT_TRUE(markupsFrom(whole, "a.mrk.json"));
}

}  // namespace
}  // namespace hapticd::solids
