// SPDX-License-Identifier: Apache-2.0
// hapticd-view as a program: how it starts, ends and is called.
#include <gtest/gtest.h>
#include <sysexits.h>

#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/view_bridge/bridge_under_test.h"

namespace hapticd::test {
namespace {

Finished run(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), HAPTICD_VIEW_PROGRAM);
  return runToEnd(arguments);
}

TEST(ViewProgram, EndsAtSigtermAndTellsItsClients) {
  const DaemonHome home;
  BridgeUnderTest bridge(home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  ASSERT_TRUE(peer.nextOf("hello").is_object());
  bridge.program().signal(SIGTERM);
  std::optional<WebSocketMessage> message;
  do {
    message = peer.next();
  } while (message && message->opcode != 8);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->payload.substr(0, 2), "\x03\xe9");  // 1001, going away
  EXPECT_EQ(bridge.program().wait(), exitedWith(0));
}

TEST(ViewProgram, EndsAtSigtermWithConnectionsInEveryState) {
  const DaemonHome home;
  BridgeUnderTest bridge(home);
  RawClient silent(bridge.port());
  RawClient begun(bridge.port());
  begun.send("GET / HT");
  WebSocketPeer open(bridge.port(), bridge.liveTarget());
  WebSocketPeer refused(bridge.port(), "/live");
  bridge.program().signal(SIGTERM);
  EXPECT_EQ(bridge.program().wait(), exitedWith(0));
}

TEST(ViewProgram, EndsWhenNobodyLooksForAsLongAsItIsTold) {
  const DaemonHome home;
  BridgeUnderTest bridge(home, {"--idle-exit", "1"});
  EXPECT_EQ(bridge.program().wait(), exitedWith(0));
}

TEST(ViewProgram, StaysWhileSomebodyLooks) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  BridgeUnderTest bridge(home, {"--idle-exit", "1"});
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  const auto tickNumber = [&peer] { return peer.nextOf("window").value("number", 0); };
  const int first = tickNumber();
  ASSERT_GT(first, 0);
  while (tickNumber() < first + 3000) ASSERT_TRUE(bridge.program().running());  // 3 s
}

TEST(ViewProgram, ExplainsWhatItCannotUse) {
  const TemporaryFolder folder;
  const std::string token = folder.path() / "token";
  const Finished no_page = run({"--token-file", token, "--page", folder.path() / "none"});
  EXPECT_EQ(no_page.ending, exitedWith(EX_NOINPUT));
  EXPECT_TRUE(contains(no_page.errors, "--page"));
  const Finished no_token = run({"--token-file", folder.path() / "none/token"});
  EXPECT_EQ(no_token.ending, exitedWith(EX_CANTCREAT));
  EXPECT_TRUE(contains(no_token.errors, "--token-file"));
  folder.write("index.html", "");
  for (const char* address : {"8765", "localhost:1", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "::1:1",
                              "127.0.0.1:65536", "[127.0.0.1]:1", "192.0.2.77:1"}) {
    const Finished finished = run({"--token-file", token, "--page", folder.path(), "--listen", address});
    EXPECT_EQ(finished.ending, exitedWith(EX_UNAVAILABLE)) << address << finished.errors;
    EXPECT_TRUE(contains(finished.errors, "--listen")) << address;
  }
  EXPECT_EQ(run({"--no-such-option"}).ending, exitedWith(EX_USAGE));
  EXPECT_EQ(run({"--no-token", "--token-file", token}).ending, exitedWith(EX_USAGE));
}

TEST(ViewProgram, MakesATokenAloneWhereAsked) {
  const TemporaryFolder folder;
  const std::string token = folder.path() / "token";
  EXPECT_EQ(run({"--make-token", "--token-file", token}).ending, exitedWith(0));
  EXPECT_TRUE(std::filesystem::exists(token));
}

TEST(ViewProgram, WarnsWhereTheNetworkReachesIt) {
  const TemporaryFolder folder;
  folder.write("index.html", "");
  const std::string token = folder.path() / "token";
  Program program(
      {HAPTICD_VIEW_PROGRAM, "--token-file", token, "--page", folder.path(), "--listen", "0.0.0.0:0"});
  EXPECT_TRUE(becomesTrue([&] { return program.errors().find("not encrypted") != std::string::npos; }))
      << program.errors();
  EXPECT_TRUE(contains(program.errors(), "ssh -L"));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), exitedWith(0));
}

TEST(ViewProgram, ListensOnBothKindsOfLoopback) {
  const TemporaryFolder folder;
  folder.write("index.html", "");
  const std::string token = folder.path() / "token";
  Program program(
      {HAPTICD_VIEW_PROGRAM, "--token-file", token, "--page", folder.path(), "--listen", "[::1]:0"});
  EXPECT_TRUE(becomesTrue([&] { return program.output().find("listens at [::1]:") != std::string::npos; }))
      << program.errors();
  EXPECT_EQ(program.errors(), "");
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), exitedWith(0));
}

/// Listens as a service manager does and becomes the program that it is given.
constexpr const char* kActivate =
    "import os, socket, sys\n"
    "listening = socket.create_server(('127.0.0.1', 0))\n"
    "os.dup2(listening.fileno(), 3)\n"
    "os.set_inheritable(3, True)\n"
    "os.environ.update(LISTEN_FDS='1', LISTEN_PID=str(os.getpid()))\n"
    "os.execv(sys.argv[1], sys.argv[1:])\n";

TEST(ViewProgram, TakesTheSocketOfTheServiceManager) {
  const TemporaryFolder folder;
  folder.write("index.html", "the page");
  const std::string token = folder.path() / "token";
  Program program({"/usr/bin/python3", "-c", kActivate, HAPTICD_VIEW_PROGRAM, "--token-file", token, "--page",
                   folder.path(), "--listen", "127.0.0.1:1"});
  const std::string before = "listens at 127.0.0.1:";
  ASSERT_TRUE(becomesTrue([&] { return program.output().ends_with('\n'); })) << program.errors();
  const std::string output = program.output();
  const std::size_t place = output.find(before);
  ASSERT_NE(place, std::string::npos) << output;
  const int port = std::stoi(output.substr(place + before.size()));
  EXPECT_NE(port, 1);
  RawClient client(port);
  client.send("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_TRUE(contains(client.receiveAll(), "401"));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), exitedWith(0));
}

}  // namespace
}  // namespace hapticd::test
