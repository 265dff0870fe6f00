// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <boost/asio/buffer.hpp>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "daemon/control/server/varlink_message.h"
#include "daemon/control/streams/tick_streams.h"
#include "daemon/trace/format/messages.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticd-view/box_link/box_source.h"
#include "tools/hapticd-view/box_link/varlink_stream.h"
#include "tools/lib/client/tick_batch.h"

// The view's side of the daemon's socket: a service that never ends its reply, and the columns of ticks.
namespace hapticd::tools::view {
namespace {

using boost::asio::local::stream_protocol;
using boost::system::error_code;

/// Sends a text without end to whoever connects, and counts what is taken.
class EndlessService {
 public:
  EndlessService(boost::asio::io_context& context, const std::string& path)
      : acceptor_(context, stream_protocol::endpoint(path)), socket_(context), text_(65536, 'x') {
    acceptor_.async_accept(socket_, [this](const error_code& error) {
      if (!error) send();
    });
  }
  std::size_t sent() const { return sent_; }

 private:
  void send() {
    socket_.async_write_some(boost::asio::buffer(text_), [this](const error_code& error, std::size_t bytes) {
      sent_ += bytes;
      if (!error) send();
    });
  }

  stream_protocol::acceptor acceptor_;
  stream_protocol::socket socket_;
  std::string text_;
  std::size_t sent_ = 0;
};

TEST(VarlinkStream, EndsAReplyThatNeverEnds) {
  const test::TemporaryFolder folder;
  boost::asio::io_context context;
  const std::string path = folder.path() / "Status";
  const EndlessService service(context, path);
  auto stream = std::make_shared<VarlinkStream>(context, std::chrono::seconds(60));
  std::string reason;
  stream->start(path, "io.hapticd.Status.GetStatus", Json::object(), /*more=*/false,
                {[](const Json&, const base::Descriptor&) { ADD_FAILURE() << "there is no reply"; },
                 [&](const ClientError& error) { reason = error.what; }});
  context.run();
  EXPECT_NE(reason.find("a reply is too long"), std::string::npos) << reason;
  EXPECT_LT(service.sent(), std::size_t{4} * 1024 * 1024) << "1 MiB, and what the kernel holds";
}

/// Keeps the replies as the socket would carry them.
class Received final : public daemon::Replies {
 public:
  void finish(daemon::ConnectionId, const daemon::Reply& reply) override { take(reply); }
  bool offer(daemon::ConnectionId, const daemon::Reply& reply) override {
    take(reply);
    return true;
  }
  std::vector<Json> parameters;

 private:
  void take(const daemon::Reply& reply) {
    const std::string message = daemon::serialise(reply);
    const Json json = Json::parse(message.substr(0, message.size() - 1));
    EXPECT_FALSE(json.contains("error")) << message;
    parameters.push_back(json.at("parameters"));
  }
};

/// No two fields have the same value.
rt::Tick unlikeTick(std::uint64_t number) {
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = 1'000'000'007;
  tick.wakeup_latency_ns = -3;
  tick.compute_ns = 4321;
  tick.mode = rt::Mode::engaged;
  tick.cause = rt::Cause::requested;
  tick.slew_limited = true;
  tick.law = rt::ForceLaw::surface;
  tick.contact = rt::ContactState::entrenched;
  tick.points_used = 17;
  tick.scene_frame = std::numeric_limits<std::uint64_t>::max();
  tick.handle.position_m_in_world = {0.1, 0.2, 1.0 / 3};
  tick.hip_m_in_world = {1e-300, -0.0, 0.7};
  tick.gain = std::nextafter(1.0, 2.0);
  tick.command_force_n_in_world = {0.1 + 0.2, std::numeric_limits<double>::quiet_NaN(), 5};
  return tick;
}

std::string messageOf(const rt::Tick& tick) {
  std::string bytes;
  trace::encode(tick, 0, bytes);
  return bytes;
}

/// The ticks as they come out at the other end of a stream of all fields.
std::vector<rt::Tick> throughTheStream(const std::vector<rt::Tick>& ticks) {
  daemon::TickStreams streams;
  Received received;
  const daemon::Call call{.method = "io.hapticd.Status.Ticks",
                          .parameters = {{"fields", allTickFields()}, {"intervalMs", 5}},
                          .more = true};
  const auto methods = streams.methods();
  methods.front().stream(call, daemon::Caller{.connection = 1}, received);
  for (const rt::Tick& tick : ticks) streams.onTick(tick);
  std::vector<rt::Tick> rebuilt;
  const auto isComplete = [&] {
    streams.feed(received);
    rebuilt.clear();
    for (const Json& reply : received.parameters)
      forEachTick(reply, [&rebuilt](const rt::Tick& tick) { rebuilt.push_back(tick); });
    return rebuilt.size() >= ticks.size();
  };
  while (!isComplete()) continue;  // the stream's interval of 5 ms
  return rebuilt;
}

TEST(TickColumns, GiveTicksWhoseTraceMessagesAreTheSameBytes) {
  const std::vector<rt::Tick> ticks{unlikeTick(1), unlikeTick(2), rt::Tick()};
  const std::vector<rt::Tick> rebuilt = throughTheStream(ticks);
  ASSERT_EQ(rebuilt.size(), ticks.size());
  for (std::size_t i = 0; i < ticks.size(); ++i) EXPECT_EQ(messageOf(rebuilt[i]), messageOf(ticks[i])) << i;
}

TEST(TickColumns, KeepDefaultsForFieldsThatAreMissingOrOfAnotherType) {
  const Json reply = Json::parse(
      R"({"count":2,"ticks":{"number":[5,"six"],"mode":["engaged","unheard_of"],"hip_m_in_world":[[1,2],[1,null,3]],
          "gain":[0.5]},"lostCount":0})");
  std::vector<rt::Tick> ticks;
  forEachTick(reply, [&ticks](const rt::Tick& tick) { ticks.push_back(tick); });
  ASSERT_EQ(ticks.size(), 2U);
  EXPECT_EQ(ticks[0].number, 5U);
  EXPECT_EQ(ticks[1].number, 0U);
  EXPECT_EQ(ticks[0].mode, rt::Mode::engaged);
  EXPECT_EQ(ticks[1].mode, rt::Mode::starting);
  EXPECT_EQ(ticks[0].hip_m_in_world.x, 0);
  EXPECT_EQ(ticks[1].hip_m_in_world.z, 3);
  EXPECT_TRUE(std::isnan(ticks[1].hip_m_in_world.y));
  EXPECT_EQ(ticks[0].gain, 0);  // the list is too short to say whose value it is
}

TEST(TickColumns, AreNothingInAReplyOfAnotherForm) {
  for (const char* text :
       {"{}", R"({"count":2})", R"({"count":-1,"ticks":{}})", R"({"count":1e18,"ticks":{}})",
        R"({"count":"2","ticks":{}})", R"({"count":2,"ticks":[]})"}) {
    forEachTick(Json::parse(text), [&](const rt::Tick&) { ADD_FAILURE() << text; });
  }
}

}  // namespace
}  // namespace hapticd::tools::view
