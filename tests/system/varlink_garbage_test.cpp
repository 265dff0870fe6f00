// SPDX-License-Identifier: Apache-2.0
// Whatever arrives at its sockets, the running daemon continues to tick and replies to the next client.

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <random>

#include "config/descriptor.h"
#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using test::Daemon;
using test::DaemonHome;
using test::exitedWith;

/// A client that sends and receives bytes, without knowledge of the protocol.
class Client {
 public:
  explicit Client(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }

  /// Sends all bytes, unless the daemon closes the connection.
  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t count = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count <= 0) return;
      bytes.remove_prefix(static_cast<std::size_t>(count));
    }
  }

  /// Returns what arrives until a NUL, the end of the connection, or a time limit that only a failure
  /// reaches.
  std::string reply() {
    std::string text;
    pollfd descriptor{socket_.get(), POLLIN, 0};
    while (text.find('\0') == std::string::npos && ::poll(&descriptor, 1, 60'000) > 0) {
      char chunk[4096];
      const ssize_t count = ::recv(socket_.get(), chunk, sizeof chunk, 0);
      if (count <= 0) break;
      text.append(chunk, static_cast<std::size_t>(count));
    }
    return text;
  }

 private:
  config::Descriptor socket_;
};

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
