// SPDX-License-Identifier: Apache-2.0
// haptic-replay on wrong input: the exit status listed in its --help, a message with the problem and its
// place, and no output file.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/file_content.h"
#include "tests/support/recordings/made_up_scene.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd {
namespace {

using test::contains;
using test::exitedWith;
using test::Finished;

constexpr int kUsage = 64, kBadData = 65, kNoInput = 66, kCannotCreate = 73, kBadConfiguration = 78;

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

class ReplayBadInput : public testing::Test {
 protected:
  ReplayBadInput() { writeGoodInput(); }

  void writeGoodInput() const {
    folder_.write("config.yaml", "loop: {rate_hz: 1000}\n");
    folder_.write("hip.csv", "t_s,x_m,y_m,z_m\n0,0,0,-0.98\n0.001,0,0,-0.98\n");
    folder_.write("wall.pgm", test::pgmBytes(test::wallImage(760)));
  }

  std::string path(const std::string& name) const { return folder_.path() / name; }
  void write(const std::string& name, const std::string& content) const { folder_.write(name, content); }

  /// Runs haptic-replay with good input except for what the test has changed. An option that is given again
  /// here replaces the good one.
  Finished replay(const std::vector<std::string>& changed = {}, const test::ProgramOptions& options = {}) {
    std::vector<std::string> arguments{"--config=" + path("config.yaml"), "--hip=" + path("hip.csv"),
                                       "--depth=" + path("wall.pgm"), "--out=" + path("out.csv")};
    for (const std::string& change : changed) {
      const std::string option = change.substr(0, change.find('='));
      std::erase_if(arguments, [&](const std::string& good) { return good.starts_with(option + '='); });
      arguments.push_back(change);
    }
    return test::runToEnd(test::hapticReplayCommand(arguments), options);
  }

  void expectRefused(const Finished& finished, int status, const std::string& message) const {
    EXPECT_EQ(finished.ending, exitedWith(status)) << finished.errors;
    EXPECT_TRUE(contains(finished.errors, message));
    EXPECT_FALSE(std::filesystem::exists(path("out.csv")));
  }

  test::TemporaryFolder folder_;
};

TEST_F(ReplayBadInput, TheInputOfTheseTestsIsGoodUntilTheyBreakIt) {
  const Finished finished = replay();
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(std::filesystem::exists(path("out.csv")));
}

/// A file of another content, options that replace the good ones and the refusal.
struct Refused {
  std::string file;
  std::string content;
  std::vector<std::string> options;
  int status;
  std::string says;
};

TEST_F(ReplayBadInput, IsRefusedWithItsPlaceAndWhatIsExpected) {
  const std::string wall = test::pgmBytes(test::wallImage(760));
  std::string big_endian = wall;
  for (std::size_t i = test::kPgmHeader.size(); i + 1 < big_endian.size(); i += 2)
    std::swap(big_endian[i], big_endian[i + 1]);
  std::vector<Refused> cases{
      {"hip.csv",
       "t_s,x_m,y_m,z_m\n0.5,0,0,-1\n0.4,0,0,-1\n",
       {"--stage=command"},
       kBadData,
       "t_s 0.4 is before that of the sample before, 0.5"},
      {"wall.pgm", wall.substr(0, 300000), {}, kBadData, "wall.pgm: has 300000 bytes, expected 614417"},
      {"wall.pgm", big_endian, {}, kBadData, "the pixels are big-endian"},
      {"config.yaml", "force:\n  radius_m: 4\n", {}, kBadConfiguration, "config.yaml:2"},
      {"config.yaml", "force:\n  radius_m: 4\n", {}, kBadConfiguration, "0.005..0.1 m"},
      {"config.yaml",
       "camera: {far_m: 10, fx_px: 100, fy_px: 100}\n",
       {"--full-model"},
       kBadConfiguration,
       "--full-model: the camera's whole view up to camera.far_m, 10 m, takes more memory"},
      // 2047 units of 1 mm are less than 4 m - 0.4 m
      {"config.yaml",
       "camera: {driver: synthetic}\nsynthetic: {camera: time_of_flight}\n",
       {"--full-model"},
       kBadConfiguration,
       "a scene of the whole frame holds 2.047 m of depth in units of 1000 um"},
      {"", "", {"--set=force.radius=0.04"}, kBadConfiguration, "force.radius_m"},
      {"", "", {"--hip=" + path("none.csv")}, kBadData, "none.csv: cannot be read"},
      {"", "", {"--depth=" + path("none")}, kNoInput, "none: no such file or folder"},
      {"", "", {"--depth=" + path("")}, kNoInput, "INDEX.txt"},
      {"", "", {"--out=" + path("none/out.csv")}, kCannotCreate, "none/out.csv: cannot be created"},
      {"", "", {"--stage=device"}, kUsage, "--stage"}};
  for (const std::string header :
       {"P5\n640 480\n65535\n", "P5 640 480 2047\n", "P5 320 240 65535\n", "P2 640 480 65535\n"}) {
    cases.push_back(
        {"wall.pgm", test::pgmBytes(test::wallImage(760), header), {}, kBadData, "P5 640 480 65535"});
  }
  for (const auto& [file, content, options, status, says] : cases) {
    if (!file.empty()) write(file, content);
    expectRefused(replay(options), status, says);
    writeGoodInput();
  }
}

TEST_F(ReplayBadInput, AHipThatIsNotANumberIsRefusedWithItsLineAndRange) {
  write("hip.csv", "t_s,x_m,y_m,z_m\n0,0,0,-1\n0.001,nan,0,-1\n0.002,0,0,11\n");
  const Finished finished = replay();
  expectRefused(finished, kBadData, "hip.csv:3: x_m: \"nan\" is out of range (allowed: -10..10 m)");
  EXPECT_TRUE(contains(finished.errors, "hip.csv:4: z_m: \"11\" is out of range (allowed: -10..10 m)"));
}

TEST_F(ReplayBadInput, ARecordingWithCrLfInItsIndexIsRefusedWithTheRemedy) {
  test::ScratchRecording recording;
  recording.add(1, "1500000000.1", 1);
  recording.writeIndex("\r\n");
  const Finished finished = replay({"--depth=" + recording.path().string()});
  expectRefused(finished, kNoInput, "INDEX.txt:1: the line ends in CRLF");
  EXPECT_TRUE(contains(finished.errors, "sed -i"));
}

/// As with the camera driver `recorded`.
TEST_F(ReplayBadInput, DamagedFramesOfARecordingAreSkippedCountedAndNamed) {
  const std::string good = test::pgmBytes(test::wallImage(760));
  for (const bool first_is_damaged : {false, true}) {
    test::ScratchRecording recording;
    recording.addBytes(first_is_damaged ? good.substr(0, 17) : good, "1500000000.1000", 1);
    recording.addBytes(first_is_damaged ? good : good.substr(0, 100), "1500000000.1005", 2);
    recording.addBytes(good, "1500000000.1010", 3);
    recording.writeIndex();
    std::ofstream(recording.path() / "INDEX.txt", std::ios::app) << "d-15000";
    write("hip.csv", "t_s,x_m,y_m,z_m\n0,0,0,-0.98\n0.0005,0,0,-0.98\n0.001,0,0,-0.98\n");
    const Finished finished = replay({"--depth=" + recording.path().string(), "--force"});
    EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
    EXPECT_TRUE(contains(finished.errors, "1 of 3 frames cannot be read and were skipped"));
    EXPECT_TRUE(contains(finished.errors, first_is_damaged ? "d-1500000000.1000-1.pgm: has 17 bytes"
                                                           : "d-1500000000.1005-2.pgm: has 100 bytes"));
    EXPECT_TRUE(contains(finished.errors, "the last line of the index was left out: "));
    std::vector<std::string> frames;
    for (const std::string& line : linesOf(test::contentOf(path("out.csv"))))
      frames.push_back(line.substr(line.rfind(',') + 1));
    EXPECT_EQ(frames, (std::vector<std::string>{"frame", first_is_damaged ? "1" : "0",
                                                first_is_damaged ? "1" : "0", "2"}));
  }
}

TEST_F(ReplayBadInput, ARecordingWithoutAReadableFrameIsRefused) {
  test::ScratchRecording recording;
  recording.addBytes("P5", "1500000000.1000", 1);
  recording.addBytes("P5", "1500000000.1005", 2);
  recording.writeIndex();
  expectRefused(replay({"--depth=" + recording.path().string()}), kBadData,
                "none of the 2 frames can be read");
}

TEST_F(ReplayBadInput, DepthWithoutAUsablePixelIsSaid) {
  write("wall.pgm", test::pgmBytes(test::wallImage(2047)));
  const Finished nothing = replay();
  EXPECT_EQ(nothing.ending, exitedWith(0)) << nothing.errors;
  EXPECT_TRUE(contains(nothing.errors, "warning: "));
  EXPECT_TRUE(contains(nothing.errors, "nothing was measured in the frame, so that no force comes"));
  write("wall.pgm", test::pgmBytes(test::wallImage(10)));
  EXPECT_TRUE(contains(replay({"--force"}).errors,
                       "no pixel of the frame lies between camera.near_m and camera.far_m"));
  write("wall.pgm", test::pgmBytes(test::wallImage(760)));
  std::string into_contact = "t_s,x_m,y_m,z_m\n";
  for (int i = 0; i < 40; ++i) into_contact += fmt::format("{},0,0,{}\n", 0.001 * i, -0.99 - 0.0005 * i);
  write("hip.csv", into_contact);
  EXPECT_EQ(replay({"--force"}).errors, "");
}

TEST_F(ReplayBadInput, AFullDiskLeavesNoTruncatedOutput) {
  std::string hip = "t_s,x_m,y_m,z_m\n";
  for (int i = 0; i < 1000; ++i) hip += "0,0,0,-0.98\n";
  write("hip.csv", hip);
  expectRefused(replay({}, {.largest_file_bytes = 4096}), kCannotCreate, "out.csv: cannot be written");
}

TEST_F(ReplayBadInput, AMissingOptionIsAUsageError) {
  const Finished finished = test::runToEnd(test::hapticReplayCommand({"--config=" + path("config.yaml")}));
  expectRefused(finished, kUsage, "--depth");
}

TEST_F(ReplayBadInput, AFolderWithoutTracesIsRefused) {
  const auto replayFolder = [this](const std::string& folder) {
    return test::runToEnd(test::hapticReplayCommand({"--traces", path(folder)}));
  };
  std::filesystem::create_directory(path("empty"));
  expectRefused(replayFolder("empty"), kNoInput, "empty: holds no finished trace (*.mcap)");
  expectRefused(replayFolder("nowhere"), kNoInput, "nowhere: cannot be read: No such file or directory");
}

TEST_F(ReplayBadInput, PartsAreOfAFolderOfTracesOnly) {
  const auto refused = [this](const std::vector<std::string>& arguments, const std::string& message) {
    expectRefused(test::runToEnd(test::hapticReplayCommand(arguments)), kUsage, message);
  };
  refused({"--part=1/2", "--json=" + path("part.json")}, "--part requires --traces");
  refused({"--traces=" + path(""), "--part=1/2"}, "--part requires --json");
  refused({"--traces=" + path(""), "--part=3/2", "--json=" + path("part.json")}, "K in 1..N");
  refused({"--join=part.json", "--traces=" + path("")}, "--join excludes --traces");
  refused({"--trace=a.mcap", "--json=" + path("all.json")}, "--json: is only for --traces and --join");
}

TEST_F(ReplayBadInput, APartThatIsNoneIsRefusedWithItsName) {
  write("part.json", "{}");
  const Finished joined = test::runToEnd(test::hapticReplayCommand({"--join", path("part.json")}));
  expectRefused(joined, kBadData, "part.json: is not a part of haptic-replay");
}

TEST_F(ReplayBadInput, AnOldOutputStaysAsItWasWhenTheReplayFails) {
  write("out.csv", "old");
  write("wall.pgm", "nothing");
  EXPECT_EQ(replay({"--force"}).ending, exitedWith(kBadData));
  EXPECT_EQ(std::filesystem::file_size(path("out.csv")), 3U);
}

TEST_F(ReplayBadInput, AnOldOutputIsReplacedOnRequestOnly) {
  write("out.csv", "old");
  const Finished refused = replay();
  EXPECT_EQ(refused.ending, exitedWith(kCannotCreate));
  EXPECT_TRUE(
      contains(refused.errors, "out.csv: exists already (give another name, or --force to replace it)"));
  EXPECT_EQ(test::contentOf(path("out.csv")), "old");
  EXPECT_EQ(replay({"--force"}).ending, exitedWith(0));
  EXPECT_NE(test::contentOf(path("out.csv")), "old");
}

TEST_F(ReplayBadInput, PositionsThatTouchNothingAreNamed) {
  write("hip.csv", "t_s,x_m,y_m,z_m\n0,0,0,-0.5\n");
  const Finished finished = replay();
  EXPECT_EQ(finished.ending, exitedWith(0));
  EXPECT_TRUE(contains(finished.errors, "hip.csv: no position touches the scene, all forces are zero"));
  EXPECT_TRUE(contains(finished.output, "1 force, 1 scene modelled"));
  write("hip.csv", "t_s,x_m,y_m,z_m\n");
  const Finished without = replay({"--force"});
  EXPECT_EQ(without.ending, exitedWith(0));
  EXPECT_FALSE(contains(without.errors, "no position touches")) << "there is none";
}

}  // namespace
}  // namespace hapticd
