// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "drivers/camera/kinect_image.h"
#include "tests/support/golden_file.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/support/temporary_folder.h"
#include "tools/haptic-replay/replay.h"

namespace hapticd::tools {
namespace {

/// Three frames at 0, 33.369 and 100.107 ms.
void fillUnevenly(test::ScratchRecording& recording) {
  recording.add(1, "1500000000.500000", 1000);
  recording.add(2, "1500000000.533369", 2000);
  recording.add(3, "1500000000.600107", 3000);
  recording.writeIndex();
}

DepthSource opened(const std::filesystem::path& path) {
  auto source = DepthSource::open(path);
  if (!source) throw std::runtime_error(source.error().text());
  return std::move(*source);
}

bool holdsMadeUpFrame(const rt::DepthFrame& frame, std::uint32_t number) {
  for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel) {
    if (frame.raw[pixel] != test::madeUpPixel(number, pixel)) return false;
  }
  return true;
}

TEST(DepthSource, GivesAFrameFromItsArrivalUntilTheNextOneArrivesAndTheLastOneFromThenOn) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  for (const auto& [time_ns, frame] :
       std::initializer_list<std::pair<std::int64_t, std::size_t>>{{0, 0},
                                                                   {33'368'999, 0},
                                                                   {33'369'000, 1},
                                                                   {60'000'000, 1},
                                                                   {100'106'999, 1},
                                                                   {100'107'000, 2},
                                                                   {1'000'000'000'000'000'000, 2}}) {
    EXPECT_EQ(source.frameAt(time_ns), frame) << time_ns;
  }
}

TEST(DepthSource, GivesARecordedFrameItsArrivalSinceTheFirstOne) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  EXPECT_FALSE(source.isImage());
  const auto frame = std::make_unique<rt::DepthFrame>();
  ASSERT_TRUE(source.read(0, *frame));
  EXPECT_EQ(frame->arrival_ns, 0);
  ASSERT_TRUE(source.read(2, *frame));
  EXPECT_EQ(frame->arrival_ns, 100'107'000);
}

TEST(DepthSource, ReadsThePixelsOfTheFrameAskedFor) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (const std::size_t index : {std::size_t{2}, std::size_t{0}}) {
    ASSERT_TRUE(source.read(index, *frame));
    EXPECT_TRUE(holdsMadeUpFrame(*frame, static_cast<std::uint32_t>(index) + 1));
    EXPECT_NE(frame->sequence, 0U);  // 0 would mean: nothing modelled
  }
}

TEST(DepthSource, GivesASingleImageForAllTimes) {
  const test::TemporaryFolder folder;
  const DepthSource source = opened(folder.write("image.pgm", test::pgmBytes(7)));
  EXPECT_TRUE(source.isImage());
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (const std::int64_t time_ns : {std::int64_t{0}, std::int64_t{1'000'000'000'000'000'000}}) {
    EXPECT_EQ(source.frameAt(time_ns), 0U);
  }
  ASSERT_TRUE(source.read(0, *frame));
  EXPECT_TRUE(holdsMadeUpFrame(*frame, 7));
  EXPECT_NE(frame->sequence, 0U);
}

constexpr const char* kHeader = "t_s,x_m,y_m,z_m\n";

/// Returns the errors of reading a file with that content; empty if it is valid.
std::vector<std::string> errorsOf(const std::string& content) {
  const test::TemporaryFolder folder;
  const auto samples = readHipCsv(folder.write("hip.csv", content));
  std::vector<std::string> texts;
  if (samples) return texts;
  for (const base::Error& error : samples.error()) texts.push_back(error.text());
  return texts;
}

/// The samples, or the errors without the folder of the file.
TEST(HipCsv, GivesTheSamplesOrTheErrorsOfTheGoldenFile) {
  test::expectGolden(GOLDEN_HIP_FILES, [](const std::string& content) {
    const test::TemporaryFolder folder;
    const auto samples = readHipCsv(folder.write("hip.csv", content));
    std::string text;
    if (samples) {
      for (const auto& [time_s, hip] : *samples)
        text += fmt::format("{} {} {} {}\n", time_s, hip.x, hip.y, hip.z);
      return fmt::format("{} samples\n{}", samples->size(), text);
    }
    for (const base::Error& error : samples.error())
      text += error.text().substr(folder.path().string().size() + 1) + "\n";
    return text;
  });
}

TEST(HipCsv, ReadsEverySampleExactly) {
  const test::TemporaryFolder folder;
  const auto samples = readHipCsv(folder.write(
      "hip.csv", std::string(kHeader) + "0,0.123456789,-1.5e-3,-0.9\n0.001,10,-10,0\n1e9, 1 ,2,3"));
  ASSERT_TRUE(samples);
  ASSERT_EQ(samples->size(), 3U);
  EXPECT_EQ((*samples)[0].time_s, 0);
  EXPECT_EQ((*samples)[0].hip_m_in_world, (rt::Vec3{0.123456789, -0.0015, -0.9}));
  EXPECT_EQ((*samples)[1].time_s, 0.001);
  EXPECT_EQ((*samples)[1].hip_m_in_world, (rt::Vec3{10, -10, 0}));
  EXPECT_EQ((*samples)[2].time_s, 1e9);
  EXPECT_EQ((*samples)[2].hip_m_in_world, (rt::Vec3{1, 2, 3}));
}

TEST(HipCsv, SaysThatAMissingFileOrAFolderCannotBeRead) {
  const test::TemporaryFolder folder;
  for (const auto& path : {folder.path() / "none.csv", folder.path()}) {
    const auto samples = readHipCsv(path);
    ASSERT_FALSE(samples) << path;
    ASSERT_EQ(samples.error().size(), 1U);
    EXPECT_EQ(samples.error().front().text(), path.string() + ": cannot be read (check --hip)");
  }
}

TEST(HipCsv, ListsNoMoreErrorsThanAPersonReads) {
  std::string content = kHeader;
  for (int row = 0; row < 5000; ++row) content += "0,0,0,nan\n";
  const auto errors = errorsOf(content);
  EXPECT_EQ(errors.size(), 20U);
  EXPECT_NE(errors.back().find("hip.csv:21: "), std::string::npos) << errors.back();
}

TEST(HipCsv, ShowsLittleOfALongField) {
  EXPECT_LT(errorsOf(kHeader + std::string(3000, 'x') + ",1,2,3\n").at(0).size(), 300U);
}

TEST(HipCsv, SurvivesBytesThatAreNoText) {
  std::string content = kHeader;
  for (int byte = 0; byte < 256; ++byte) content.push_back(static_cast<char>(byte));
  EXPECT_FALSE(errorsOf(content).empty());
}

}  // namespace
}  // namespace hapticd::tools
