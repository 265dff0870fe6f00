// SPDX-License-Identifier: Apache-2.0
// Requests that hapticd-view must not answer. No box runs: who is refused does not reach it.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <string>
#include <vector>

#include "tests/view_bridge/bridge_under_test.h"

namespace hapticd::test {
namespace {

std::string statusLine(const std::string& answer) {
  return answer.substr(0, answer.find("\r\n"));
}

/// A request for the page with these header lines.
std::string pageRequest(const std::string& fields, const std::string& first = "GET / HTTP/1.1") {
  return first + "\r\n" + fields + "\r\n";
}

struct View {
  DaemonHome home;
  BridgeUnderTest bridge{home};
  std::string host = "Host: 127.0.0.1:" + std::to_string(bridge.port()) + "\r\n";
  std::string cookie = "Cookie: hapticd-view=" + bridge.token() + "\r\n";
};

TEST(ViewRefusal, NeverMeetsThePageItself) {
  View view;
  const std::string answer = view.bridge.answerTo(pageRequest(view.host + view.cookie));
  EXPECT_EQ(statusLine(answer), "HTTP/1.1 200 OK");
  EXPECT_TRUE(answer.ends_with("<title>the page</title>")) << answer;
  for (const char* field :
       {"Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' "
        "blob: "
        "data:; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n",
        "X-Content-Type-Options: nosniff\r\n", "Referrer-Policy: no-referrer\r\n",
        "Cross-Origin-Resource-Policy: same-origin\r\n", "Cross-Origin-Opener-Policy: same-origin\r\n",
        "Cache-Control: no-store\r\n", "Content-Type: text/html; charset=utf-8\r\n"}) {
    EXPECT_TRUE(contains(answer, field));
  }
}

TEST(ViewRefusal, MeetsTheseRequests) {
  View view;
  struct Case {
    std::string fields;
    const char* status;
    const char* logged;
  };
  const std::vector<Case> cases{
      {"Host: evil.example\r\n" + view.cookie, "HTTP/1.1 403 Forbidden", "the host \"evil.example\""},
      // the name that an attacker's name server gives this computer
      {"Host: rebound.example:8765\r\nOrigin: http://rebound.example:8765\r\n" + view.cookie,
       "HTTP/1.1 403 Forbidden", "the host \"rebound.example:8765\""},
      {view.host + "Origin: http://evil.example\r\n" + view.cookie, "HTTP/1.1 403 Forbidden",
       "the origin \"http://evil.example\""},
      {view.host + "Sec-Fetch-Site: cross-site\r\n" + view.cookie, "HTTP/1.1 403 Forbidden",
       "Sec-Fetch-Site"},
      {view.cookie, "HTTP/1.1 400 Bad Request", "fields Host"},
      {view.host, "HTTP/1.1 401 Unauthorized", "no token"},
      {view.host + "Cookie: hapticd-view=00000000000000000000000000000000\r\n", "HTTP/1.1 401 Unauthorized",
       "a wrong token"},
      {view.host + view.cookie + "Content-Length: 5\r\n", "HTTP/1.1 400 Bad Request", "body limit exceeded"},
  };
  for (const Case& refused : cases) {
    const std::string answer = view.bridge.answerTo(pageRequest(refused.fields));
    EXPECT_EQ(statusLine(answer), refused.status) << refused.fields;
    EXPECT_EQ(answer.find("<title>the page"), std::string::npos) << answer;
    EXPECT_TRUE(view.bridge.logs(refused.logged));
  }
  EXPECT_EQ(statusLine(view.bridge.answerTo(pageRequest(view.host + view.cookie, "POST / HTTP/1.1"))),
            "HTTP/1.1 405 Method Not Allowed");
  EXPECT_EQ(statusLine(view.bridge.answerTo("no HTTP at all\r\n\r\n")), "HTTP/1.1 400 Bad Request");
}

TEST(ViewRefusal, MeetsAHeaderOfNineKilobytes) {
  View view;
  const std::string answer = view.bridge.answerTo(
      pageRequest(view.host + view.cookie + "X-Filling: " + std::string(9 * 1024, 'x') + "\r\n"));
  EXPECT_EQ(statusLine(answer), "HTTP/1.1 431 Request Header Fields Too Large");
  EXPECT_TRUE(view.bridge.logs("a header longer than"));
}

TEST(ViewRefusal, MeetsAHeaderThatComesTooSlowly) {
  View view;
  RawClient slow(view.bridge.port());
  slow.send("GET / HTTP/1.1\r\n" + view.host + "X-Slow: ");
  EXPECT_TRUE(slow.isClosed());
  EXPECT_TRUE(view.bridge.logs("no complete header within 5 s"));
}

TEST(ViewRefusal, TellsWhereTheTokenComesFrom) {
  View view;
  EXPECT_TRUE(contains(view.bridge.answerTo(pageRequest(view.host)), "hapticctl view"));
}

TEST(ViewRefusal, MeetsAWebSocketThatOffersNoFoxgloveProtocol) {
  View view;
  const auto answerTo = [&view](const std::string& offered) {
    const std::string fields = view.cookie + "Sec-WebSocket-Protocol: " + offered + "\r\n";
    return WebSocketPeer(view.bridge.port(), "/", fields).answer();
  };
  EXPECT_EQ(statusLine(answerTo("foxglove.websocket.v2")), "HTTP/1.1 400 Bad Request");
  EXPECT_TRUE(
      contains(answerTo("foxglove.websocket.v1"), "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n"));
  EXPECT_TRUE(contains(answerTo("foxglove.websocket.v1, foxglove.sdk.v1"),
                       "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n"));
}

TEST(ViewRefusal, NeverLogsAToken) {
  View view;
  view.bridge.answerTo(pageRequest(view.host, "GET /?token=" + view.bridge.token() + " HTTP/1.1"));
  view.bridge.answerTo(pageRequest(view.host, "GET /?token=beefbeefbeefbeef HTTP/1.1"));
  view.bridge.answerTo(
      pageRequest("Host: evil.example\r\n", "GET /x?token=" + view.bridge.token() + " HTTP/1.1"));
  WebSocketPeer nowhere(view.bridge.port(), "/none?token=" + view.bridge.token());
  EXPECT_TRUE(view.bridge.logs("no WebSocket at /none"));
  EXPECT_EQ(view.bridge.program().errors().find(view.bridge.token()), std::string::npos);
  EXPECT_EQ(view.bridge.program().errors().find("beef"), std::string::npos);
}

TEST(ViewRefusal, MovesTheTokenFromTheAddressIntoACookie) {
  View view;
  const std::string answer =
      view.bridge.answerTo(pageRequest(view.host, "GET /?token=" + view.bridge.token() + " HTTP/1.1"));
  EXPECT_EQ(statusLine(answer), "HTTP/1.1 303 See Other");
  EXPECT_TRUE(contains(answer, "Location: /\r\n"));
  EXPECT_TRUE(contains(
      answer, "Set-Cookie: hapticd-view=" + view.bridge.token() + "; HttpOnly; SameSite=Strict; Path=/\r\n"));
}

TEST(ViewRefusal, MeetsNamesOfFilesThatAreNotOfThePage) {
  View view;
  for (const char* path : {"/token", "/../token", "/%2e%2e/token", "/index.html/..", "/none.js"}) {
    const std::string answer =
        view.bridge.answerTo(pageRequest(view.host + view.cookie, std::string("GET ") + path + " HTTP/1.1"));
    EXPECT_EQ(statusLine(answer), "HTTP/1.1 404 Not Found") << path;
    EXPECT_EQ(answer.find(view.bridge.token()), std::string::npos);
  }
}

TEST(ViewRefusal, MeetsAWebSocketWithoutTokenOrOfAnotherSite) {
  View view;
  EXPECT_EQ(statusLine(WebSocketPeer(view.bridge.port(), "/live").answer()), "HTTP/1.1 401 Unauthorized");
  EXPECT_EQ(statusLine(
                WebSocketPeer(view.bridge.port(), view.bridge.liveTarget(), "Origin: http://evil.example\r\n")
                    .answer()),
            "HTTP/1.1 403 Forbidden");
  EXPECT_EQ(statusLine(WebSocketPeer(view.bridge.port(), "/?token=" + view.bridge.token()).answer()),
            "HTTP/1.1 400 Bad Request");
}

TEST(ViewRefusal, EndsAWebSocketWhoseFramesAreWrong) {
  View view;
  struct Case {
    std::string bytes;
    const char* what;
  };
  const std::vector<Case> cases{
      {std::string("\x81\x02{}"), "an unmasked frame"},
      {std::string("\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xff", 10) + std::string(4, '\0'),
       "almost 2^63 bytes"},
      {std::string("\x82\xff\x80\0\0\0\0\0\0\0", 10) + std::string(4, '\0'), "2^63 bytes"},
      {std::string("\xf1\x80\0\0\0\0", 6), "reserved bits"},
      {std::string("\x83\x80\0\0\0\0", 6), "a reserved opcode"},
      {std::string("\x09\x80\0\0\0\0", 6), "a ping in pieces"},
      {std::string("\x81\x81\0\0\0\0\xff", 7), "text that is not UTF-8"},
      {std::string("\x81\xfe\x10\x01\0\0\0\0", 8) + std::string(4097, ' '), "a message of 4097 bytes"},
  };
  const std::size_t before = view.bridge.residentBytes();
  for (const Case& wrong : cases) {
    WebSocketPeer peer(view.bridge.port(), view.bridge.liveTarget());
    ASSERT_TRUE(peer.isOpen()) << peer.answer();
    peer.raw().send(wrong.bytes);
    EXPECT_TRUE(peer.raw().isClosed()) << wrong.what;
  }
  constexpr std::size_t kMuch =
      8 * 1024 * 1024;  // far more than eight clients need, far less than was announced
  EXPECT_LT(view.bridge.residentBytes(), before + kMuch);
  WebSocketPeer good(view.bridge.port(), view.bridge.liveTarget());
  EXPECT_EQ(good.nextOf("hello").value("protocol", 0), 1);
}

TEST(ViewRefusal, FreesThePlaceOfAClientThatNeverHangsUp) {
  View view;
  WebSocketPeer peer(view.bridge.port(), view.bridge.liveTarget());
  ASSERT_TRUE(peer.isOpen()) << peer.answer();
  peer.raw().send("\x81\x02{}");  // unmasked
  EXPECT_TRUE(view.bridge.logs("neither talks by the protocol nor hangs up"));
}

TEST(ViewRefusal, EndsAClientThatFloods) {
  View view;
  WebSocketPeer peer(view.bridge.port(), view.bridge.liveTarget());
  ASSERT_TRUE(peer.isOpen()) << peer.answer();
  for (int i = 0; i < 1000; ++i) peer.sendText(R"({"type":"depth","maxHz":1})");
  EXPECT_TRUE(view.bridge.logs("more than 100 messages a second"));
  EXPECT_TRUE(peer.raw().isClosed());
}

TEST(ViewRefusal, MeetsTheNinthClient) {
  View view;
  std::vector<WebSocketPeer> peers;
  for (int i = 0; i < 8; ++i) {
    peers.emplace_back(view.bridge.port(), view.bridge.liveTarget());
    EXPECT_TRUE(peers.back().isOpen()) << i << peers.back().answer();
  }
  EXPECT_EQ(statusLine(WebSocketPeer(view.bridge.port(), view.bridge.liveTarget()).answer()),
            "HTTP/1.1 503 Service Unavailable");
  peers.pop_back();
  EXPECT_TRUE(
      becomesTrue([&] { return WebSocketPeer(view.bridge.port(), view.bridge.liveTarget()).isOpen(); }));
}

TEST(ViewRefusal, KeepsNobodyOutForConnectionsThatSendNothing) {
  View view;
  std::vector<RawClient> silent;
  for (int i = 0; i < 70; ++i) silent.emplace_back(view.bridge.port());
  WebSocketPeer viewer(view.bridge.port(), view.bridge.liveTarget());
  EXPECT_EQ(viewer.nextOf("hello").value("protocol", 0), 1);
  EXPECT_TRUE(silent.front().isClosed()) << "the oldest gives way";
}

/// Connects as another user again and again and sends nothing, until it is ended.
class SilentFlood {
 public:
  SilentFlood(int port, uid_t user) : child_(::fork()) {
    if (child_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::setuid(user) != 0) ::_exit(1);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    std::array<int, 200> sockets{};
    for (std::size_t i = 0;; i = (i + 1) % sockets.size()) {
      if (sockets[i] > 0) ::close(sockets[i]);
      sockets[i] = ::socket(AF_INET, SOCK_STREAM, 0);
      ::connect(sockets[i], reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
  }
  ~SilentFlood() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  SilentFlood(const SilentFlood&) = delete;
  SilentFlood& operator=(const SilentFlood&) = delete;

 private:
  pid_t child_;
};

TEST(ViewRefusal, LeavesPlacesToOthersBesideAUserWhoFloods) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to be another user";
  View view;
  const SilentFlood flood(view.bridge.port(), 65534);
  ASSERT_TRUE(view.bridge.logs("too many connections"));
  for (int i = 0; i < 20; ++i) {
    WebSocketPeer viewer(view.bridge.port(), view.bridge.liveTarget());
    EXPECT_EQ(viewer.nextOf("hello").value("protocol", 0), 1) << i;
  }
  // One whose request comes in two pieces keeps its place meanwhile, unless this machine takes longer than
  // the 5 s that it may take.
  const std::string request = upgradeRequest(view.bridge.port(), view.bridge.liveTarget());
  EXPECT_TRUE(becomesTrue([&] {
    RawClient slow(view.bridge.port());
    slow.send(request.substr(0, 20));
    WebSocketPeer(view.bridge.port(), view.bridge.liveTarget()).nextOf("hello");
    slow.send(request.substr(20));
    return slow.receive(20).starts_with("HTTP/1.1 101");
  }));
}

TEST(ViewRefusal, NeverFillsTheLog) {
  View view;
  for (int i = 0; i < 300; ++i) view.bridge.answerTo(pageRequest(view.host));
  const std::string log = view.bridge.program().errors();
  EXPECT_LT(std::ranges::count(log, '\n'), 100) << log;
}

}  // namespace
}  // namespace hapticd::test
