// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/vhci_port.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace hapticd::test::usbip {
namespace {

// A status file as the kernel prints it: two ports in use, one of them with another speed.
constexpr const char* kStatus =
    "hub port sta spd dev      sockfd local_busid\n"
    "hs  0000 006 003 00010002 000003 1-1\n"
    "hs  0001 004 000 00000000 000000 0-0\n"
    "hs  0002 005 000 00000000 000000 0-0\n"
    "hs  0003 004 000 00000000 000000 0-0\n"
    "ss  0008 004 000 00000000 000000 0-0\n";

TEST(VhciPort, FindsTheFreeHighSpeedPorts) {
  EXPECT_EQ(freeHighSpeedPorts(kStatus), (std::vector<unsigned>{1, 3}));
  EXPECT_EQ(freeHighSpeedPorts(""), std::vector<unsigned>{});
}

TEST(VhciPort, HandsTheSocketToTheFirstFreePort) {
  const TemporaryFolder vhci;
  vhci.write("status", kStatus);
  vhci.write("attach", "");
  const auto port = attachToVhci(vhci.path(), 7);
  ASSERT_TRUE(port) << port.error().text();
  EXPECT_EQ(*port, 1U);
  std::ifstream attach(vhci.path() / "attach");
  unsigned given_port = 0, socket = 0, device = 0, speed = 0;
  ASSERT_TRUE(attach >> given_port >> socket >> device >> speed);
  EXPECT_EQ(given_port, 1U);
  EXPECT_EQ(socket, 7U);
  EXPECT_NE(device, 0U);
  EXPECT_EQ(speed, 3U) << "high speed";
}

TEST(VhciPort, SaysWhichModuleIsMissing) {
  const auto port = attachToVhci("/nowhere/vhci_hcd.0", 7);
  ASSERT_FALSE(port);
  EXPECT_NE(port.error().text().find("modprobe vhci_hcd"), std::string::npos) << port.error().text();
}

TEST(VhciPort, SaysThatNoPortIsFree) {
  const TemporaryFolder vhci;
  vhci.write("status",
             "hub port sta spd dev      sockfd local_busid\nhs  0000 006 003 00010002 000003 1-1\n");
  vhci.write("attach", "");
  const auto port = attachToVhci(vhci.path(), 7);
  ASSERT_FALSE(port);
  EXPECT_NE(port.error().text().find("no high-speed port is free"), std::string::npos) << port.error().text();
}

}  // namespace
}  // namespace hapticd::test::usbip
