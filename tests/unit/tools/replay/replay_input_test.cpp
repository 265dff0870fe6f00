// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <memory>

#include "drivers/camera/kinect_image.h"
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

/// The error of a file whose second line is `row`, without the path.
std::string errorOfRow(const std::string& row) {
  const std::vector<std::string> errors = errorsOf(kHeader + row + "\n");
  EXPECT_EQ(errors.size(), 1U) << row;
  const std::string text = errors.empty() ? "" : errors.front();
  const std::size_t place = text.find("hip.csv:2: ");
  EXPECT_NE(place, std::string::npos) << text;
  return place == std::string::npos ? text : text.substr(place + std::string("hip.csv:2: ").size());
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

TEST(HipCsv, TakesAHeaderAsProgramsOfTablesWriteIt) {
  const test::TemporaryFolder folder;
  for (const char* header : {"\xEF\xBB\xBFt_s,x_m,y_m,z_m\r\n", "\"t_s\",\"x_m\",\"y_m\",\"z_m\"\n",
                             "\xEF\xBB\xBF\"t_s\", \"x_m\", \"y_m\", \"z_m\"\n"}) {
    const auto samples = readHipCsv(folder.write("hip.csv", std::string(header) + "0.5,1,2,3\n"));
    ASSERT_TRUE(samples) << header << samples.error().front().text();
    EXPECT_EQ(samples->size(), 1U);
  }
  for (const char* header : {"\"t_s,x_m,y_m,z_m\"\n", "t_s,x_m,y_m\n", "x_m,t_s,y_m,z_m\n"})
    EXPECT_FALSE(errorsOf(std::string(header) + "0.5,1,2,3\n").empty()) << header;
}

TEST(HipCsv, ReadsAFileWithCrLfLineEndsLikeOneWithLf) {
  const test::TemporaryFolder folder;
  const auto samples =
      readHipCsv(folder.write("hip.csv", "t_s,x_m,y_m,z_m\r\n0.5,1,2,3\r\n\r\n0.6,4,5,6\r\n"));
  ASSERT_TRUE(samples);
  ASSERT_EQ(samples->size(), 2U);
  EXPECT_EQ((*samples)[0].hip_m_in_world, (rt::Vec3{1, 2, 3}));
  EXPECT_EQ((*samples)[1].time_s, 0.6);
  EXPECT_EQ((*samples)[1].hip_m_in_world, (rt::Vec3{4, 5, 6}));
}

TEST(HipCsv, ReadsAHeaderAloneAsNoSamples) {
  const test::TemporaryFolder folder;
  const auto samples = readHipCsv(folder.write("hip.csv", kHeader));
  ASSERT_TRUE(samples);
  EXPECT_TRUE(samples->empty());
}

TEST(HipCsv, RefusesAFileWithoutTheHeader) {
  for (const std::string content : {"", "0,1,2,3\n", "t,x,y,z\n0,1,2,3\n", "\n", "t_s,x_m,y_m,z_m,\n"}) {
    const auto errors = errorsOf(content);
    ASSERT_EQ(errors.size(), 1U) << content;
    EXPECT_NE(errors.front().find("hip.csv:1: the header 't_s,x_m,y_m,z_m' is missing"), std::string::npos)
        << errors.front();
  }
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

TEST(HipCsv, RefusesABadRowWithItsColumnValueAndRange) {
  const std::string columns = " columns where 4 are expected (t_s,x_m,y_m,z_m)";
  const std::string metres = " (allowed: -10..10 m)", seconds = " (allowed: 0..1000000000 s)";
  for (const auto& [row, error] : std::vector<std::pair<std::string, std::string>>{
           {"1,2,3", "3" + columns},
           {"1,2,3,4,5", "5" + columns},
           {"1,2,3,4,", "5" + columns},
           {"1,left,3,4", "x_m: \"left\" is not a number" + metres},
           {"1,2,,4", "y_m: \"\" is not a number" + metres},
           {"1,2,3,4m", "z_m: \"4m\" is not a number" + metres},
           {"0x10,2,3,4", "t_s: \"0x10\" is not a number" + seconds},
           {"nan,2,3,4", "t_s: \"nan\" is out of range" + seconds},
           {"1,NaN,3,4", "x_m: \"NaN\" is out of range" + metres},
           {"1,2,3,-inf", "z_m: \"-inf\" is out of range" + metres},
           {"-0.001,2,3,4", "t_s: \"-0.001\" is out of range" + seconds},
           {"1.1e9,2,3,4", "t_s: \"1.1e9\" is out of range" + seconds},
           {"1,10.0001,3,4", "x_m: \"10.0001\" is out of range" + metres}}) {
    EXPECT_EQ(errorOfRow(row), error);
  }
}

TEST(HipCsv, ListsEveryBadLineWithItsNumber) {
  const auto errors = errorsOf(std::string(kHeader) + "0,0,0,0\n1,nan,0,0\n2,0,0,0\n\n3,0,0\n4,0,0,99\n");
  ASSERT_EQ(errors.size(), 3U);
  EXPECT_NE(errors[0].find("hip.csv:3: x_m: \"nan\""), std::string::npos) << errors[0];
  EXPECT_NE(errors[1].find("hip.csv:6: 3 columns"), std::string::npos) << errors[1];
  EXPECT_NE(errors[2].find("hip.csv:7: z_m: \"99\""), std::string::npos) << errors[2];
}

TEST(HipCsv, ListsNoMoreErrorsThanAPersonReads) {
  std::string content = kHeader;
  for (int row = 0; row < 5000; ++row) content += "0,0,0,nan\n";
  const auto errors = errorsOf(content);
  EXPECT_EQ(errors.size(), 20U);
  EXPECT_NE(errors.back().find("hip.csv:21: "), std::string::npos) << errors.back();
}

TEST(HipCsv, SurvivesBytesThatAreNoText) {
  std::string content = kHeader;
  for (int byte = 0; byte < 256; ++byte) content.push_back(static_cast<char>(byte));
  EXPECT_FALSE(errorsOf(content).empty());
}

TEST(HipCsv, ShowsOfALongOrDangerousFieldWhatATerminalMayShow) {
  const auto errors =
      errorsOf(std::string(kHeader) + "\x1b[2J\xc2\x9b,1,2,3\n" + std::string(3000, 'x') + ",1,2,3\n");
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_NE(errors[0].find(R"("\x1b[2J\xc2\x9b")"), std::string::npos) << errors[0];
  EXPECT_EQ(errors[0].find('\x1b'), std::string::npos);
  EXPECT_LT(errors[1].size(), 300U) << errors[1];
}

}  // namespace
}  // namespace hapticd::tools
