// SPDX-License-Identifier: Apache-2.0
// A data set's depth images, made into a recording by the shipped script and replayed.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/camera/recorded/recording_reader.h"
#include "tests/support/recordings/depth_images.h"
#include "tests/support/temporary_folder.h"
#include "tests/system/support/daemon_under_test.h"
#include "tools/lib/oracle/spring_oracle.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

constexpr std::array<double, 3> kBallAt_m{-0.60, -0.61, -0.62};
constexpr std::array<const char*, 3> kTimes_s{"1305031102.160407", "1305031102.194330", "1305031102.226738"};

rt::DepthModelParameters camera() {
  return tools::stereoCamera(424, 240, 69, 0.05, 0.001, 0.4, 4);
}

class RecordingFromImages : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(images_);
    std::string list = "# timestamp filename\n";
    for (std::size_t i = 0; i < kBallAt_m.size(); ++i) {
      const std::string name = fmt::format("images/{}.png", kTimes_s[i]);
      folder_.write(name, greyPng(camera_.width_px, camera_.height_px, pixelsOfImage(i)));
      list += fmt::format("{} {}\n", kTimes_s[i], name);
    }
    list_ = folder_.write("depth.txt", list);
  }
  std::vector<std::uint16_t> pixelsOfImage(std::size_t i) const {
    return pixelsOf(*tools::frameOf(camera_, tools::ball(camera_, {0.01, 0.02, kBallAt_m[i]}, 0.1)));
  }
  Finished make(const fs::path& source, const std::vector<std::string>& options = {}) const {
    std::vector<std::string> command{"/usr/bin/python3",
                                     HAPTICD_IMAGES_EXAMPLE,
                                     fmt::format("--fx={}", camera_.fx_px),
                                     fmt::format("--fy={}", camera_.fy_px),
                                     fmt::format("--cx={}", camera_.cx_px),
                                     fmt::format("--cy={}", camera_.cy_px),
                                     source.string(),
                                     recording_.string()};
    command.insert(command.end(), options.begin(), options.end());
    return runToEnd(command);
  }
  void expectRefused(const Finished& finished, const std::string& reason) const {
    EXPECT_EQ(finished.ending, exitedWith(1));
    EXPECT_NE(finished.errors.find(reason), std::string::npos) << finished.errors;
    EXPECT_FALSE(fs::exists(recording_));
    EXPECT_FALSE(fs::exists(recording_.string() + ".unfinished"));
  }

  const rt::DepthModelParameters camera_ = camera();
  const TemporaryFolder folder_;
  const fs::path images_ = folder_.path() / "images";
  const fs::path recording_ = folder_.path() / "recording";
  fs::path list_;
};

TEST_F(RecordingFromImages, HoldsThePixelsTimesAndPosesOfAList) {
  const fs::path poses = folder_.write(
      "poses.txt",
      "# timestamp tx ty tz qx qy qz qw\n1305031102.16 0.5 1 2 0 0 0 1\n1305031102.2 3 4 5 0.6 0 0 0.8\n");
  const Finished finished = make(list_, {"--poses", poses.string()});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_EQ(finished.output, recording_.string() + ": 3 frames of 424 x 240 pixels, 2 with a pose\n");

  const auto reader = drivers::RecordingReader::open(recording_, {0.4, 4});
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_EQ(reader->frames().size(), 3U);
  EXPECT_EQ(reader->frames()[0].realtime_ns, 1'305'031'102'160'407'000);
  EXPECT_EQ(reader->frames()[2].host_ns, 66'331'000);
  ASSERT_TRUE(reader->frames()[1].pose);
  EXPECT_EQ(reader->frames()[1].pose->position_m, (rt::Vec3{3, 4, 5}));
  EXPECT_EQ(reader->frames()[1].pose->qx, 0.6);
  EXPECT_FALSE(reader->frames()[2].pose) << "the nearest pose is 27 ms away";
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto read = reader->read(i, *frame);
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(pixelsOf(*frame), pixelsOfImage(i)) << i;
  }
}

TEST_F(RecordingFromImages, OfAFolderIsReplayedWithTheForcesOfItsPixels) {
  ASSERT_EQ(make(images_, {"--rate", "10"}).ending, exitedWith(0));

  std::mt19937 random(7);
  std::uniform_real_distribution<double> offset_m(-0.03, 0.03);
  std::string positions = "t_s,x_m,y_m,z_m\n";
  std::vector<rt::Vec3> hips;
  constexpr std::size_t kPlaces = 60;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const std::size_t image = i * 3 / kPlaces;
    hips.push_back({0.01 + offset_m(random), 0.02 + offset_m(random), kBallAt_m[image] + 0.1});
    const rt::Vec3& hip = hips.back();
    positions += fmt::format("{},{},{},{}\n", 0.1 * static_cast<double>(image) + 0.05, hip.x, hip.y, hip.z);
  }
  const fs::path out = folder_.path() / "forces.csv";
  const Finished finished = runToEnd(hapticReplayCommand(
      {"--config", folder_.write("law.yaml", "force: {law: nearest_springs}").string(), "--depth",
       recording_.string(), "--hip", folder_.write("hip.csv", positions).string(), "--out", out.string()}));
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;

  std::ifstream stream(out);
  std::string line;
  std::getline(stream, line);
  std::size_t with_force = 0;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const std::size_t image = i * 3 / kPlaces;
    ASSERT_TRUE(std::getline(stream, line));
    std::istringstream cells(line);
    std::array<double, 9> values{};  // t_s, x_m, y_m, z_m, fx_n, fy_n, fz_n, points, frame
    for (double& value : values) {
      cells >> value;
      cells.ignore();
    }
    const std::vector<std::uint16_t> raws = pixelsOfImage(image);
    std::vector<rt::Vec3> points;
    for (std::size_t pixel = 0; pixel < raws.size(); ++pixel) {
      if (raws[pixel] == 0) continue;
      const auto width = static_cast<std::size_t>(camera_.width_px);
      const double depth_m = 0.001 * raws[pixel];
      points.push_back({(static_cast<double>(pixel % width) - camera_.cx_px) * depth_m / camera_.fx_px,
                        -(static_cast<double>(pixel / width) - camera_.cy_px) * depth_m / camera_.fy_px,
                        -depth_m});
    }
    const tools::SpringOracle expected(points, hips[i], {});
    EXPECT_LT(expected.error_n({values[4], values[5], values[6]}), 1e-4) << line;
    EXPECT_EQ(values[7], static_cast<double>(expected.pointsUsed())) << line;
    EXPECT_EQ(values[8], static_cast<double>(image)) << line;
    if (expected.pointsUsed() > 0) ++with_force;
  }
  EXPECT_GT(with_force, kPlaces / 2);
}

TEST_F(RecordingFromImages, TakesNumbersInNamesByTheirValues) {
  const fs::path folder = folder_.path() / "numbered";
  fs::create_directory(folder);
  const std::vector<std::string> names{"1", "2", "02", "9", "10", "11", "100"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto raw = static_cast<std::uint16_t>(1000 + i);
    folder_.write("numbered/frame" + names[i] + ".png",
                  greyPng(16, 16, std::vector<std::uint16_t>(256, raw)));
  }
  const Finished finished = make(folder);
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  const auto reader = drivers::RecordingReader::open(recording_, {0.4, 4});
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_EQ(reader->frames().size(), names.size());
  const auto frame = std::make_unique<rt::DepthFrame>();
  std::vector<std::uint16_t> order;
  for (std::size_t i = 0; i < names.size(); ++i) {
    ASSERT_TRUE(reader->read(i, *frame));
    order.push_back(frame->raw[0]);
  }
  EXPECT_EQ(order, (std::vector<std::uint16_t>{1000, 1002, 1001, 1003, 1004, 1005, 1006}));
}

TEST_F(RecordingFromImages, TakesAListWithAByteOrderMark) {
  const Finished finished = make(folder_.write("marked.txt", fmt::format("\xEF\xBB\xBF"
                                                                         "1 images/{}.png\n",
                                                                         kTimes_s[0])));
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
}

TEST_F(RecordingFromImages, RefusesWhatIsNoDepthByNameAndLeavesNothing) {
  folder_.write("images/odd.png", greyPng(16, 15, std::vector<std::uint16_t>(240, 1000)));
  expectRefused(make(images_), "odd.png has 16 x 15 pixels; 16 x 16 to 1280 x 800 are possible");
  folder_.write("images/odd.png", bytePng(camera_.width_px, camera_.height_px));
  expectRefused(make(images_), "odd.png does not have 16 bits of grey");
  folder_.write("images/odd.png", greyPng(16, 16, std::vector<std::uint16_t>(256, 1000)));
  expectRefused(make(images_), "odd.png does not have 424 x 240 pixels as the first image has");
  folder_.write("images/odd.png", "text");
  expectRefused(make(images_), "odd.png is not a PNG file");
  expectRefused(make(folder_.write("gone.txt", "1 images/gone.png\n")),
                "gone.txt:1: No such file or directory");
  expectRefused(make(folder_.path() / "nowhere"), "nowhere: cannot be read");
  expectRefused(make(folder_.write("empty.txt", "# nothing\n")), "empty.txt: names no image");
}

TEST_F(RecordingFromImages, RefusesTimesAndPosesByLineAndLeavesNothing) {
  const std::string first = fmt::format("images/{}.png", kTimes_s[0]);
  const auto listOf = [&](const std::string& times) {
    std::istringstream words(times);
    std::string text;
    for (std::string time; words >> time;) text += time + " " + first + "\n";
    return folder_.write("list.txt", text);
  };
  expectRefused(make(listOf("2 1")), "list.txt:2: the time is not after");
  expectRefused(make(listOf("now")), "list.txt:1: 'now' is not a time");
  expectRefused(make(listOf("NaN")), "list.txt:1: 'NaN' is not a time");
  expectRefused(make(listOf("-1")), "list.txt:1: '-1' is not a time");
  expectRefused(make(folder_.write("short.txt", "1\n")), "short.txt:1: has 1 values");
  const auto poses = [&](const std::string& text) {
    return std::vector<std::string>{"--poses", folder_.write("poses.txt", text).string()};
  };
  expectRefused(make(list_, poses("1 0 0 0 0 0 0\n")), "poses.txt:1: has 7 values");
  expectRefused(make(list_, poses("1 0 0 0 0 0 0 x\n")), "poses.txt:1: a pose has numbers only");
  expectRefused(make(list_, poses("1 0 0 0 0 0 0 2\n")),
                "poses.txt:1: the quaternion does not have the norm 1");
  expectRefused(make(images_, poses("1 0 0 0 0 0 0 1\n")), "poses.txt: has 1 poses for 3 images");
}

TEST_F(RecordingFromImages, DoesNotTouchAFolderThatExists) {
  fs::create_directory(recording_);
  const Finished finished = make(images_);
  EXPECT_EQ(finished.ending, exitedWith(1));
  EXPECT_NE(finished.errors.find("exists already"), std::string::npos) << finished.errors;
  EXPECT_TRUE(fs::is_empty(recording_));
}

}  // namespace
}  // namespace hapticd::test
