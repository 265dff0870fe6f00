// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/hip_csv.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace hapticd::tools {
namespace {

constexpr const char* kHeader = "t_s,x_m,y_m,z_m\n";

/// Returns the errors of reading a file with that content; empty if it is valid.
std::vector<std::string> errorsOf(const std::string& content) {
  const test::TemporaryFolder folder;
  const auto samples = readHipCsv(folder.write("hip.csv", content));
  std::vector<std::string> texts;
  if (samples) return texts;
  for (const config::Error& error : samples.error()) texts.push_back(error.text());
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

TEST(HipCsv, RefusesARowWithItsColumnItsValueAndTheRange) {
  const std::pair<const char*, const char*> kRows[] = {
      {"1,2,3", "3 columns where 4 are expected (t_s,x_m,y_m,z_m)"},
      {"1,2,3,4,", "5 columns where 4 are expected (t_s,x_m,y_m,z_m)"},
      {"1,left,3,4", "x_m: \"left\" is no number (allowed: -10..10 m)"},
      {"1,2,,4", "y_m: \"\" is no number (allowed: -10..10 m)"},
      {"1,2,3,4m", "z_m: \"4m\" is no number (allowed: -10..10 m)"},
      {"0x10,2,3,4", "t_s: \"0x10\" is no number (allowed: 0..1000000000 s)"},
      {"nan,2,3,4", "t_s: \"nan\" is out of range (allowed: 0..1000000000 s)"},
      {"1,2,3,-inf", "z_m: \"-inf\" is out of range (allowed: -10..10 m)"},
      {"-0.001,2,3,4", "t_s: \"-0.001\" is out of range (allowed: 0..1000000000 s)"},
      {"1.1e9,2,3,4", "t_s: \"1.1e9\" is out of range (allowed: 0..1000000000 s)"},
      {"1,10.0001,3,4", "x_m: \"10.0001\" is out of range (allowed: -10..10 m)"},
      {"1,2,3,-10.0001", "z_m: \"-10.0001\" is out of range (allowed: -10..10 m)"}};
  for (const auto& [row, error] : kRows) EXPECT_EQ(errorOfRow(row), error);
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
