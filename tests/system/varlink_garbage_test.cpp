// SPDX-License-Identifier: Apache-2.0
// Whatever arrives at its sockets, the running daemon continues to tick and replies to the next client.

#include <gtest/gtest.h>

#include <random>

#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/test_sockets.h"

namespace hapticd {
namespace {

using test::Client;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;

constexpr std::string_view kGetStatus{"{\"method\":\"io.hapticd.Status.GetStatus\"}\0", 41};
static_assert(kGetStatus.back() == '\0');

constexpr const char* kMalformed = "io.hapticd.Status.MalformedCall";

class VarlinkGarbage : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(daemon_.answers()); }
  void TearDown() override {
    EXPECT_TRUE(daemon_.ticks());
    EXPECT_EQ(daemon_.terminate(), exitedWith(0)) << daemon_.errors();
  }

  std::vector<std::string> sockets() const { return {home_.statusSocket(), home_.controlSocket()}; }

  const DaemonHome home_;
  Daemon daemon_{home_, test::kWallYaml, {"control.engage_at_start=true"}};
};

TEST_F(VarlinkGarbage, RandomBytesEndTheirConnectionOnly) {
  std::mt19937 random(1);
  for (const std::string& socket : sockets()) {
    for (int round = 0; round < 20; ++round) {
      std::string bytes(1 + random() % 5000, '\0');
      for (char& byte : bytes) byte = static_cast<char>(random());
      bytes.push_back('\0');
      Client client(socket);
      client.send(bytes);
      EXPECT_TRUE(test::contains(client.reply(), kMalformed));
      EXPECT_EQ(client.reply(), "");  // closed
    }
  }
}

TEST_F(VarlinkGarbage, APartOfAMessageAndThenNothingIsForgotten) {
  for (const std::string& socket : sockets()) {
    for (std::size_t length = 0; length < kGetStatus.size(); ++length)
      Client(socket).send(kGetStatus.substr(0, length));
  }
}

TEST_F(VarlinkGarbage, AMebibyteWithoutAnEndIsRefused) {
  for (const std::string& socket : sockets()) {
    Client client(socket);
    client.send(std::string(std::size_t{1} << 20, 'x'));
    EXPECT_TRUE(test::contains(client.reply(), kMalformed));
    EXPECT_EQ(client.reply(), "");  // closed
  }
}

TEST_F(VarlinkGarbage, DeeplyNestedJsonIsRefused) {
  for (const std::string& socket : sockets()) {
    Client client(socket);
    client.send("{\"method\":\"io.hapticd.Status.GetStatus\",\"parameters\":" + std::string(60'000, '[') +
                '\0');
    EXPECT_TRUE(test::contains(client.reply(), kMalformed));
    EXPECT_EQ(client.reply(), "");  // closed
  }
}

TEST_F(VarlinkGarbage, UnknownMethodsAreAnsweredByName) {
  for (const std::string& socket : sockets()) {
    Client client(socket);
    client.send(std::string("{\"method\":\"io.hapticd.Status.Explode\"}") + '\0');
    EXPECT_TRUE(test::contains(client.reply(), "org.varlink.service.MethodNotFound"));
    client.send(kGetStatus);  // on the same connection
    EXPECT_TRUE(test::contains(client.reply(), "\"status\""));
  }
}

TEST_F(VarlinkGarbage, TheReadOnlySocketChangesNothing) {
  Client client(home_.statusSocket());
  client.send(std::string("{\"method\":\"io.hapticd.Control.Disengage\"}") + '\0');
  EXPECT_TRUE(test::contains(client.reply(), "org.varlink.service.PermissionDenied"));
  EXPECT_TRUE(daemon_.reaches([](const nlohmann::json& status) { return status.at("mode") == "engaged"; }));
}

TEST_F(VarlinkGarbage, AClientFromBeforeIsServedBesideFortyConnections) {
  Client before(home_.controlSocket());
  before.send(kGetStatus);
  ASSERT_TRUE(test::contains(before.reply(), "\"status\""));
  {
    std::vector<Client> crowd;
    crowd.reserve(40);
    for (int i = 0; i < 40; ++i)
      crowd.emplace_back(i % 2 == 0 ? home_.statusSocket() : home_.controlSocket());
    for (Client& client : crowd) client.send("{\"method\":");
    before.send(kGetStatus);
    EXPECT_TRUE(test::contains(before.reply(), "\"status\""));
  }
  // And a new one when they have gone.
  EXPECT_TRUE(test::becomesTrue([this] { return home_.control({"status"}).ending == exitedWith(0); }));
}

TEST_F(VarlinkGarbage, AClientThatAsksAndNeverReadsHoldsNobodyUp) {
  Client silent(home_.controlSocket());
  for (int i = 0; i < 200; ++i) silent.send(kGetStatus);
  EXPECT_TRUE(daemon_.ticks());
}

}  // namespace
}  // namespace hapticd
