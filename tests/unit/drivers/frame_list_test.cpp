// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/frame_list.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
namespace {

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

}  // namespace
}  // namespace hapticd::drivers
