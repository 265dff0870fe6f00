// SPDX-License-Identifier: Apache-2.0
// The program that emulates a device to try haptic-bridge by hand.
#include <gtest/gtest.h>

#include <csignal>

#include "tests/support/program.h"
#include "tests/vendor_devices/peer.h"

namespace hapticd::test {
namespace {

class EmulatedHandle : public ::testing::TestWithParam<const char*> {};

TEST_P(EmulatedHandle, PrintsTheCommandThatDrivesItsDevice) {
  Program device({EMULATED_HANDLE_PROGRAM, GetParam()});
  std::string command;
  ASSERT_TRUE(becomesTrue([&] {
    command = device.output();
    return command.find('\n') != std::string::npos;
  })) << device.errors();
  command.resize(command.find('\n'));
  Peer peer;
  Program bridge({"/bin/sh", "-c", command + " --peer " + peer.address()});
  EXPECT_TRUE(becomesTrue([&] { return peer.states() > 0 && !peer.state().fault; })) << bridge.errors();
  EXPECT_FALSE(peer.state().calibrated) << "it waits for the word 'dock'";
  device.signal(SIGTERM);
  EXPECT_EQ(device.wait(), exitedWith(0));
}

INSTANTIATE_TEST_SUITE_P(All, EmulatedHandle,
                         ::testing::Values("force-dimension", "openhaptics", "inverse3"));

TEST(EmulatedHandle, ListsItsWordsWhereItIsNotUnderstood) {
  Program program({EMULATED_HANDLE_PROGRAM, "omega"});
  EXPECT_EQ(program.wait(), exitedWith(64));
  EXPECT_NE(program.errors().find("force-dimension|openhaptics|inverse3"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::test
