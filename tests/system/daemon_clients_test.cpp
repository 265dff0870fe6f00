// SPDX-License-Identifier: Apache-2.0
// Whatever arrives at its sockets, the running daemon continues to tick and replies to the next client; every
// surface shows the same list of what is wrong.

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

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

// Every surface shows the same list of what is wrong.

using test::contains;

/// Numbers change from one call to the next.
std::string withoutNumbers(std::string text) {
  std::erase_if(text, [](unsigned char c) { return std::isdigit(c) != 0; });
  return text;
}

class OneList : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(daemon.answers()); }

  std::vector<std::string> inJson() {
    std::vector<std::string> texts;
    const nlohmann::json status = daemon.status();
    for (const auto& text : status.at("warnings")) texts.push_back(withoutNumbers(text));
    return texts;
  }
  /// The lines of the status that begin with "! ".
  std::vector<std::string> inText() {
    std::istringstream lines(home.control({"status", "--all"}).output);
    std::vector<std::string> texts;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("! ")) texts.push_back(withoutNumbers(line.substr(2)));
    }
    return texts;
  }
  std::string inMetrics() {
    const std::string metrics = home.control({"metrics"}).output;
    const std::string name = "\nhapticd_warnings ";
    const std::size_t at = metrics.find(name);
    return at == std::string::npos
               ? "none"
               : metrics.substr(at + name.size(), metrics.find('\n', at + 1) - at - name.size());
  }
  bool isSameEverywhere() {
    return test::becomesTrue([this] {
      const auto list = inJson();
      return inText() == list && inMetrics() == std::to_string(list.size()) && inJson() == list;
    });
  }
  bool warns(const std::string& text) {
    return test::becomesTrue([&] {
      const auto list = inJson();
      return std::ranges::any_of(
          list, [&](const std::string& line) { return line.find(text) != std::string::npos; });
    });
  }

  const DaemonHome home;
  Daemon daemon{home, std::string(test::kWallYaml) + "trace: {min_free_mb: 1000000, at_start: true}\n"};
};

TEST_F(OneList, HasWhatTheDaemonKnowsOfTracesAndPrivileges) {
  EXPECT_TRUE(warns("trace waits: "));
  EXPECT_TRUE(isSameEverywhere());
}

TEST_F(OneList, HasAForceLoopThatWasLate) {
  daemon.signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // 200 periods without a tick
  daemon.signal(SIGCONT);
  EXPECT_TRUE(warns("the force loop is late: "));
  EXPECT_TRUE(isSameEverywhere());
  EXPECT_TRUE(test::becomesTrue([this] {
    return home.control({"events", "--kind", "warning"}).output.find("the force loop is late: ") !=
           std::string::npos;
  }));
}

}  // namespace
}  // namespace hapticd
