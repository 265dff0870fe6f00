// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "drivers/camera/recorded/camera_description.h"
#include "drivers/camera/recorded/depth_image.h"
#include "drivers/camera/recorded/frame_list.h"
#include "tests/support/file_content.h"
#include "tests/support/recordings/depth_images.h"
#include "tests/support/sanitizer.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::drivers {
namespace {

constexpr std::string_view kGood =
    "recording:\n"
    "  version: 1\n"
    "camera:\n"
    "  width_px: 848\n"
    "  height_px: 480\n"
    "  fx_px: 421.5\n"
    "  fy_px: 422.5\n"
    "  cx_px: 423\n"
    "  cy_px: 240\n"
    "  law: linear\n"
    "  unit_m: 0.0001\n"
    "  raw_no_measurement: 0\n";

class CameraDescriptionFile : public testing::Test {
 protected:
  base::Result<CameraDescription> read(std::string_view text) const {
    return readCameraDescription(folder.write("camera.yaml", text));
  }
  std::string errorOf(std::string_view text) const {
    const auto description = read(text);
    return description ? "" : description.error().text();
  }
  /// The good file with a line replaced.
  static std::string with(std::string_view line, std::string_view other) {
    std::string text(kGood);
    const std::size_t at = text.find(line);
    EXPECT_NE(at, std::string::npos) << line;
    return text.replace(at, line.size(), other);
  }
  void expectError(const std::string& text, std::string_view part) const {
    const std::string error = errorOf(text);
    EXPECT_NE(error.find(part), std::string::npos) << part << " is not in: " << error << '\n' << text;
  }

  const test::TemporaryFolder folder;
};

TEST_F(CameraDescriptionFile, ReadsBackEveryNumberToTheBit) {
  rt::DepthModelParameters reciprocal = tools::kinectWithNoise();
  reciprocal.cx_px = 1.0 / 3;
  for (const rt::DepthModelParameters& camera : {tools::stereoCamera(848, 480, 69, 0.018, 0.0001, 0.4, 4),
                                                 tools::timeOfFlightCamera(640, 576), reciprocal}) {
    CameraDescription written{.camera = camera, .near_m = 0.07, .far_m = {}, .serial = "a'b: 00\\1"};
    written.camera.near_m = rt::DepthModelParameters{}.near_m;
    written.camera.far_m = rt::DepthModelParameters{}.far_m;
    const auto read = this->read(textOf(written));
    ASSERT_TRUE(read) << read.error().text() << textOf(written);
    EXPECT_EQ(*read, written);
  }
}

TEST_F(CameraDescriptionFile, HasDefaultsForWhatMayBeLeftOut) {
  const auto read = this->read(kGood);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->camera.raw_values, 65536U);
  EXPECT_EQ(read->camera.principle, rt::DepthPrinciple::active_stereo);
  EXPECT_FALSE(read->camera.noise.isKnown());
  EXPECT_FALSE(read->near_m);
  EXPECT_EQ(read->serial, "");
}

TEST_F(CameraDescriptionFile, NamesWhatIsMissing) {
  for (const std::string_view line :
       {"  version: 1\n", "  width_px: 848\n", "  height_px: 480\n", "  fx_px: 421.5\n", "  fy_px: 422.5\n",
        "  cx_px: 423\n", "  cy_px: 240\n", "  law: linear\n", "  unit_m: 0.0001\n",
        "  raw_no_measurement: 0\n"}) {
    const std::string name(line.substr(2, line.find(':') - 2));
    expectError(with(line, ""), "." + name);
  }
  expectError(with("law: linear", "law: reciprocal"), "does not state camera.a_per_m");
  expectError("", "does not state recording.version");
}

TEST_F(CameraDescriptionFile, RefusesWrongValuesWithTheirLine) {
  const std::pair<std::string_view, std::pair<std::string_view, std::string_view>> cases[] = {
      {"version: 1", {"version: 2", "camera.yaml:2: recording.version"}},
      {"width_px: 848", {"width_px: 1281", "is not an integer from 1 to 1280"}},
      {"width_px: 848", {"width_px: 84.5", "is not an integer from 1 to 1280"}},
      {"width_px: 848", {"width_px: 8", "wrong frame size"}},
      {"height_px: 480", {"height_px: 801", "is not an integer from 1 to 800"}},
      {"fx_px: 421.5", {"fx_px: .nan", "camera.yaml:6: camera.fx_px: \".nan\" is not a finite number"}},
      {"fx_px: 421.5", {"fx_px: 0", "wrong intrinsics"}},
      {"cy_px: 240", {"cy_px: .inf", "is not a finite number"}},
      {"cy_px: 240", {"cy_px: much", "is not a number"}},
      {"law: linear", {"law: cubic", "\"cubic\" is none of: reciprocal, linear"}},
      {"unit_m: 0.0001", {"unit_m: 0", "wrong depth law"}},
      {"unit_m: 0.0001", {"unit_m: -1", "wrong depth law"}},
      {"raw_no_measurement: 0", {"raw_no_measurement: 65536", "is not an integer from 0 to 65535"}},
      {"raw_no_measurement: 0",
       {"raw_no_measurement: 4096\n  raw_values: 4096", "is none of the 4096 raw values"}},
      {"raw_no_measurement: 0",
       {"raw_no_measurement: 0\n  near_m: 2\n  far_m: 1", "wrong near and far limit"}},
      {"raw_no_measurement: 0",
       {"raw_no_measurement: 0\n  principle: magic", "is none of: structured_light"}},
      {"raw_no_measurement: 0", {"raw_no_measurement: 0\nnoise:\n  c1: -1", "wrong noise"}},
      {"raw_no_measurement: 0", {"raw_no_measurement: 0\n  focal: 3", "\"3\" is not known"}},
      {"raw_no_measurement: 0", {"raw_no_measurement: 0\nother:\n  a: 3", "other.a"}},
      {"cx_px: 423", {"cx_px: 423\n  cx_px: 424", "cx_px"}},
      {"recording:", {"recording: [", "camera.yaml"}}};
  for (const auto& [line, changed] : cases) expectError(with(line, changed.first), changed.second);
}

TEST_F(CameraDescriptionFile, RefusesALawWithoutADepthInItsLimits) {
  expectError(with("raw_no_measurement: 0", "raw_no_measurement: 0\n  near_m: 7"), "wrong depth law");
}

namespace fs = std::filesystem;

class FrameList : public testing::Test {
 protected:
  FrameList() {
    folder.write("a.pgm", "");
    folder.write("b.png", "");
  }
  base::Result<std::vector<RecordedFrame>> read(std::string_view text) const {
    folder.write("frames.csv", text);
    return readFrameList(folder.path(), cut_off);
  }
  void expectError(std::string_view text, std::string_view part) const {
    const auto frames = read(text);
    const std::string error = frames ? "" : frames.error().text();
    EXPECT_NE(error.find(part), std::string::npos) << part << " is not in: " << error << '\n' << text;
  }

  const test::TemporaryFolder folder;
  mutable std::string cut_off;
};

TEST_F(FrameList, ReadsBackWhatItWrites) {
  RecordedFrame first{
      .file = "a.pgm", .realtime_ns = 1'700'000'000'123'456'789, .exposure_ns = {}, .pose = {}};
  RecordedFrame second{.file = "b.png",
                       .realtime_ns = 1'700'000'000'123'456'790,
                       .device_ticks = 4294967295U,
                       .exposure_ns = 1'700'000'000'100'000'000,
                       .pose = RecordedPose{{0.1, -1.0 / 3, 1e-17}, 0.5, -0.5, 0.5, 0.5}};
  for (const bool poses : {false, true}) {
    const auto read =
        this->read(frameListHeader(poses) + frameListLine(first, poses) + frameListLine(second, poses));
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->size(), 2U);
    EXPECT_EQ(read->at(0).file, "a.pgm");
    EXPECT_EQ(read->at(0).realtime_ns, first.realtime_ns);
    EXPECT_FALSE(read->at(0).exposure_ns);
    EXPECT_FALSE(read->at(0).pose);
    EXPECT_EQ(read->at(1).realtime_ns, second.realtime_ns);
    EXPECT_EQ(read->at(1).device_ticks, second.device_ticks);
    EXPECT_EQ(read->at(1).exposure_ns, second.exposure_ns);
    ASSERT_EQ(read->at(1).pose.has_value(), poses);
    if (!poses) continue;
    EXPECT_EQ(read->at(1).pose->position_m, second.pose->position_m);
    EXPECT_EQ(read->at(1).pose->qy, -0.5);
  }
}

TEST_F(FrameList, TakesSecondsAndColumnsInAnyOrder) {
  const auto frames = read("time_s,file\n1305031102.160407,a.pgm\n1305031102.5,b.png\n");
  ASSERT_TRUE(frames) << frames.error().text();
  EXPECT_EQ(frames->at(0).realtime_ns, 1'305'031'102'160'407'000);
  EXPECT_EQ(frames->at(1).realtime_ns, 1'305'031'102'500'000'000);
}

TEST_F(FrameList, TakesAHeaderAsProgramsOfTablesWriteIt) {
  const auto frames = read("\xEF\xBB\xBF\"time_s\", \"file\"\n1,a.pgm\n2,b.png\n");
  ASSERT_TRUE(frames) << frames.error().text();
  EXPECT_EQ(frames->at(1).file, "b.png");
}

TEST_F(FrameList, LeavesOutALastLineThatWasCutOffAndNamesIt) {
  for (const char* line : {"b.p", "b.png", "b.png,", "b.png,17", "b.png,17,2,"}) {
    const auto frames = read(std::string("file,time_ns,device_ticks\na.pgm,5,\n") + line);
    ASSERT_TRUE(frames) << frames.error().text();
    EXPECT_EQ(frames->size(), 1U);
    EXPECT_NE(cut_off.find("frames.csv:3: "), std::string::npos) << cut_off;
    expectError(std::string("file,time_ns,device_ticks\na.pgm,5,\n") + line + "\n", "frames.csv:3: ");
    expectError(std::string("file,time_ns,device_ticks\n") + line, "frames.csv:2: ");
  }
}

TEST_F(FrameList, RefusesPathsOutOfTheFolder) {
  fs::create_directory(folder.path() / "inner");
  folder.write("inner/c.pgm", "");
  for (const std::string file : {"../a.pgm", "/etc/passwd", "inner/c.pgm", "..", ".", "", "inner/../a.pgm"}) {
    expectError("file,time_ns\n" + file + ",5\n", "is not the name of a file in the folder itself");
  }
}

TEST_F(FrameList, RefusesLinksAndFolders) {
  fs::create_symlink("/etc/passwd", folder.path() / "link.pgm");
  fs::create_directory(folder.path() / "inner");
  expectError("file,time_ns\nlink.pgm,5\n", "\"link.pgm\" is a link or not a file");
  expectError("file,time_ns\ninner,5\n", "\"inner\" is a link or not a file");
}

TEST_F(FrameList, NamesTheLineOfAMissingFile) {
  expectError("file,time_ns\na.pgm,5\nc.pgm,6\n", "frames.csv:3: there is no file \"c.pgm\"");
}

TEST_F(FrameList, RefusesTimesThatDoNotRise) {
  expectError("file,time_ns\na.pgm,5\nb.png,5\n",
              "frames.csv:3: the time 5 is not after that of the frame before");
  expectError("file,time_ns\na.pgm,5\nb.png,4\n", "is not after");
}

TEST_F(FrameList, RefusesWhatIsNoTime) {
  for (const std::string time : {"", "-1", "1e9", "nan", "99999999999999999999", "1.5"}) {
    expectError("file,time_ns\na.pgm," + time + "\n", "is not a time in ns");
  }
  for (const std::string time : {"", "-1", "1e9", ".5", "1.5.5", "4294967296"}) {
    expectError("file,time_s\na.pgm," + time + "\n", "is not a time in seconds");
  }
}

TEST_F(FrameList, RefusesWrongColumns) {
  expectError("", "names no depth frame");
  expectError("file,time_ns\n", "names no depth frame");
  expectError("time_ns\n5\n", "has no column file");
  expectError("file\na.pgm\n", "has none or both of the columns time_ns and time_s");
  expectError("file,time_s,time_ns\na.pgm,5,5\n", "has none or both of the columns");
  expectError("file,time\na.pgm,5\n", "there is no column \"time\"");
  expectError("file,file,time_ns\na.pgm,a.pgm,5\n", "has the column file twice");
  expectError("file,time_ns,x_m\na.pgm,5,1\n", "has only some of the columns of a pose");
  expectError("file,time_ns\na.pgm\n", "has 1 values, but there are 2 columns");
  expectError("file,time_ns\na.pgm,5,6\n", "has 3 values, but there are 2 columns");
  expectError("file,time_ns\r\na.pgm,5\r\n", "the line ends in CRLF");
}

TEST_F(FrameList, RefusesImpossibleExposuresTicksAndPoses) {
  expectError("file,time_ns,exposure_ns\na.pgm,5,6\n", "is not a time in ns up to that of the frame");
  expectError("file,time_ns,exposure_ns\na.pgm,5,x\n", "is not a time in ns up to that of the frame");
  expectError("file,time_ns,device_ticks\na.pgm,5,4294967296\n", "is not a counter of 32 bits");
  const std::string columns = "file,time_ns,x_m,y_m,z_m,qx,qy,qz,qw\na.pgm,5,";
  expectError(columns + "0,0,0,0,0,0,2\n", "does not have the norm 1");
  expectError(columns + "0,0,nan,0,0,0,1\n", "z_m \"nan\" is not a finite number");
  expectError(columns + "0,0,,0,0,0,1\n", "z_m \"\" is not a finite number");
}

TEST_F(FrameList, NamesTheFileThatIsNotThere) {
  const auto frames = readFrameList(folder.path(), cut_off);
  ASSERT_FALSE(frames);
  EXPECT_NE(frames.error().text().find("frames.csv"), std::string::npos) << frames.error().text();
}

constexpr int kWidth = 40;  // less than a padded row
constexpr int kHeight = 24;

/// Values whose two bytes differ, over the whole range.
std::vector<std::uint16_t> someValues() {
  std::vector<std::uint16_t> values;
  for (int i = 0; i < kWidth * kHeight; ++i) values.push_back(static_cast<std::uint16_t>(i * 6151 + 3));
  return values;
}

class DepthImage : public testing::Test {
 protected:
  DepthImage() : frame(std::make_unique<rt::DepthFrame>()) {
    frame->camera.width_px = kWidth;
    frame->camera.height_px = kHeight;
    frame->camera.raw_values = 65536;
    frame->camera.raw_no_measurement = 17;
  }
  std::string errorOf(std::string_view content) {
    const auto read = readDepthImage(folder.write("image", content), *frame);
    return read ? "" : read.error().text();
  }
  void expectError(std::string_view content, std::string_view part) {
    const std::string error = errorOf(content);
    EXPECT_NE(error.find(part), std::string::npos) << part << " is not in: " << error;
  }
  void expectValues() {
    EXPECT_EQ(test::pixelsOf(*frame), someValues());
    for (int row = 0; row < kHeight; ++row) {
      const std::uint16_t* const begin = frame->raw + row * rt::strideOf(kWidth);
      EXPECT_TRUE(
          std::all_of(begin + kWidth, begin + rt::strideOf(kWidth), [](auto raw) { return raw == 17; }));
    }
  }

  const test::TemporaryFolder folder;
  std::unique_ptr<rt::DepthFrame> frame;
};

TEST_F(DepthImage, ReadsBigEndianPgmWithCommentsIntoPaddedRows) {
  ASSERT_EQ(errorOf(test::bigEndianPgm(kWidth, kHeight, someValues())), "");
  expectValues();
}

TEST_F(DepthImage, ReadsThePixelsOfAPngUnchanged) {
  ASSERT_EQ(errorOf(test::greyPng(kWidth, kHeight, someValues())), "");
  expectValues();
}

TEST_F(DepthImage, WritesWhatNetpbmDefines) {
  ASSERT_EQ(errorOf(test::greyPng(kWidth, kHeight, someValues())), "");
  ASSERT_TRUE(writeDepthImage(folder.path() / "written", *frame));
  std::string expected = test::bigEndianPgm(kWidth, kHeight, someValues());
  const std::string comment = "# made by a test\n";
  expected.erase(expected.find(comment), comment.size());
  EXPECT_EQ(test::contentOf(folder.path() / "written"), expected);
}

TEST_F(DepthImage, IsRefusedWithWhatIsWrong) {
  const std::vector<std::uint16_t> wider(std::size_t{41} * kHeight), higher(std::size_t{1280} * 801);
  const std::string other_size = "is an image of 41 x 24 pixels, the camera's frames have 40 x 24";
  const std::pair<std::string, std::string> cases[] = {
      {test::bytePng(kWidth, kHeight), "has 8 bits for each pixel"},
      {"P5 40 24 255\n" + std::string(kWidth * kHeight, 'a'), "has 8 bits for each pixel"},
      {test::bytePng(kWidth, kHeight, true), "is a PNG image in colour"},
      {test::greyPng(41, kHeight, wider), other_size},
      {test::bigEndianPgm(41, kHeight, wider), other_size},
      {"P5 1281 800 65535\n", "is an image of 1281 x 800 pixels"},
      {test::greyPng(1280, 801, higher), "frames have at most 1280 x 800 pixels"},
      {test::bigEndianPgm(kWidth, kHeight, someValues()) + "x", "goes on after the last pixel"},
      {"", "is neither a PGM (P5) nor a PNG image"},
      {"P2 40 24 65535\n1 2 3", "is neither a PGM (P5) nor a PNG image"},
      {"P5 40 24\n", "has a damaged PGM header"},
      {"P5 -40 24 65535\n", "has a damaged PGM header"},
      {"P5 40 24 65536\n", "has a damaged PGM header"},
      {"P5 99999999999 800 65535\n", "has a damaged PGM header"},
      {"P5 # a comment without an end", "has a damaged PGM header"}};
  for (const auto& [content, expected] : cases) expectError(content, expected);
}

TEST_F(DepthImage, RefusesTruncationAnywhere) {
  const std::string pgm = test::bigEndianPgm(kWidth, kHeight, someValues());
  const std::string png = test::greyPng(kWidth, kHeight, someValues());
  for (const std::string& image : {pgm, png}) {
    for (std::size_t bytes = 0; bytes < image.size(); bytes += 7) {
      EXPECT_NE(errorOf(image.substr(0, bytes)), "") << bytes << " of " << image.size();
    }
    EXPECT_NE(errorOf(image.substr(0, image.size() - 1)), "");
  }
  expectError(pgm.substr(0, pgm.size() - 1), "is truncated in row 24 of 24");
  expectError(png.substr(0, png.size() - 30), "is a damaged or truncated PNG image");
}

TEST_F(DepthImage, RefusesADamagedPng) {
  std::string png = test::greyPng(kWidth, kHeight, someValues());
  png[png.size() / 2] = static_cast<char>(png[png.size() / 2] ^ 1);
  expectError(png, "is a damaged or truncated PNG image");
}

/// The most memory that this process has had, bytes.
std::size_t peakBytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

TEST_F(DepthImage, TakesLittleMemoryForAPngFullOfCompressedTexts) {
  if (test::kMemoryOfSanitizer) GTEST_SKIP() << "the sanitizer keeps what has been freed";
  constexpr std::size_t kMiB = 1024 * 1024;
  // 300 MB in a file of 0.3 MB, and each text within libpng's own limit of 8 MB
  constexpr int kTexts = 50;
  const std::string image = test::greyPngWithTexts(kWidth, kHeight, someValues(), kTexts, 6'000'000);
  ASSERT_LT(image.size(), kMiB);
  const std::filesystem::path file = folder.write("image", image);
  pid_t child = ::fork();  // begins with a peak of its own
  if (child == 0) {
    const std::size_t before = peakBytes();
    const bool read = readDepthImage(file, *frame).has_value();
    ::_exit(!read ? 1 : peakBytes() < before + 64 * kMiB ? 0 : 2);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0) << "1: not read, 2: too much memory";
}

TEST_F(DepthImage, RefusesRawValuesThatTheCameraDoesNotHave) {
  frame->camera.raw_values = 4096;
  std::vector<std::uint16_t> values(static_cast<std::size_t>(kWidth * kHeight), 4095);
  ASSERT_EQ(errorOf(test::greyPng(kWidth, kHeight, values)), "");
  values[5] = values[500] = 4096;
  expectError(test::greyPng(kWidth, kHeight, values), "2 pixels are above 4095");
}

TEST_F(DepthImage, RefusesWhatIsNoFile) {
  EXPECT_FALSE(readDepthImage(folder.path() / "none", *frame));
  EXPECT_FALSE(readDepthImage(folder.path(), *frame));
}

}  // namespace
}  // namespace hapticd::drivers
