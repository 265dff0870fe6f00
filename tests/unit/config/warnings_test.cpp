// SPDX-License-Identifier: Apache-2.0
#include "config/warnings.h"

#include <gtest/gtest.h>

namespace hapticd::config {
namespace {

Settings udpSettings(const char* address, const char* peer, const char* key_file = "") {
  Settings settings;
  settings.handle.driver = HandleDriver::udp;
  settings.handle.udp.address = address;
  settings.handle.udp.peer = peer;
  settings.handle.udp.key_file = key_file;
  return settings;
}

TEST(Warnings, AreEmptyForTheDefaults) {
  EXPECT_TRUE(warningsOf(Settings{}).empty());
}

TEST(Warnings, NameAHandleOnTheNetworkWithoutAKey) {
  for (const auto& settings :
       {udpSettings("0.0.0.0", "192.0.2.10"), udpSettings("192.0.2.1", "192.0.2.10:47801"),
        udpSettings("0.0.0.0", "127.0.0.1")}) {
    const std::vector<Error> warnings = warningsOf(settings);
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].where, "udp_handle.key_file");
    EXPECT_NE(warnings[0].text().find(settings.handle.udp.peer), std::string::npos);
  }
}

TEST(Warnings, AreEmptyForAHandleWithAKeyOnThisComputerOrNotInUse) {
  EXPECT_TRUE(warningsOf(udpSettings("0.0.0.0", "192.0.2.10", "/etc/hapticd/key")).empty());
  EXPECT_TRUE(warningsOf(udpSettings("127.0.0.1", "127.0.0.2:47801")).empty());
  Settings unused = udpSettings("0.0.0.0", "192.0.2.10");
  unused.handle.driver = HandleDriver::simulated;
  EXPECT_TRUE(warningsOf(unused).empty());
}

}  // namespace
}  // namespace hapticd::config
