// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <cstring>

#include "config/base64.h"
#include "tools/hapticctl/snapshot/depth_picture.h"
#include "tools/hapticctl/snapshot/point_cloud.h"
#include "tools/hapticctl/snapshot/snapshot.h"

namespace hapticd::tools {
namespace {

constexpr std::uint16_t kRaw = 700;
constexpr std::size_t kVertexBytes = 15;

/// One pixel that measures, right below the optical axis; the HIP 1 cm in front of it.
Snapshot onePixel() {
  Snapshot snapshot;
  snapshot.frame = 7;
  snapshot.raw.assign(rt::kFramePixels, rt::kRawNoMeasurement);
  snapshot.raw[300 * rt::kFrameWidth + 320] = kRaw;
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
    red += picture[static_cast<std::size_t>(v * rt::kFrameWidth + 320)] == kHipColour;
  EXPECT_GE(red, 1);
  snapshot.hip_m_in_world = {1, 2, 4};  // behind the camera
  EXPECT_EQ(std::ranges::count(depthPicture(snapshot), kHipColour), 0);
}

TEST(DepthPicture, ReadsBackFromPng) {
  const Snapshot snapshot = onePixel();
  const auto png = pngOf(snapshot);
  ASSERT_TRUE(png);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_memory(&image, png->data(), png->size()));
  EXPECT_EQ(image.width, 640U);
  EXPECT_EQ(image.height, 480U);
  image.format = PNG_FORMAT_RGB;
  std::vector<Rgb> pixels(rt::kFramePixels);
  ASSERT_TRUE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr));
  EXPECT_EQ(pixels, depthPicture(snapshot));
}

// Source: the test vectors of RFC 4648, section 10.
TEST(Base64, DecodesTheVectorsOfItsStandard) {
  for (const auto& [text, bytes] : std::vector<std::pair<std::string, std::string>>{{"", ""},
                                                                                    {"Zg==", "f"},
                                                                                    {"Zm8=", "fo"},
                                                                                    {"Zm9v", "foo"},
                                                                                    {"Zm9vYg==", "foob"},
                                                                                    {"Zm9vYmFy", "foobar"}}) {
    EXPECT_EQ(config::base64Decoded(text), bytes) << text;
  }
  for (const char* bad : {"Zg=", "Z", "Zm9*", "Zg==Zg==", "===="})
    EXPECT_FALSE(config::base64Decoded(bad)) << bad;
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
  EXPECT_EQ(errorOf("/header/width", 320), "a frame of 320x480 pixels, 640x480 expected");
  EXPECT_EQ(errorOf("/header/depthModel/aPerM", nullptr), "the depth model or the camera's pose is missing");
  EXPECT_EQ(errorOf("/firstRow", 5), "row 5 where 0 is due");
  EXPECT_EQ(errorOf("/rows", "Zm9v"), "rows that are no whole rows");
  EXPECT_EQ(errorOf("/rows", "*"), "rows that are no whole rows");
  SnapshotAssembler unfinished;
  ASSERT_TRUE(unfinished.add(headerReply()));
  EXPECT_EQ(unfinished.finish().error().what, "0 rows where a frame has 480");
}

}  // namespace
}  // namespace hapticd::tools
