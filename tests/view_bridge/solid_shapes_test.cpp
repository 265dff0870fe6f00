// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/solid_shapes.h"

#include <gtest/gtest.h>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

// Which shapes hapticd-view asks a box for, and how often.
namespace hapticd::tools::view {
namespace {

using namespace std::chrono_literals;
using boost::asio::local::stream_protocol;
using boost::system::error_code;

/// Knows every solid but "missing".
class StatusService {
 public:
  StatusService(boost::asio::io_context& context, const std::string& path)
      : context_(context), acceptor_(context, stream_protocol::endpoint(path)) {
    accept();
  }
  std::vector<std::string> asked;
  bool knows_missing = false;

 private:
  void accept() {
    auto socket = std::make_shared<stream_protocol::socket>(context_);
    acceptor_.async_accept(*socket, [this, socket](const error_code& error) {
      if (error) return;
      std::string message;
      error_code gone;
      boost::asio::read_until(*socket, boost::asio::dynamic_buffer(message), '\0', gone);
      if (gone) return accept();
      const Json call = Json::parse(message.substr(0, message.find('\0')));
      EXPECT_EQ(call.at("method"), "io.hapticd.Status.GetSolid");
      asked.push_back(call.at("parameters").at("solid"));
      const bool known = knows_missing || asked.back() != "missing";
      std::string reply =
          (known ? Json{{"parameters", {{"source", asked.back() + ".stl"}, {"outline", Json::array()}}}}
                 : Json{{"error", "io.hapticd.Status.NoSolid"}, {"parameters", {{"reason", "is not known"}}}})
              .dump();
      reply.push_back('\0');
      boost::asio::write(*socket, boost::asio::buffer(reply));
      accept();
    });
  }

  boost::asio::io_context& context_;
  stream_protocol::acceptor acceptor_;
};

Json fixturesOf(const std::vector<std::string>& solids) {
  Json fixtures = Json::array({{{"name", "nerve"}, {"definition", {{"kind", "sphere"}}}}});
  for (const std::string& solid : solids)
    fixtures.push_back({{"name", "organ"}, {"definition", {{"kind", "solid"}, {"solid", solid}}}});
  return fixtures;
}

struct Link {
  /// Goes on until the service has been asked so often and the box has been heard so often.
  void runUntil(std::size_t asked, std::size_t heard) {
    while ((service.asked.size() < asked || changes.size() < heard) && context.run_one_for(10s) > 0) {
    }
    context.run_for(10ms);  // what must not follow would come at once
  }

  test::TemporaryFolder folder;
  boost::asio::io_context context;
  StatusService service{context, folder.path() / "Status"};
  std::vector<Json> changes;
  SolidShapes shapes{context, folder.path() / "Status", [this](const Json& all) { changes.push_back(all); }};
};

using Texts = std::vector<std::string>;

TEST(SolidShapes, AsksForEachSolidOnceAndTellsThemTogether) {
  Link link;
  link.shapes.follow(fixturesOf({"a", "b", "a"}));
  link.runUntil(2, 1);
  EXPECT_EQ(link.service.asked, (Texts{"a", "b"}));
  ASSERT_EQ(link.changes.size(), 1U);
  EXPECT_EQ(link.changes[0].size(), 2U);
  EXPECT_EQ(link.changes[0]["b"]["source"], "b.stl");
  link.shapes.follow(fixturesOf({"b", "a", "c"}));
  link.runUntil(3, 2);
  EXPECT_EQ(link.service.asked, (Texts{"a", "b", "c"}));
  EXPECT_EQ(link.changes.back().size(), 3U);
}

TEST(SolidShapes, ForgetsWhatNoFixtureHasAnyLonger) {
  Link link;
  link.shapes.follow(fixturesOf({"a", "b"}));
  link.runUntil(2, 1);
  link.shapes.follow(fixturesOf({"b"}));
  EXPECT_EQ(link.shapes.shapes().size(), 1U);
  EXPECT_TRUE(link.shapes.shapes().contains("b"));
  link.shapes.follow(Json());
  EXPECT_TRUE(link.shapes.shapes().empty());
}

TEST(SolidShapes, AsksAgainForWhatTheBoxCouldNotShowOnceFixturesChange) {
  Link link;
  link.shapes.follow(fixturesOf({"missing", "a"}));
  link.runUntil(2, 1);
  EXPECT_EQ(link.service.asked, (Texts{"missing", "a"}));
  EXPECT_FALSE(link.shapes.shapes().contains("missing"));
  link.service.knows_missing = true;
  link.shapes.follow(fixturesOf({"missing", "a"}));
  link.runUntil(3, 2);
  EXPECT_EQ(link.service.asked, (Texts{"missing", "a", "missing"}));
  EXPECT_TRUE(link.changes.back().contains("missing"));
}

TEST(SolidShapes, DropsWhatIsUnderWayWhenItForgets) {
  Link link;
  link.shapes.follow(fixturesOf({"a"}));
  link.shapes.forget();
  link.context.run_for(50ms);
  EXPECT_TRUE(link.changes.empty());
  EXPECT_TRUE(link.shapes.shapes().empty());
}

}  // namespace
}  // namespace hapticd::tools::view
