// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

Finished runCamera(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), HAPTICD_EMULATED_DEPTH_CAMERA);
  return runToEnd(arguments);
}

void expectRefusal(const std::vector<std::string>& arguments, int status, const std::string& complaint) {
  const Finished finished = runCamera(arguments);
  EXPECT_EQ(finished.ending, exitedWith(status)) << complaint;
  EXPECT_NE(finished.errors.find(complaint), std::string::npos) << finished.errors;
}

TEST(EmulatedDepthCameraProgram, RefusesFoolishOptions) {
  expectRefusal({"--model", "d999"}, 64, "d999");
  expectRefusal({"--serial", "a b"}, 64, "\"a b\" is not 1 to 32");
  expectRefusal({"--product", "0x12"}, 64, "0x12");
  expectRefusal({"--most-frames", "0"}, 64, "among the whole numbers 1..2000");
  expectRefusal({"--tell", "status"}, 64, "needs --control PATH");
  expectRefusal({"--vhci", "/nowhere"}, 69, "modprobe vhci_hcd");
}

TEST(EmulatedDepthCameraProgram, RefusesFoldersWithoutImagesOf16Bits) {
  TemporaryFolder folder;
  expectRefusal({"--frames", "/nowhere"}, 66, "/nowhere");
  expectRefusal({"--frames", folder.path()}, 66, "has no *.pgm");
  folder.write("a.pgm", "P5 2 2 255\n1234");
  expectRefusal({"--frames", folder.path()}, 66, "not a PGM image of 16 bits");
  folder.write("a.pgm", "P5 2 2 65535\n1234567");
  expectRefusal({"--frames", folder.path()}, 66, "truncated");
  folder.write("a.pgm", "P5 2 2 65535\n12345678");
  folder.write("b.pgm", "P5 1 2 65535\n1234");
  expectRefusal({"--frames", folder.path()}, 66, "another size");
}

TEST(EmulatedDepthCameraProgram, TakesCommandsFromTheShellAndEndsAtSigterm) {
  TemporaryFolder folder;
  folder.write("status", "hub port sta spd dev      sockfd local_busid\nhs  0000 004 000 0 0 0-0\n");
  folder.write("attach", "");
  folder.write("detach", "");
  const std::string control = folder.path() / "control";
  Program camera(
      {HAPTICD_EMULATED_DEPTH_CAMERA, "--vhci", folder.path(), "--control", control, "--serial", "K7"});
  ASSERT_TRUE(becomesTrue([&] { return camera.errors().find("attached to port 0") != std::string::npos; }))
      << camera.errors();
  EXPECT_EQ(runCamera({"--control", control, "--tell", "fault disparity"}).output, "ok\n");
  const Finished refused = runCamera({"--control", control, "--tell", "fault hunger"});
  EXPECT_EQ(refused.ending, exitedWith(65));
  EXPECT_NE(refused.output.find("table-checksum"), std::string::npos)
      << "names the faults: " << refused.output;
  camera.signal(SIGTERM);
  EXPECT_EQ(camera.wait(), exitedWith(0));
}

TEST(CaptureDepthProgram, RefusesNodesThatAreNone) {
  const Finished finished = runToEnd({HAPTICD_CAPTURE_DEPTH, "--device", "/dev/null"});
  EXPECT_EQ(finished.ending, exitedWith(69));
  EXPECT_NE(finished.errors.find("VIDIOC_S_FMT"), std::string::npos) << finished.errors;
}

}  // namespace
}  // namespace hapticd::test
