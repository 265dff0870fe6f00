// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/point_files.h"

#include <gtest/gtest.h>

#include "drivers/camera/kinect_image.h"
#include "rt/depth_frame.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/registration/landmark_depth.h"

namespace hapticd::tools {
namespace {

using test::TemporaryFolder;

TEST(PointFiles, ReadsPairsWithCommentsEmptyLinesAndCarriageReturns) {
  const TemporaryFolder folder;
  const auto pairs = readPointPairs(folder.write(
      "pairs.csv", std::string("# by tape measure\r\n") + kPairsHeader + "\r\n\r\ncorner, 1,2,-3,4,5,6\r\n"));
  ASSERT_TRUE(pairs) << pairs.error().front().text();
  ASSERT_EQ(pairs->size(), 1U);
  EXPECT_EQ(pairs->front().name, "corner");
  EXPECT_EQ(pairs->front().camera_m, (rt::Vec3{1, 2, -3}));
  EXPECT_EQ(pairs->front().world_m, (rt::Vec3{4, 5, 6}));
}

TEST(PointFiles, TakesAHeaderAsProgramsOfTablesWriteIt) {
  const TemporaryFolder folder;
  for (const char* begin : {"\xEF\xBB\xBF", "\xEF\xBB\xBF# by tape measure\n", ""}) {
    const auto marks = readLandmarks(
        folder.write("marks.csv", std::string(begin) + "\"name\",\"column_px\", \"row_px\"\r\ncorner,1,2\n"));
    ASSERT_TRUE(marks) << marks.error().front().text();
    EXPECT_EQ(marks->size(), 1U);
  }
}

TEST(PointFiles, NamesEveryBadLine) {
  const TemporaryFolder folder;
  const auto file = folder.write("pairs.csv", std::string(kPairsHeader) +
                                                  "\na,1,2,3,4,5,x\na,1,2,3,4,5,6\n,1,2,3,4,5,6\nb,1,2\n"
                                                  "c,nan,2,3,4,5,21\n");
  const auto pairs = readPointPairs(file);
  ASSERT_FALSE(pairs);
  std::string all;
  for (const config::Error& error : pairs.error()) all += error.text() + "\n";
  for (const char* part :
       {":2: world_z_m: \"x\" is no number (allowed: -20..20 m)", ":3: \"a\" is there twice",
        ":4: the name is missing", ":5: 3 columns where 7 are expected",
        ":6: camera_x_m: \"nan\" is out of range", ":6: world_z_m: \"21\" is out of range"}) {
    EXPECT_NE(all.find(part), std::string::npos) << part << " in\n" << all;
  }
}

TEST(PointFiles, SaysWhichHeaderIsMissing) {
  const TemporaryFolder folder;
  const auto landmarks = readLandmarks(folder.write("marks.csv", "corner,1,2\n"));
  ASSERT_FALSE(landmarks);
  EXPECT_NE(landmarks.error().front().what.find("name,column_px,row_px"), std::string::npos);
  EXPECT_FALSE(readLandmarks(folder.write("empty.csv", "")));
  EXPECT_FALSE(readLandmarks(folder.path() / "nothing"));
}

TEST(PointFiles, RefusesPixelsOutsideThePicture) {
  const TemporaryFolder folder;
  const auto landmarks = readLandmarks(
      folder.write("marks.csv", std::string(kLandmarksHeader) + "\na,1280,0\nb,0,800\nc,1279,799\n"));
  ASSERT_FALSE(landmarks);
  EXPECT_EQ(landmarks.error().size(), 2U);
}

TEST(LandmarkDepth, TakesTheMedianOfThePixelsAboutIt) {
  const rt::DepthModelParameters model;
  std::vector<std::uint16_t> frame(drivers::kKinectPixels, drivers::kKinectNoMeasurement);
  // 13 of 25 pixels measure: seven the surface, six something far behind it
  for (int i = 0; i < 13; ++i) {
    const int row = 100 - 2 + i / 5;
    const int column = 200 - 2 + i % 5;
    frame[static_cast<std::size_t>(row * drivers::kKinectWidth + column)] = i < 7 ? 700 : 900;
  }
  const auto seen = positionInCamera({"mark", 200, 100}, frame, model);
  ASSERT_TRUE(seen) << seen.error().text();
  const double depth_m = 1 / (model.a_per_m * 700 + model.b_per_m);
  EXPECT_NEAR(seen->z, -depth_m, 1e-12);
  EXPECT_NEAR(seen->x, depth_m * (200 - model.cx_px) / model.fx_px, 1e-12);
  EXPECT_NEAR(seen->y, -depth_m * (100 - model.cy_px) / model.fy_px, 1e-12);
}

TEST(LandmarkDepth, RefusesAPlaceWithoutDepth) {
  std::vector<std::uint16_t> frame(drivers::kKinectPixels, drivers::kKinectNoMeasurement);
  const auto seen = positionInCamera({"mark", 0, 0}, frame, rt::DepthModelParameters());
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().where, "mark");
  EXPECT_NE(seen.error().what.find("0 of 9 pixels"), std::string::npos) << seen.error().what;
}

TEST(LandmarkDepth, RefusesAPixelOutsideTheImageOfTheCamera) {
  std::vector<std::uint16_t> frame(drivers::kKinectPixels, 700);
  for (const Landmark& landmark : {Landmark{"mark", 640, 0}, Landmark{"mark", 0, 480}}) {
    const auto seen = positionInCamera(landmark, frame, rt::DepthModelParameters());
    ASSERT_FALSE(seen);
    EXPECT_NE(seen.error().what.find("outside the image, which has 640 x 480 pixels"), std::string::npos)
        << seen.error().what;
  }
}

TEST(PointPairs, AreRefusedInWordsThatATerminalMayShow) {
  const test::TemporaryFolder folder;
  const auto pairs =
      readPointPairs(folder.write("pairs.csv", std::string(kPairsHeader) + "\na,\x1b[2J,0,0,0,0,0\nb," +
                                                   std::string(3000, 'x') + ",0,0,0,0,0\n"));
  ASSERT_FALSE(pairs);
  ASSERT_EQ(pairs.error().size(), 2U);
  EXPECT_NE(pairs.error()[0].text().find(R"("\x1b[2J")"), std::string::npos) << pairs.error()[0].text();
  EXPECT_LT(pairs.error()[1].text().size(), 300U);
}

}  // namespace
}  // namespace hapticd::tools
