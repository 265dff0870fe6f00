// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/support/program.h"
#include "tests/support/scratch_recording.h"

namespace hapticd::test {
namespace {

Finished runEmulator(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), HAPTICD_EMULATED_KINECT);
  return runToEnd(arguments);
}

void expectRefusal(const std::vector<std::string>& arguments, int status, const std::string& complaint) {
  const Finished finished = runEmulator(arguments);
  EXPECT_EQ(finished.ending, exitedWith(status)) << complaint;
  EXPECT_NE(finished.errors.find(complaint), std::string::npos) << finished.errors;
}

TEST(EmulatedKinectProgram, RefusesFoolishOptions) {
  expectRefusal({}, 64, "--recording: is missing");
  expectRefusal({"--recording", "/x", "--fps", "40"}, 64, "--fps: \"40\" is not among the numbers 1..33");
  expectRefusal({"--recording", "/x", "--frames", "0"}, 64,
                "--frames: \"0\" is not among the whole numbers 1..2000");
  expectRefusal({"--recording", "/x", "--serial", "a b"}, 64, "\"a b\" is not 1 to 32 letters and digits");
  expectRefusal({"--tell", "status"}, 64, "needs --control PATH");
}

TEST(EmulatedKinectProgram, NamesARecordingThatIsNotThere) {
  expectRefusal({"--recording", "/nowhere"}, 66, "/nowhere");
}

TEST(EmulatedKinectProgram, NamesTheFramesThatCanBeFrozen) {
  ScratchRecording recording;
  fillRecording(recording, 2);
  expectRefusal({"--recording", recording.path(), "--freeze", "2"}, 64,
                "there is no frame 2, there are 0 to 1");
}

TEST(EmulatedKinectProgram, SaysWhatToDoWithoutAHostController) {
  ScratchRecording recording;
  fillRecording(recording, 1);
  expectRefusal({"--recording", recording.path(), "--vhci", "/nowhere"}, 69, "modprobe vhci_hcd");
}

TEST(EmulatedKinectProgram, SaysThatNoEmulatorListens) {
  expectRefusal({"--control", "/nowhere/control", "--tell", "status"}, 69, "/nowhere/control");
}

/// The emulator as a process, with a simulated host controller made of files.
class EmulatedKinectProcess : public testing::Test {
 protected:
  EmulatedKinectProcess() {
    fillRecording(recording_, 1);
    folder_.write("status", "hub port sta spd dev      sockfd local_busid\nhs  0000 004 000 0 0 0-0\n");
    folder_.write("attach", "");
    folder_.write("detach", "");
  }
  std::string control() const { return folder_.path() / "control"; }

  TemporaryFolder folder_;
  ScratchRecording recording_;
};

TEST_F(EmulatedKinectProcess, TakesCommandsFromTheShellAndEndsAtSigterm) {
  Program emulator({HAPTICD_EMULATED_KINECT, "--recording", recording_.path(), "--vhci", folder_.path(),
                    "--control", control(), "--serial", "K7"});
  ASSERT_TRUE(becomesTrue([&] { return emulator.errors().find("attached to port 0") != std::string::npos; }))
      << emulator.errors();
  const Finished good = runEmulator({"--control", control(), "--tell", "lose 3"});
  EXPECT_EQ(good.ending, exitedWith(0)) << good.errors;
  EXPECT_EQ(good.output, "ok\n");
  EXPECT_EQ(runEmulator({"--control", control(), "--tell", "fly"}).ending, exitedWith(65));
  emulator.signal(SIGTERM);
  EXPECT_EQ(emulator.wait(), exitedWith(0));
  EXPECT_NE(emulator.errors().find(
                "emulated-kinect K7: unplugged from port 0: 0 URBs, 0 unlinked in time, 0 too late"),
            std::string::npos)
      << emulator.errors();
  EXPECT_FALSE(std::filesystem::exists(control()));
}

}  // namespace
}  // namespace hapticd::test
