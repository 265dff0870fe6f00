// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <png.h>
#include <sys/stat.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <iterator>

#include "config/base/base64.h"
#include "config/base/whole_file.h"
#include "drivers/camera/kinect_image.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticctl/snapshot/snapshot.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::uint16_t kRaw = 700;
constexpr std::size_t kVertexBytes = 15;

/// One pixel that measures, right below the optical axis; the HIP 1 cm in front of it.
Snapshot onePixel() {
  Snapshot snapshot;
  snapshot.frame = 7;
  snapshot.raw.assign(drivers::kKinectPixels, drivers::kKinectNoMeasurement);
  snapshot.raw[300 * drivers::kKinectWidth + 320] = kRaw;
  snapshot.T_world_camera.position_m = {1, 2, 3};
  const rt::DepthModelParameters m;
  const double depth_m = 1 / (m.a_per_m * kRaw + m.b_per_m);
  const rt::Vec3 point{1 + depth_m * (320 - m.cx_px) / m.fx_px, 2 - depth_m * (300 - m.cy_px) / m.fy_px,
                       3 - depth_m};
  snapshot.hip_m_in_world = point + rt::Vec3{0, 0, 0.01};
  snapshot.proxy_m_in_world = point;
  return snapshot;
}

rt::Vec3 vertexAt(const std::string& ply, std::size_t place) {
  float numbers[3];
  std::memcpy(numbers, ply.data() + place, sizeof numbers);
  return {numbers[0], numbers[1], numbers[2]};
}

Rgb colourAt(const std::string& ply, std::size_t place) {
  const auto at = [&](std::size_t i) { return static_cast<std::uint8_t>(ply[place + 12 + i]); };
  return {at(0), at(1), at(2)};
}

TEST(PointCloud, HoldsThePointsInTheWorldThenProxyAndHip) {
  const Snapshot snapshot = onePixel();
  const std::string ply = plyOf(snapshot, 0.04);
  EXPECT_TRUE(ply.starts_with("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_NE(ply.find("element vertex 3\n"), std::string::npos);
  const std::size_t body = ply.find("end_header\n") + std::strlen("end_header\n");
  ASSERT_EQ(ply.size(), body + 3 * kVertexBytes);
  EXPECT_LT(rt::norm(vertexAt(ply, body) - snapshot.proxy_m_in_world), 1e-6);  // single precision at 3 m
  EXPECT_EQ(colourAt(ply, body), kNeighbourColour);
  EXPECT_EQ(colourAt(ply, body + kVertexBytes), kProxyColour);
  EXPECT_LT(rt::norm(vertexAt(ply, body + 2 * kVertexBytes) - snapshot.hip_m_in_world), 1e-6);
  EXPECT_EQ(colourAt(ply, body + 2 * kVertexBytes), kHipColour);
}

TEST(PointCloud, MarksOnlyTheNeighbourhoodOfTheHip) {
  const Snapshot snapshot = onePixel();
  const std::string ply = plyOf(snapshot, 0.009);
  EXPECT_NE(colourAt(ply, ply.find("end_header\n") + 11), kNeighbourColour);
}

TEST(PointCloud, LeavesOutAnUnknownHip) {
  Snapshot snapshot = onePixel();
  snapshot.hip_m_in_world.x = std::nan("");
  snapshot.proxy_m_in_world.x = std::nan("");
  EXPECT_NE(plyOf(snapshot, 0.04).find("element vertex 1\n"), std::string::npos);
}

TEST(DepthPicture, IsBlackWithoutDepthAndHasACrossAtTheHip) {
  Snapshot snapshot = onePixel();
  const std::vector<Rgb> picture = depthPicture(snapshot);
  EXPECT_EQ(picture[0], kNoDepthColour);
  // the HIP is 1 cm nearer on a ray that leaves the axis slowly: within a pixel of the point
  int red = 0;
  for (int v = 297; v <= 303; ++v)
    red += picture[static_cast<std::size_t>(v * drivers::kKinectWidth + 320)] == kHipColour;
  EXPECT_GE(red, 1);
  snapshot.hip_m_in_world = {1, 2, 4};  // behind the camera
  EXPECT_EQ(std::ranges::count(depthPicture(snapshot), kHipColour), 0);
}

/// A wall from `near_m` at the left to `far_m` at the right, raw values by the depth model.
Snapshot slope(double near_m, double far_m) {
  Snapshot snapshot = onePixel();
  const rt::DepthModelParameters m;
  for (std::size_t i = 0; i < snapshot.raw.size(); ++i) {
    const double share = static_cast<double>(i % drivers::kKinectWidth) / (drivers::kKinectWidth - 1);
    const double depth_m = near_m + share * (far_m - near_m);
    snapshot.raw[i] = static_cast<std::uint16_t>(std::lround((1 / depth_m - m.b_per_m) / m.a_per_m));
  }
  return snapshot;
}

TEST(DepthPicture, SpreadsItsColoursOverTheDepthsThatThereAre) {
  Snapshot snapshot = slope(0.8, 1.2);
  const DepthRange range = contrastRange(snapshot);
  EXPECT_NEAR(range.near_m, 0.8, 0.02);  // a percent of 0.4 m, and a step of the disparity
  EXPECT_NEAR(range.far_m, 1.2, 0.02);
  const std::vector<Rgb> picture = depthPicture(snapshot);
  EXPECT_EQ(picture[0], colourOfDepth(range.near_m, range.near_m, range.far_m));
  EXPECT_EQ(picture[drivers::kKinectWidth - 1], colourOfDepth(range.far_m, range.near_m, range.far_m));
  // half a percent of the pixels, nearer and farther: they take no contrast away
  for (std::size_t i = 0; i < drivers::kKinectPixels / 200; ++i) snapshot.raw[i] = i % 2 == 0 ? 400 : 1000;
  EXPECT_NEAR(contrastRange(snapshot).near_m, range.near_m, 0.01);
  EXPECT_NEAR(contrastRange(snapshot).far_m, range.far_m, 0.01);
}

TEST(DepthPicture, AFlatWallHasARangeOfFiveCentimetresAndNothingTheCameras) {
  Snapshot snapshot = slope(1, 1);
  EXPECT_NEAR(contrastRange(snapshot).far_m - contrastRange(snapshot).near_m, 0.05, 1e-9);
  snapshot.raw.assign(drivers::kKinectPixels, drivers::kKinectNoMeasurement);
  EXPECT_EQ(contrastRange(snapshot).near_m, snapshot.depth_model.near_m);
  EXPECT_EQ(contrastRange(snapshot).far_m, snapshot.depth_model.far_m);
}

TEST(DepthScale, ShowsTheColoursOfTheRangeFromNearToFarWithTicks) {
  const DepthRange range{0.8, 1.2};
  const std::vector<Rgb> scale = depthScale(range, 480);
  ASSERT_EQ(scale.size(), 480U * kScaleWidth);
  const auto at = [&](std::size_t column, std::size_t row) { return scale[row * kScaleWidth + column]; };
  EXPECT_EQ(at(20, 16), colourOfDepth(0.8, 0.8, 1.2));
  EXPECT_EQ(at(20, 464), colourOfDepth(1.2, 0.8, 1.2));
  // 0.80, 0.85 ... 1.20: nine ticks right of the bar
  int ticks = 0;
  for (std::size_t row = 0; row < 480; ++row) ticks += at(33, row) == Rgb{0, 0, 0};
  EXPECT_EQ(ticks, 9);
}

TEST(DepthPicture, ReadsBackFromPng) {
  const Snapshot snapshot = onePixel();
  const auto png = pngOf(snapshot);
  ASSERT_TRUE(png);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_memory(&image, png->data(), png->size()));
  EXPECT_EQ(image.width, 640U + kScaleWidth);
  EXPECT_EQ(image.height, 480U);
  image.format = PNG_FORMAT_RGB;
  std::vector<Rgb> pixels(std::size_t{image.width} * image.height);
  ASSERT_TRUE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr));
  // the pixels of the camera are those of the file, and the scale is at the right of them
  std::vector<Rgb> seen, scale;
  for (std::size_t i = 0; i < pixels.size(); ++i) (i % image.width < 640 ? seen : scale).push_back(pixels[i]);
  EXPECT_EQ(seen, depthPicture(snapshot));
  EXPECT_EQ(scale, depthScale(contrastRange(snapshot), 480));
}

// Source: the test vectors of RFC 4648, section 10.
TEST(Base64, DecodesTheVectorsOfItsStandard) {
  for (const auto& [text, bytes] : std::vector<std::pair<std::string, std::string>>{{"", ""},
                                                                                    {"Zg==", "f"},
                                                                                    {"Zm8=", "fo"},
                                                                                    {"Zm9v", "foo"},
                                                                                    {"Zm9vYg==", "foob"},
                                                                                    {"Zm9vYmFy", "foobar"}}) {
    EXPECT_EQ(base::base64Decoded(text), bytes) << text;
  }
  for (const char* bad : {"Zg=", "Z", "Zm9*", "Zg==Zg==", "===="})
    EXPECT_FALSE(base::base64Decoded(bad)) << bad;
}

Json headerReply() {
  return Json::parse(R"({"header": {"frame": 1, "width": 640, "height": 480,
    "depthModel": {"aPerM": -0.003, "bPerM": 3.3, "fxPx": 590, "fyPx": 590, "cxPx": 320, "cyPx": 240, "nearM": 0.4, "farM": 4},
    "cameraPose": {"xM": 0, "yM": 0, "zM": 0, "rollRad": 0, "pitchRad": 0, "yawRad": 0}}, "firstRow": 0, "rows": ""})");
}

TEST(SnapshotAssembler, RefusesRepliesThatDoNotFit) {
  const auto errorOf = [](const std::string& field, const Json& value) {
    Json reply = headerReply();
    reply[Json::json_pointer(field)] = value;
    SnapshotAssembler assembler;
    const auto good = assembler.add(reply);
    return good ? std::string() : good.error().what;
  };
  EXPECT_EQ(errorOf("/firstRow", 0), "");
  EXPECT_EQ(errorOf("/header", nullptr), "the first reply has no header");
  EXPECT_EQ(errorOf("/header/width", 1288), "a frame of 1288x480 pixels, at most 1280x800 expected");
  EXPECT_EQ(errorOf("/header/depthModel/aPerM", nullptr),
            "the depth model or the camera's pose is missing or wrong");
  EXPECT_EQ(errorOf("/firstRow", 5), "row 5 where 0 is due");
  EXPECT_EQ(errorOf("/rows", "Zm9v"), "incomplete rows");
  EXPECT_EQ(errorOf("/rows", "*"), "incomplete rows");
  SnapshotAssembler unfinished;
  ASSERT_TRUE(unfinished.add(headerReply()));
  EXPECT_EQ(unfinished.finish().error().what, "0 rows where a frame has 480");
}

std::ptrdiff_t filesIn(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), {});
}

TEST(WholeFile, NeverReplacesWithoutBeingAskedTo) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.write("picture", "old");
  const auto refused = base::writeWholeFile(file, "new", base::IfExists::refuse);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().remedy.find("--force"), std::string::npos);
  EXPECT_EQ(fs::file_size(file), 3U);
  ASSERT_TRUE(base::writeWholeFile(file, "newer", base::IfExists::replace));
  EXPECT_EQ(fs::file_size(file), 5U);
  EXPECT_EQ(filesIn(folder.path()), 1);
}

TEST(WholeFile, DoesNotReplaceWhatAppearedMeanwhile) {
  const test::TemporaryFolder folder;
  auto whole = base::WholeFile::create(folder.path() / "rows");
  ASSERT_TRUE(whole);
  ASSERT_TRUE(whole->append("ours"));
  const fs::path theirs = folder.write("rows", "theirs");
  const auto finished = whole->finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().text().find("exists already"), std::string::npos) << finished.error().text();
  EXPECT_EQ(fs::file_size(theirs), 6U);
}

TEST(WholeFile, LeavesNothingBehindWhenItFails) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(base::writeWholeFile(folder.path() / "no" / "file", "bytes", base::IfExists::refuse));
  fs::create_directory(folder.path() / "folder");
  EXPECT_FALSE(base::writeWholeFile(folder.path() / "folder", "bytes", base::IfExists::replace));
  {
    auto never_finished = base::WholeFile::create(folder.path() / "file");
    ASSERT_TRUE(never_finished);
    ASSERT_TRUE(never_finished->append("half"));
    EXPECT_EQ(filesIn(folder.path()), 2);
  }
  EXPECT_EQ(filesIn(folder.path()), 1);
}

TEST(WholeFile, IsReadByThoseWhoMayReadOtherFiles) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "picture";
  const mode_t before = ::umask(0022);
  const auto written = base::writeWholeFile(file, "bytes", base::IfExists::refuse);
  ::umask(before);
  ASSERT_TRUE(written);
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0644U);
}

}  // namespace
}  // namespace hapticd::tools
