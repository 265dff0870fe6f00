// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/hand_moves.h"

#include <gtest/gtest.h>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

// What hapticd-view sends to a control socket to move the hand, and for whom.
namespace hapticd::tools::view {
namespace {

using namespace std::chrono_literals;
using boost::asio::local::stream_protocol;
using boost::system::error_code;

constexpr const char* kRefused =
    R"({"error":"io.hapticd.Control.HandRefused","parameters":{"cause":"not_allowed","reason":"the handle udp follows no person"}})";

/// Takes calls of one connection after the other, and answers each when the test says so.
class ControlService {
 public:
  ControlService(boost::asio::io_context& context, const std::string& path)
      : acceptor_(context, stream_protocol::endpoint(path)), socket_(context) {
    accept();
  }
  void answer(std::string reply = R"({"parameters":{}})") {
    reply.push_back('\0');
    boost::asio::write(socket_, boost::asio::buffer(reply));
  }
  std::vector<Json> calls;
  int connections = 0;

 private:
  void accept() {
    acceptor_.async_accept([this](const error_code& error, stream_protocol::socket socket) {
      if (error) return;
      ++connections;
      socket_ = std::move(socket);
      read();
      accept();
    });
  }
  void read() {
    boost::asio::async_read_until(socket_, boost::asio::dynamic_buffer(input_), '\0',
                                  [this](const error_code& error, std::size_t bytes) {
                                    if (error) return;
                                    calls.push_back(Json::parse(input_.substr(0, bytes - 1)));
                                    input_.erase(0, bytes);
                                    read();
                                  });
  }

  stream_protocol::acceptor acceptor_;
  stream_protocol::socket socket_;
  std::string input_;
};

class Page final : public Viewer {
 public:
  bool wantsTicks() const override { return false; }
  bool wantsDepth() const override { return false; }
  void onHandAnswer(const std::string& problem) override { answers.push_back(problem); }
  std::vector<std::string> answers;
};

struct Box {
  /// Runs until that many calls have come, or nothing happens for longer than any machine takes.
  bool hasCalls(std::size_t count) {
    while (service.calls.size() < count && context.run_one_for(10s) > 0) {
    }
    return service.calls.size() == count;
  }
  bool hasAnswers(const Page& page, std::size_t count) {
    while (page.answers.size() < count && context.run_one_for(10s) > 0) {
    }
    return page.answers.size() == count;
  }
  double lastX() const { return service.calls.back()["parameters"]["targetMInWorld"][0]; }

  test::TemporaryFolder folder;
  boost::asio::io_context context;
  ControlService service{context, folder.path() / "Control"};
  HandMoves::Clock::time_point now{1000s};
  HandMoves moves{context, folder.path() / "Control", [this] { return now; }};
};

TEST(HandMoves, SendsTheNewestTargetOnlyOverOneConnection) {
  Box box;
  Page page;
  for (const double x : {0.1, 0.2, 0.3}) box.moves.request(page, {x, 0, -1});
  ASSERT_TRUE(box.hasCalls(1));
  EXPECT_EQ(box.service.calls[0]["method"], "io.hapticd.Control.MoveHand");
  EXPECT_EQ(box.lastX(), 0.1);
  box.service.answer();
  ASSERT_TRUE(box.hasCalls(2));
  EXPECT_EQ(box.lastX(), 0.3) << "the one between is out of date";
  box.service.answer();
  ASSERT_TRUE(box.hasAnswers(page, 1)) << "nothing is said twice";
  EXPECT_EQ(page.answers[0], "");
  EXPECT_EQ(box.service.connections, 1);
}

TEST(HandMoves, IsForOnePageAtATime) {
  Box box;
  Page first, second;
  box.moves.request(first, {0.1, 0, -1});
  ASSERT_TRUE(box.hasCalls(1));
  box.service.answer();
  ASSERT_TRUE(box.hasAnswers(first, 1));
  box.now += HandMoves::kTurn - 1ms;
  box.moves.request(second, {0.2, 0, -1});
  ASSERT_EQ(second.answers.size(), 1U);
  EXPECT_TRUE(second.answers[0].starts_with("another page moves the hand"));
  EXPECT_EQ(box.service.calls.size(), 1U);

  box.now += 1ms;
  box.moves.request(second, {0.3, 0, -1});
  ASSERT_TRUE(box.hasCalls(2));
  EXPECT_EQ(box.lastX(), 0.3);
  box.moves.forget(second);
  box.service.answer();
  box.moves.request(first, {0.4, 0, -1});
  ASSERT_TRUE(box.hasCalls(3)) << "the second one has left";
  EXPECT_EQ(second.answers.size(), 1U) << "nobody is told who has left";
}

TEST(HandMoves, TellsWhyTheBoxRefusesAndAsksAgainAfterAPause) {
  Box box;
  Page page;
  box.moves.request(page, {0.1, 0, -1});
  ASSERT_TRUE(box.hasCalls(1));
  box.service.answer(kRefused);
  ASSERT_TRUE(box.hasAnswers(page, 1));
  EXPECT_EQ(page.answers[0], "the handle udp follows no person");
  box.moves.request(page, {0.2, 0, -1});
  box.context.poll();
  EXPECT_EQ(box.service.calls.size(), 1U) << "not at once";
  box.now += HandMoves::kPause;
  box.moves.request(page, {0.3, 0, -1});
  ASSERT_TRUE(box.hasCalls(2));
  EXPECT_EQ(box.lastX(), 0.3);
  box.service.answer();
  ASSERT_TRUE(box.hasAnswers(page, 2));
  EXPECT_EQ(page.answers[1], "");
}

TEST(HandMoves, SaysWhereNoBoxIs) {
  test::TemporaryFolder folder;
  boost::asio::io_context context;
  HandMoves moves(context, folder.path() / "Control");
  Page page;
  moves.request(page, {0, 0, -1});
  while (page.answers.empty() && context.run_one_for(10s) > 0) {
  }
  ASSERT_EQ(page.answers.size(), 1U);
  EXPECT_TRUE(page.answers[0].starts_with("hapticd is not running"));
}

}  // namespace
}  // namespace hapticd::tools::view
