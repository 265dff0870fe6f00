// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/fixture_changes.h"

#include <gtest/gtest.h>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.h"

// What hapticd-view asks of a control socket, for whom, and how often.
namespace hapticd::tools::view {
namespace {

using namespace std::chrono_literals;
using boost::asio::local::stream_protocol;
using boost::system::error_code;

constexpr const char* kDone = R"({"parameters":{"generation":2}})";

/// Takes one call after the other and gives the same reply to each.
class ControlService {
 public:
  ControlService(boost::asio::io_context& context, const std::string& path, std::string reply)
      : context_(context), acceptor_(context, stream_protocol::endpoint(path)), reply_(std::move(reply)) {
    reply_.push_back('\0');
    accept();
  }
  std::vector<Json> calls;

 private:
  void accept() {
    socket_ = std::make_shared<stream_protocol::socket>(context_);
    acceptor_.async_accept(*socket_, [this, socket = socket_](const error_code& error) {
      if (error) return;
      std::string message;
      boost::asio::read_until(*socket, boost::asio::dynamic_buffer(message), '\0');
      calls.push_back(Json::parse(message.substr(0, message.find('\0'))));
      boost::asio::write(*socket, boost::asio::buffer(reply_));
      accept();
    });
  }

  boost::asio::io_context& context_;
  stream_protocol::acceptor acceptor_;
  std::shared_ptr<stream_protocol::socket> socket_;
  std::string reply_;
};

class Page final : public Viewer {
 public:
  bool wantsTicks() const override { return false; }
  bool wantsDepth() const override { return false; }
};

struct Box {
  explicit Box(const std::string& reply = kDone) : service(context, folder.path() / "Control", reply) {}

  /// The answer to a request that comes long after the one before.
  std::string answerTo(const Page& from, const FixtureRequest& request) {
    now += 1s;
    std::string answer = "none";
    changes.request(from, request, [&](const std::string& problem) { answer = problem; });
    while (answer == "none" && context.run_one_for(10s) > 0) {
    }
    return answer;
  }
  std::string add(const Page& from, const std::string& name) {
    return answerTo(from, {.add = {{"name", name}, {"kind", "point"}}});
  }
  std::string remove(const Page& from, const std::string& name) { return answerTo(from, {.remove = name}); }

  test::TemporaryFolder folder;
  boost::asio::io_context context;
  FixtureChanges::Clock::time_point now{};
  ControlService service;
  FixtureChanges changes{context, folder.path() / "Control", [this] { return now; }};
  Page page;
  Page other;
};

/// Fixtures with the generation in which each became what it is.
Json listOf(std::uint64_t generation, const std::vector<std::pair<std::string, std::uint64_t>>& defined_in) {
  Json fixtures = Json::array();
  for (const auto& [name, defined] : defined_in) fixtures.push_back({{"name", name}, {"definedIn", defined}});
  return {{"generation", generation}, {"fixtures", fixtures}, {"regions", Json::array()}};
}

bool isRefusedHere(const std::string& answer) {
  return answer.find("only fixtures that were added here") != std::string::npos;
}

TEST(FixtureChanges, CallsChangeFixturesAndNothingElse) {
  Box box;
  EXPECT_EQ(box.add(box.page, "nerve"), "");
  EXPECT_EQ(box.remove(box.page, "nerve"), "");
  const char* const method = "io.hapticd.Control.ChangeFixtures";
  const Json definition = {{"name", "nerve"}, {"kind", "point"}};
  const std::vector<Json> expected{
      {{"method", method}, {"parameters", {{"add", Json::array({definition})}}}},
      {{"method", method}, {"parameters", {{"remove", Json::array({"nerve"})}, {"generation", 2}}}}};
  EXPECT_EQ(box.service.calls, expected);
}

TEST(FixtureChanges, TellsWhyTheBoxRefuses) {
  struct Case {
    std::string reply;
    std::string text;
  };
  const std::vector<Case> cases{
      {R"({"error":"io.hapticd.Control.FixtureRefused","parameters":{"fixture":"nerve","field":"radius_m",
           "reason":"is missing","remedy":"give it","problems":[{}]}})",
       "nothing was changed: radius_m is missing (give it)"},
      {R"({"error":"io.hapticd.Control.FixtureRefused","parameters":{"fixture":"nerve","field":null,
           "reason":"has no place","remedy":"","problems":[{}]}})",
       "nothing was changed: has no place"},
      {R"({"error":"org.varlink.service.PermissionDenied"})",
       "nothing was changed: the box no longer lets the user of hapticd-view change fixtures"},
      {R"({"error":"io.hapticd.Control.ChangedMeanwhile","parameters":{"generation":7}})",
       "nothing was changed: somebody has just changed the fixtures (try again)"},
      {R"({"error":"io.hapticd.Control.NotApplied","parameters":{"generation":7}})",
       "it is not known whether this was done: the force loop has not taken it over in time; see the list of "
       "fixtures"},
  };
  for (const Case& refused : cases) {
    Box box(refused.reply);
    EXPECT_EQ(box.add(box.page, "nerve"), refused.text);
    EXPECT_TRUE(isRefusedHere(box.remove(box.page, "nerve"))) << "what was not added is not the page's";
  }
}

TEST(FixtureChanges, RemoveWhatTheSamePageHasAddedOnly) {
  Box box;
  EXPECT_EQ(box.add(box.page, "nerve"), "");
  box.changes.follow(listOf(2, {{"plate", 1}, {"nerve", 2}}));
  EXPECT_TRUE(isRefusedHere(box.remove(box.other, "nerve")));
  EXPECT_TRUE(isRefusedHere(box.remove(box.page, "plate")));
  EXPECT_EQ(box.remove(box.page, "nerve"), "");
  EXPECT_TRUE(isRefusedHere(box.remove(box.page, "nerve"))) << "a second time";
  EXPECT_EQ(box.add(box.page, "nerve"), "");
  box.changes.forget(box.page);
  EXPECT_TRUE(isRefusedHere(box.remove(box.page, "nerve"))) << "another page at the same address";
}

/// Whether the first list that comes holds it or what has replaced it already.
TEST(FixtureChanges, RemoveNothingThatSomebodyElseHasChangedOrReplaced) {
  const Json added = listOf(2, {{"nerve", 2}}), replaced = listOf(4, {{"nerve", 4}}), none = listOf(3, {});
  for (const auto& lists : {std::vector{added, replaced}, std::vector{added, none}, std::vector{replaced},
                            std::vector{none}, std::vector{none, replaced}}) {
    Box box;
    EXPECT_EQ(box.add(box.page, "nerve"), "");
    for (const Json& list : lists) box.changes.follow(list);
    EXPECT_TRUE(isRefusedHere(box.remove(box.page, "nerve"))) << lists.back();
    EXPECT_EQ(box.service.calls.size(), 1U);
  }
}

TEST(FixtureChanges, RemoveAgainWhatIsStillTheSameInTheNewestSet) {
  Box box;
  EXPECT_EQ(box.add(box.page, "nerve"), "");
  box.changes.follow(listOf(1, {}));  // fetched before
  box.changes.follow(listOf(5, {{"vein", 5}, {"nerve", 2}}));
  EXPECT_EQ(box.remove(box.page, "nerve"), "");
  EXPECT_EQ(box.service.calls.back()["parameters"]["generation"], 5);
  EXPECT_EQ(box.add(box.page, "nerve"), "");
  box.changes.forgetAll();
  EXPECT_TRUE(isRefusedHere(box.remove(box.page, "nerve"))) << "the box was started again";
}

TEST(FixtureChanges, AreRememberedInABoundedNumber) {
  Box box;
  for (std::size_t number = 0; number <= FixtureChanges::kMaxAdded; ++number)
    EXPECT_EQ(box.add(box.page, "f" + std::to_string(number)), "");
  EXPECT_TRUE(isRefusedHere(box.remove(box.page, "f0")));
  EXPECT_EQ(box.remove(box.page, "f1"), "");
}

TEST(FixtureChanges, LeaveTheAnswerToNobodyWhenThePageIsGone) {
  Box box;
  box.now += 1s;
  int answers = 0;
  box.changes.request(box.page, {.add = {{"name", "nerve"}}}, [&](const std::string&) { ++answers; });
  box.changes.forget(box.page);
  std::string next;
  do {
    next = box.add(box.other, "vein");  // refused as long as the box has not answered the first one
    box.context.run_one_for(1ms);
  } while (next.ends_with("(try again)") && box.now < FixtureChanges::Clock::time_point(1000s));
  EXPECT_EQ(next, "");
  EXPECT_EQ(box.service.calls.size(), 2U);
  EXPECT_EQ(answers, 0);
}

TEST(FixtureChanges, ComeAtMostOncePerPauseFromAllPages) {
  boost::asio::io_context context;
  FixtureChanges::Clock::time_point now{};
  FixtureChanges changes(context, "", [&] { return now; });
  const std::vector<Page> pages(3);
  std::mt19937 random(7);
  std::vector<FixtureChanges::Clock::time_point> made;
  for (int i = 0; i < 2000; ++i) {
    now += std::chrono::milliseconds(random() % 300);
    bool refused = false;
    changes.request(pages[random() % pages.size()], {.add = {{"name", "nerve"}}},
                    [&](const std::string& problem) { refused |= problem.ends_with("(try again)"); });
    const bool due = made.empty() || now - made.back() >= FixtureChanges::kPause;
    ASSERT_EQ(refused, !due) << i;
    if (!refused) made.push_back(now);
    context.restart();
    context.run();  // the calls fail, since there is no socket
  }
}

}  // namespace
}  // namespace hapticd::tools::view
