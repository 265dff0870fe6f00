// SPDX-License-Identifier: Apache-2.0
// The rules of the wire, with bytes written by hand.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <thread>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

constexpr const char* kGetInfo = R"({"method":"org.varlink.service.GetInfo"})";
constexpr const char* kUnknown = R"({"method":"io.hapticd.Status.Nope"})";
constexpr const char* kUnknownReply =
    R"({"error":"org.varlink.service.MethodNotFound","parameters":{"method":"io.hapticd.Status.Nope"}})";
constexpr const char* kMonitor =
    R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":20},"more":true})";

class VarlinkServerTest : public ControlFixture {
 protected:
  void expectServing() { EXPECT_EQ(kUnknownReply, answerTo(kUnknown)); }

  std::string answerTo(const std::string& text) {
    RawClient client = statusClient();
    client.call(text);
    return client.reply();
  }

  /// Expects that bytes that are not a call get one error with a short, printable text, and then the end.
  void expectMalformed(const std::string& bytes) {
    RawClient client = statusClient();
    client.send(bytes);
    const auto reply = client.json();
    ASSERT_TRUE(reply.is_object()) << bytes.substr(0, 100);
    EXPECT_EQ(reply["error"], "io.hapticd.Status.MalformedCall") << bytes.substr(0, 100);
    const auto reason = reply["parameters"]["reason"].get<std::string>();
    EXPECT_FALSE(reason.empty());
    // a sentence of the daemon's own, not one of the library that parses
    for (const char* foreign : {"json.exception", "syntax error", "out_of_range", "parse_error"})
      EXPECT_EQ(std::string::npos, reason.find(foreign)) << reason;
    EXPECT_LT(reason.size(), 300U);
    EXPECT_TRUE(std::ranges::all_of(reason, [](char c) { return c >= ' ' && c <= '~'; })) << reason;
    EXPECT_EQ(RawClient::kClosed, client.reply()) << bytes.substr(0, 100);
    expectServing();
  }

  /// Connects once too often: gets the error, also with a call on its way, and is closed.
  void expectRefused(const std::string& path, const nlohmann::json& parameters) {
    for (const int calls : {0, 1, 1000}) {
      RawClient client(path);
      for (int i = 0; i < calls; ++i) client.call(kUnknown);
      EXPECT_EQ(errorReply("io.hapticd.Status.TooManyConnections", parameters), client.json());
      EXPECT_EQ(RawClient::kClosed, client.reply());
      EXPECT_TRUE(client.canSend());
    }
  }

  /// Connects again and again until the server has noticed that somebody left.
  void expectAdmittedSoon(const std::string& path) {
    std::string answer;
    for (int attempt = 0; attempt < 10'000 && answer != kUnknownReply; ++attempt) {
      RawClient client(path);
      client.call(kUnknown);
      answer = client.reply();
    }
    EXPECT_EQ(kUnknownReply, answer);
  }
};

TEST_F(VarlinkServerTest, AnswersPipelinedCallsInTheirOrder) {
  start();
  RawClient client = statusClient();
  std::string calls;
  for (int i = 0; i < 500; ++i)
    calls += message(R"({"method":"io.hapticd.Status.M)" + std::to_string(i) + "\"}");
  client.send(calls);
  for (int i = 0; i < 500; ++i) {
    EXPECT_EQ(nlohmann::json("io.hapticd.Status.M" + std::to_string(i)),
              client.json()["parameters"]["method"]);
  }
}

TEST_F(VarlinkServerTest, ReadsNothingForOnewayCalls) {
  start();
  RawClient client = statusClient();
  const int before = box.statusCalls();
  for (int i = 0; i < 100; ++i) client.call(R"({"method":"io.hapticd.Status.GetStatus","oneway":true})");
  client.call(kUnknown);
  EXPECT_EQ(kUnknownReply, client.reply());
  EXPECT_EQ(before, box.statusCalls());
}

TEST_F(VarlinkServerTest, AnswersAClientThatHasEndedItsInput) {
  start();
  RawClient client = statusClient();
  client.call(kUnknown);
  client.call(kUnknown);
  client.endInput();
  EXPECT_EQ(kUnknownReply, client.reply());
  EXPECT_EQ(kUnknownReply, client.reply());
  EXPECT_EQ(RawClient::kClosed, client.reply());
}

TEST_F(VarlinkServerTest, GoesOnStreamingToAClientThatHasEndedItsInput) {
  start();
  RawClient client = statusClient();
  client.call(kMonitor);
  client.endInput();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(true, client.json()["continues"]);
}

TEST_F(VarlinkServerTest, ObeysAllOnewayCallsOfAClientThatLeftEvenIfTheyAreMoreThanOneBuffer) {
  start();
  std::string calls;
  for (int i = 0; i < 2000; ++i) calls += message(R"({"method":"io.hapticd.Control.Engage","oneway":true})");
  RawClient client = controlClient();
  client.send(calls);
  client.close();
  EXPECT_TRUE(box.waitForChanges(2000));
}

TEST_F(VarlinkServerTest, SaysThatSomethingIsNoCallAndClosesTheConnection) {
  start();
  const std::string deep =
      R"({"method":"a.B","parameters":{"x":)" + std::string(40, '[') + std::string(40, ']') + "}}";
  const std::string violations[] = {
      "",
      "hello",
      "{",
      "[]",
      "1",
      "null",
      "\"text\"",
      "{}",
      R"({"parameters":{}})",
      R"({"method":1})",
      R"({"method":null})",
      R"({"method":"a.B","parameters":[]})",
      R"({"method":"a.B","parameters":"x"})",
      R"({"method":"a.B","oneway":1})",
      R"({"method":"a.B","more":"true"})",
      R"({"method":"a.B","upgrade":null})",
      R"({"method":"a.B","more":true,"oneway":true})",
      R"({"method":"a.B","id":7})",
      R"({"method":"a.B","method":"a.B"})",
      R"({"method":"a.B","parameters":{"x":1,"x":2}})",
      R"({"method":"a.B"} {"method":"a.B"})",
      R"({"method":"a.B","parameters":{"x":1e999}})",
      "{\"method\":\"a.\xff\"}",
      "{\"method\":\"a.\xc0\x80\"}",
      R"({"method":"a.\ud800"})",
      deep,
      std::string(30'000, '['),
      "\x16\x03\x01\x02",
      "GET / HTTP/1.1\r\n\r\n",
  };
  for (const std::string& violation : violations) expectMalformed(message(violation));
}

TEST_F(VarlinkServerTest, AnswersWhatCameBeforeAViolation) {
  start();
  RawClient client = statusClient();
  client.send(message(kUnknown) + message("garbage") + message(kUnknown));
  EXPECT_EQ(kUnknownReply, client.reply());
  EXPECT_EQ(client.json()["error"], "io.hapticd.Status.MalformedCall");
  EXPECT_EQ(RawClient::kClosed, client.reply());
}

TEST_F(VarlinkServerTest, ForgetsAMessageThatNeverEnds) {
  start();
  {
    RawClient client = statusClient();
    client.send(R"({"method":"io.hapticd.)");
    client.endInput();
    EXPECT_EQ(RawClient::kClosed, client.reply());
  }
  expectServing();
}

TEST_F(VarlinkServerTest, TakesMessagesOf64KiBAndNotOneByteMore) {
  start();
  const std::string head = R"({"method":"io.hapticd.Status.Nope")";
  const auto padded = [&](std::size_t size) { return head + std::string(size - head.size() - 1, ' ') + "}"; };
  EXPECT_EQ(kUnknownReply, answerTo(padded(65536)));
  RawClient hesitant = statusClient();
  hesitant.send(padded(65536));
  expectServing();  // by now all but the NUL has been read
  hesitant.send(std::string(1, '\0'));
  EXPECT_EQ(kUnknownReply, hesitant.reply());
  expectMalformed(message(padded(65537)));
  expectMalformed(std::string(70'000, 'x'));
}

TEST_F(VarlinkServerTest, TakesLongerMessagesOnConnectionsThatMayControl) {
  start();
  const std::string head = R"({"method":"io.hapticd.Status.Nope")";
  const auto padded = [&](std::size_t size) { return head + std::string(size - head.size() - 1, ' ') + "}"; };
  RawClient client = controlClient();
  client.send(message(padded(524'288)));
  EXPECT_EQ(kUnknownReply, client.reply());
  client.send(message(padded(524'289)));
  EXPECT_EQ("io.hapticd.Status.MalformedCall", client.json()["error"]);
}

TEST_F(VarlinkServerTest, TreatsNoParametersNullAndAnEmptyObjectAlike) {
  start();
  const std::string expected = answerTo(kGetInfo);
  EXPECT_EQ(0U, expected.find(R"({"parameters":{"vendor":"hapticd")")) << expected;
  EXPECT_EQ(expected, answerTo(R"({"method":"org.varlink.service.GetInfo","parameters":null})"));
  EXPECT_EQ(expected, answerTo(R"({"method":"org.varlink.service.GetInfo","parameters":{}})"));
  EXPECT_EQ(expected, answerTo(R"({"method":"org.varlink.service.GetInfo","more":true})"));
}

/// So many connections as there may be, of a user or of all, and the refusal of the next one.
struct Crowd {
  ConnectionLimits limits;
  std::size_t connections;
  bool per_user;
};

class CrowdedVarlinkServer : public VarlinkServerTest, public testing::WithParamInterface<Crowd> {};

TEST_P(CrowdedVarlinkServer, RefusesTheNextConnectionUntilOneIsClosed) {
  const auto& [limits, connections, per_user] = GetParam();
  server_options.control_limits = limits;
  start();
  std::vector<RawClient> clients;
  for (std::size_t i = 0; i < connections; ++i) clients.push_back(controlClient());
  for (RawClient& client : clients) {
    client.call(kUnknown);
    EXPECT_EQ(kUnknownReply, client.reply());
  }
  expectRefused(controlPath(), {{"limit", connections}, {"perUser", per_user}});
  clients.front().close();
  expectAdmittedSoon(controlPath());
}

INSTANTIATE_TEST_SUITE_P(Limits, CrowdedVarlinkServer,
                         testing::Values(Crowd{{ServerOptions{}.control_limits.all, 8}, 8, true},
                                         Crowd{{32, 100}, 32, false}));

TEST_F(VarlinkServerTest, AUserWhoHasAllPlacesForReadingStillGetsOneToControl) {
  start();
  std::vector<RawClient> watchers;
  for (int i = 0; i < 40; ++i) watchers.push_back(statusClient());
  for (RawClient& watcher : watchers) {
    watcher.call(kUnknown);
    EXPECT_EQ(kUnknownReply, watcher.reply());
  }
  expectRefused(statusPath(), {{"limit", 40}, {"perUser", true}});
  RawClient control = controlClient();
  control.call(kUnknown);
  EXPECT_EQ(kUnknownReply, control.reply());
}

TEST_F(VarlinkServerTest, CountsConnectionsForEachUserByItself) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to connect as another user";
  server_options.read_limits.per_user = 8;
  start();
  std::filesystem::permissions(folder.path(""), std::filesystem::perms(0711));
  std::vector<RawClient> clients;
  for (int i = 0; i < 8; ++i) clients.push_back(statusClient());
  for (RawClient& client : clients) {
    client.call(kUnknown);
    EXPECT_EQ(kUnknownReply, client.reply());
  }
  const pid_t other = ::fork();
  if (other == 0) {
    if (::setuid(65534) != 0) ::_exit(2);
    RawClient client = statusClient();
    client.call(kUnknown);
    ::_exit(client.reply() == kUnknownReply ? 0 : 1);
  }
  int result = -1;
  ASSERT_EQ(other, ::waitpid(other, &result, 0));
  EXPECT_EQ(0, result);
}

TEST_F(VarlinkServerTest, GivesThePlaceOfAStreamThatItsClientLeftToTheNext) {
  server_options.read_limits.per_user = 1;
  start();
  {
    RawClient client = statusClient();
    client.call(kMonitor);
    EXPECT_EQ(true, client.json()["continues"]);
  }
  expectAdmittedSoon(statusPath());
}

TEST_F(VarlinkServerTest, GivesThePlaceOfAWaitingCallThatItsClientLeftToTheNext) {
  server_options.control_limits.per_user = 1;
  start();
  box.holdAcknowledgements();
  {
    RawClient client = controlClient();
    client.call(R"({"method":"io.hapticd.Control.Engage"})");
    EXPECT_TRUE(box.waitForChanges(1));
  }
  expectAdmittedSoon(controlPath());
}

TEST_F(VarlinkServerTest, StopsReadingFromAClientThatDoesNotRead) {
  start();
  RawClient greedy = statusClient();
  const std::string call = message(R"({"method":"io.hapticd.Status.GetParameters"})");
  // What fits in between: the buffers of the kernel (their limit is below 1 MiB by default) and of the
  // server.
  std::size_t sent = 0;
  std::size_t accepted = 1;
  while (accepted > 0 && sent < (64U << 20)) {
    accepted = greedy.sendWithoutWaiting(call);
    sent += accepted;
    if (accepted == 0) {  // the server may just not have come to it
      expectServing();
      accepted = greedy.sendWithoutWaiting(call);
      sent += accepted;
    }
  }
  EXPECT_LT(sent, 8U << 20);
  const std::size_t calls = sent / call.size();
  for (std::size_t i = 0; i < calls; ++i)
    ASSERT_TRUE(greedy.json()["parameters"]["parameters"].is_array()) << i;
}

TEST_F(VarlinkServerTest, LeavesRepliesOfStreamsOutWhileClientsTogetherHaveTooMuchUnread) {
  server_options.max_output_bytes = 400'000;
  start();
  box.setNotices({std::string(200'000, 'w')});  // more than the kernel keeps for a socket of the server
  const int before = box.statusCalls();
  std::vector<RawClient> lazy;
  for (int i = 0; i < 2; ++i) {
    lazy.push_back(statusClient());
    lazy.back().call(R"({"method":"io.hapticd.Status.GetStatus"})");
  }
  EXPECT_TRUE(box.waitForStatusCalls(before + 2));
  RawClient watcher = statusClient();
  watcher.call(kMonitor);
  EXPECT_TRUE(box.waitForStatusCalls(before + 4));
  expectServing();  // calls are answered all the same
  EXPECT_TRUE(watcher.silent());
  for (RawClient& client : lazy) EXPECT_TRUE(client.json()["parameters"]["status"].is_object());
  EXPECT_LE(2, watcher.json()["parameters"]["droppedCount"]);
}

TEST_F(VarlinkServerTest, ClosesReadersWhoseUnreadRepliesTogetherAreTooMuch) {
  server_options.max_held_bytes = 2'000'000;
  start();
  box.setNotices({std::string(400'000, 'w')});
  const int before = box.statusCalls();
  std::vector<RawClient> lazy;
  for (int i = 0; i < 12; ++i) {
    lazy.push_back(statusClient());
    lazy.back().call(R"({"method":"io.hapticd.Status.GetStatus"})");
    ASSERT_TRUE(box.waitForStatusCalls(before + i + 1));
    expectServing();
  }
  RawClient watcher = controlClient();
  watcher.call(R"({"method":"io.hapticd.Status.GetStatus"})");
  EXPECT_TRUE(watcher.json()["parameters"]["status"].is_object());
  std::size_t whole = 0;
  for (RawClient& client : lazy) {
    if (client.reply().size() > 400'000) ++whole;
  }
  // what the kernel holds of each reply does not count
  EXPECT_GE(whole, 4U);
  EXPECT_LE(whole, 6U);
}

/// Lets the process open no further descriptor while it lives.
class NoMoreDescriptors {
 public:
  NoMoreDescriptors() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const base::Descriptor lowest(::dup(0));  // all below are in use
    rlimit limit = before_;
    limit.rlim_cur = static_cast<rlim_t>(lowest.get());
    ::setrlimit(RLIMIT_NOFILE, &limit);
  }
  ~NoMoreDescriptors() { ::setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

TEST_F(VarlinkServerTest, RefusesClientsWhileDescriptorsHaveRunOutAndServesTheOthers) {
  start();
  RawClient early = statusClient();
  early.call(kUnknown);
  EXPECT_EQ(kUnknownReply, early.reply());
  const int late_socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  {
    const NoMoreDescriptors limited;
    RawClient late = RawClient::adopt(late_socket, statusPath());
    const auto refusal = late.json();
    EXPECT_EQ(refusal["error"], "io.hapticd.Status.TooManyConnections");
    EXPECT_EQ(refusal["parameters"]["limit"], 1);
    EXPECT_EQ(RawClient::kClosed, late.reply());
    early.call(kUnknown);
    EXPECT_EQ(kUnknownReply, early.reply());
  }
  expectServing();
}

TEST_F(VarlinkServerTest, RemovesItsSocketsAndClosesItsConnectionsWhenItStops) {
  start();
  RawClient client = statusClient();
  client.call(kMonitor);
  EXPECT_EQ(true, client.json()["continues"]);
  stop();
  EXPECT_FALSE(std::filesystem::exists(statusPath()));
  EXPECT_FALSE(std::filesystem::exists(controlPath()));
  std::string last;
  while ((last = client.reply()) != RawClient::kClosed) ASSERT_NE(RawClient::kNoAnswer, last);
}

}  // namespace
}  // namespace hapticd::daemon::test
