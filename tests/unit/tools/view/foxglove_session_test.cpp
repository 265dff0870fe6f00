// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "daemon/trace/format/messages.h"
#include "tests/support/made_up_trace.h"
#include "tools/hapticd-view/live/foxglove_session.h"

// The Foxglove protocol without sockets: what comes from the box goes in, messages come out.
// tests/foxglove does the same with a client that is not of this project.
namespace hapticd::tools::view {
namespace {

TEST(FoxgloveRequest, SubscriptionsAndTheirEndsAreRead) {
  const auto subscribe = parseFoxgloveRequest(
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":0,"channelId":9}]})");
  ASSERT_TRUE(subscribe) << subscribe.error();
  const auto& items = std::get<Subscribe>(*subscribe).items;
  ASSERT_EQ(items.size(), 2U);
  EXPECT_EQ(items[0].subscription, 7U);
  EXPECT_EQ(items[0].channel, 1U);
  EXPECT_EQ(items[1].subscription, 0U);
  const auto unsubscribe = parseFoxgloveRequest(R"({"op":"unsubscribe","subscriptionIds":[7,4294967295]})");
  ASSERT_TRUE(unsubscribe) << unsubscribe.error();
  EXPECT_EQ(std::get<Unsubscribe>(*unsubscribe).subscriptions, (std::vector<std::uint32_t>{7, 4294967295U}));
}

TEST(FoxgloveRequest, ParametersAreAskedForByNameAndNumberOfTheRequest) {
  const auto some = parseFoxgloveRequest(R"({"op":"getParameters","parameterNames":["a"],"id":"x"})");
  ASSERT_TRUE(some);
  EXPECT_EQ(std::get<GetParameters>(*some).names, std::vector<std::string>{"a"});
  EXPECT_EQ(std::get<GetParameters>(*some).id, "x");
  const auto all = parseFoxgloveRequest(R"({"op":"getParameters","parameterNames":[]})");
  ASSERT_TRUE(all);
  EXPECT_TRUE(std::get<GetParameters>(*all).names.empty());
  EXPECT_FALSE(std::get<GetParameters>(*all).id);
}

TEST(FoxgloveRequest, UnknownOperationsAreIgnoredAndThoseThatWouldChangeTheBoxRefused) {
  for (const char* op : {"subscribeConnectionGraph", "subscribeParameterUpdates", "fetchAsset", "x", ""}) {
    const auto request = parseFoxgloveRequest(std::string(R"({"op":")") + op + "\"}");
    ASSERT_TRUE(request) << op;
    EXPECT_TRUE(std::holds_alternative<Ignored>(*request)) << op;
  }
  for (const char* op : {"setParameters", "advertise"}) {
    const auto request = parseFoxgloveRequest(std::string(R"({"op":")") + op + "\"}");
    ASSERT_TRUE(request) << op;
    EXPECT_EQ(std::get<Refused>(*request).operation, op);
  }
}

TEST(FoxgloveRequest, WhatIsNoRequestIsAnError) {
  for (const char* text :
       {"", "{", "null", "[]", "7", R"({"op":7})", "{}", R"({"op":"subscribe","subscriptions":[{"id":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[3]})", R"({"op":"unsubscribe","subscriptionIds":["1"]})",
        R"({"op":"getParameters","parameterNames":[1]})", "\xff\xfe"}) {
    EXPECT_FALSE(parseFoxgloveRequest(text)) << text;
  }
}

constexpr std::int64_t kOffset_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kMillisecond_ns = 1'000'000;

class MadeUpSource final : public Source {
 public:
  int changes = 0;

  Json hello() const override { return {{"type", "hello"}, {"version", "1.2.3"}}; }
  void add(Viewer&) override {}
  void remove(Viewer&) override {}
  void wantsChanged() override { ++changes; }
};

/// Keeps the messages; with `slow` each key's newest one waits for ever.
class MadeUpSink final : public MessageSink {
 public:
  bool slow = false;
  std::vector<Json> texts;
  struct Binary {
    std::uint8_t opcode = 0;
    std::uint32_t subscription = 0;
    std::uint64_t time_ns = 0;
    std::string payload;
    MessageKey key{};
  };
  std::vector<Binary> binaries;

  void send(Message message, MessageKey key) override {
    waiting_.insert(key);
    if (message.is_text) return texts.push_back(Json::parse(message.head));
    ASSERT_EQ(message.head.size(), 13U);
    Binary& binary = binaries.emplace_back();
    binary.opcode = static_cast<std::uint8_t>(message.head[0]);
    std::memcpy(&binary.subscription, message.head.data() + 1, 4);
    std::memcpy(&binary.time_ns, message.head.data() + 5, 8);
    binary.payload.assign(reinterpret_cast<const char*>(message.body.data()), message.body.size());
    binary.key = key;
  }
  bool waits(MessageKey key) const override { return slow && waiting_.contains(key); }
  void withdraw(MessageKey key) override { waiting_.erase(key); }
  void close(std::string_view) override { ADD_FAILURE() << "closed"; }

  /// The newest text message with that operation; null if there is none.
  Json newest(const std::string& op) const {
    for (auto text = texts.rbegin(); text != texts.rend(); ++text) {
      if ((*text)["op"] == op) return *text;
    }
    return {};
  }

 private:
  std::set<MessageKey> waiting_;
};

rt::Tick tickAt(std::int64_t ms, double force_n = 0) {
  rt::Tick tick;
  tick.number = static_cast<std::uint64_t>(ms);
  tick.planned_ns = ms * kMillisecond_ns;
  tick.command_force_n_in_world = {0, force_n, 0};
  return tick;
}

/// A frame of 8 x 8 pixels, all at raw value 800 (1.145 m).
std::shared_ptr<const DepthPicture> pictureAt(std::int64_t ms) {
  DepthPicture picture;
  picture.header.width_px = picture.header.height_px = 8;
  picture.header.stride_bytes = 16;
  picture.header.depth_law_coefficients = {-0.003071102, 3.330949516};
  picture.header.fx_px = picture.header.fy_px = 8;
  picture.header.rotation_world_camera = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  picture.header.arrival_ns = ms * kMillisecond_ns;
  const std::vector<std::uint16_t> raw(64, 800);
  const auto bytes = std::as_bytes(std::span(raw));
  picture.image.assign(bytes.begin(), bytes.end());
  return std::make_shared<const DepthPicture>(picture);
}

class FoxgloveProtocol : public testing::Test {
 protected:
  void subscribe(std::uint32_t subscription, FoxgloveChannel channel) {
    session_.onText(
        Json{{"op", "subscribe"}, {"subscriptions", {{{"id", subscription}, {"channelId", idOf(channel)}}}}}
            .dump());
  }
  void deliverTicks(std::int64_t from_ms, std::int64_t to_ms, double force_n = 0) {
    for (std::int64_t ms = from_ms; ms < to_ms; ++ms) session_.onTick(tickAt(ms, force_n));
  }
  std::vector<std::string> payloadsOf(std::uint32_t subscription) const {
    std::vector<std::string> payloads;
    for (const auto& binary : sink_.binaries) {
      if (binary.subscription == subscription) payloads.push_back(binary.payload);
    }
    return payloads;
  }

  MadeUpSource source_;
  MadeUpSink sink_;
  FoxgloveSession session_{source_, sink_, {"hapticd", "s1"}, [] { return kOffset_ns; }};
};

TEST_F(FoxgloveProtocol, BeginsWithWhatTheServerCanAndWhatItOffers) {
  ASSERT_EQ(sink_.texts.size(), 2U);
  EXPECT_EQ(sink_.texts[0]["op"], "serverInfo");
  EXPECT_EQ(sink_.texts[0]["capabilities"], Json({"parameters"})) << "it must not offer to change anything";
  EXPECT_EQ(sink_.texts[0]["sessionId"], "s1");
  const Json& channels = sink_.texts[1]["channels"];
  ASSERT_EQ(channels.size(), kFoxgloveChannels);
  std::set<std::string> topics;
  std::set<std::uint64_t> ids;
  for (const Json& channel : channels) {
    topics.insert(channel["topic"]);
    ids.insert(channel["id"].get<std::uint64_t>());
    EXPECT_EQ(channel["encoding"], "cdr");
    EXPECT_EQ(channel["schemaEncoding"], "ros2msg");
    EXPECT_FALSE(channel["schema"].get<std::string>().empty());
  }
  EXPECT_EQ(topics.size(), kFoxgloveChannels);
  EXPECT_EQ(ids.size(), kFoxgloveChannels);
  EXPECT_EQ(channels[0]["schema"], trace::schemaOf<rt::Tick>()) << "as in traces";
}

TEST_F(FoxgloveProtocol, MakesNothingThatNobodyHasSubscribedTo) {
  EXPECT_FALSE(session_.wantsTicks());
  EXPECT_FALSE(session_.wantsDepth());
  deliverTicks(0, 100);
  session_.onDepth(pictureAt(0));
  session_.onEvent({{"kind", "mode"}, {"text", "x"}, {"timeNs", 1}, {"priority", "info"}});
  EXPECT_TRUE(sink_.binaries.empty());
  subscribe(1, FoxgloveChannel::tick);
  EXPECT_TRUE(session_.wantsTicks());
  EXPECT_FALSE(session_.wantsDepth());
  EXPECT_EQ(source_.changes, 1);
  session_.onText(R"({"op":"unsubscribe","subscriptionIds":[1]})");
  EXPECT_FALSE(session_.wantsTicks());
  deliverTicks(100, 200);
  EXPECT_TRUE(sink_.binaries.empty());
}

TEST_F(FoxgloveProtocol, ATickIsTheMessageOfATraceWithTheLargestForceOfItsWindow) {
  subscribe(5, FoxgloveChannel::tick);
  deliverTicks(0, 40, 1);
  session_.onTick(tickAt(40, 3));
  deliverTicks(41, 1000, 1);
  const auto payloads = payloadsOf(5);
  EXPECT_LE(payloads.size(), 60U);
  EXPECT_GE(payloads.size(), 58U);
  std::string expected;
  const rt::Tick peak = tickAt(40, 3);
  trace::encode(peak, static_cast<std::uint64_t>(peak.planned_ns + kOffset_ns), expected);
  EXPECT_EQ(std::ranges::count(payloads, expected), 1);
  const auto& first = sink_.binaries.front();
  EXPECT_EQ(first.opcode, 1);
  EXPECT_EQ(first.time_ns % 1000, 0U);
  EXPECT_GE(first.time_ns, static_cast<std::uint64_t>(kOffset_ns));
}

TEST_F(FoxgloveProtocol, ASlowClientLosesTicksButNeitherTheirLargestForceNorTheirCount) {
  subscribe(5, FoxgloveChannel::tick);
  deliverTicks(0, 20);
  sink_.slow = true;
  deliverTicks(20, 500);
  session_.onTick(tickAt(500, 3));
  deliverTicks(501, 1000);
  EXPECT_EQ(payloadsOf(5).size(), 1U);
  EXPECT_GT(session_.dropped(), 50U);
  sink_.slow = false;
  deliverTicks(1000, 1040);
  const rt::Tick peak = tickAt(500, 3);
  std::string expected;
  trace::encode(peak, static_cast<std::uint64_t>(peak.planned_ns + kOffset_ns), expected);
  const auto payloads = payloadsOf(5);
  ASSERT_GE(payloads.size(), 2U);
  EXPECT_EQ(payloads[1], expected);
  for (int status = 0; status < 10; ++status) session_.onStatus(Json::object());
  EXPECT_EQ(sink_.newest("status")["id"], "dropped");
}

TEST_F(FoxgloveProtocol, CloudsAreDecimatedAndLimitedInRateAndTheOthersComeWithEachFrame) {
  subscribe(1, FoxgloveChannel::cloud);
  subscribe(2, FoxgloveChannel::cloud_reach);
  subscribe(3, FoxgloveChannel::depth_image);
  subscribe(4, FoxgloveChannel::camera_calibration);
  session_.onStatus(
      {{"scene", {{"ballCentreMInWorld", {{"x", 0}, {"y", 0}, {"z", -1}}}, {"ballRadiusM", 100}}}});
  for (int frame = 0; frame < 30; ++frame) session_.onDepth(pictureAt(1000 + frame * 100 / 3));
  EXPECT_EQ(payloadsOf(1).size(), 10U);
  EXPECT_EQ(payloadsOf(2).size(), 30U);
  EXPECT_EQ(payloadsOf(3).size(), 30U);
  EXPECT_EQ(payloadsOf(4).size(), 30U);
  constexpr std::size_t kPoint = 12;
  EXPECT_EQ(payloadsOf(2)[0].size() - payloadsOf(1)[0].size(), kPoint * (8 * 8 - 2 * 2));
}

TEST_F(FoxgloveProtocol, TheReachFollowsTheHandAndIsSmallWhereTheWholeFrameIsModelled) {
  subscribe(2, FoxgloveChannel::cloud_reach);
  const auto ball = [](const Json& radius) {
    return Json{{"scene", {{"ballCentreMInWorld", {{"x", 9}, {"y", 9}, {"z", 9}}}, {"ballRadiusM", radius}}}};
  };
  rt::Tick at_surface = tickAt(0);
  at_surface.hip_m_in_world = {0, 0, -1.145};
  session_.onTick(at_surface);
  session_.onStatus(ball(0.3));
  session_.onDepth(pictureAt(0));
  session_.onStatus(ball(nullptr));
  session_.onDepth(pictureAt(33));
  const auto payloads = payloadsOf(2);
  ASSERT_EQ(payloads.size(), 2U);
  EXPECT_GT(payloads[0].size(), payloads[1].size())
      << "the points around the hand, although the ball is older";
}

TEST_F(FoxgloveProtocol, TheCamerasPoseComesWithTheFirstFrameAndNoFurtherOneIsNeeded) {
  subscribe(1, FoxgloveChannel::transforms);
  EXPECT_TRUE(session_.wantsDepth());
  session_.onDepth(pictureAt(0));
  EXPECT_FALSE(session_.wantsDepth());
  EXPECT_EQ(payloadsOf(1).size(), 1U);
  EXPECT_EQ(source_.changes, 1) << "it must not end the frames while it delivers one";
  session_.onStatus(Json::object());
  EXPECT_EQ(source_.changes, 2);
  EXPECT_EQ(payloadsOf(1).size(), 2U);
  session_.onBox(false, "gone");
  EXPECT_TRUE(session_.wantsDepth()) << "the box may come back with another camera";
}

TEST_F(FoxgloveProtocol, EventsFromBeforeComeWithTheSubscription) {
  session_.onEvent(
      {{"kind", "mode"}, {"text", "engaged"}, {"timeNs", kOffset_ns + 2}, {"priority", "warning"}});
  subscribe(1, FoxgloveChannel::events);
  ASSERT_EQ(sink_.binaries.size(), 1U);
  EXPECT_EQ(sink_.binaries[0].time_ns, static_cast<std::uint64_t>(kOffset_ns) + 2);
  EXPECT_EQ(sink_.binaries[0].payload[12], 30) << "the level of warnings";
  EXPECT_NE(sink_.binaries[0].payload.find("engaged"), std::string::npos);
  EXPECT_EQ(sink_.binaries[0].key, MessageKey::queued);
}

TEST_F(FoxgloveProtocol, ParametersAreAnsweredAllOrByNameAndAsSoonAsTheyAreKnown) {
  session_.onText(R"({"op":"getParameters","parameterNames":[],"id":"all"})");
  EXPECT_TRUE(sink_.newest("parameterValues").is_null());
  session_.onParameters({{"force.radius_m", 0.02}, {"force.law", "surface"}, {"x.on", true}});
  const Json all = sink_.newest("parameterValues");
  EXPECT_EQ(all["id"], "all");
  ASSERT_EQ(all["parameters"].size(), 3U);
  EXPECT_EQ(all["parameters"][0], Json({{"name", "force.radius_m"}, {"value", 0.02}, {"type", "float64"}}));
  session_.onText(R"({"op":"getParameters","parameterNames":["force.law","absent"]})");
  const Json some = sink_.newest("parameterValues");
  EXPECT_FALSE(some.contains("id"));
  EXPECT_EQ(some["parameters"], Json::array({{{"name", "force.law"}, {"value", "surface"}}}));
}

TEST_F(FoxgloveProtocol, RequestsForParametersThatWaitAreLimitedInBytesAndTheNewestAreAnswered) {
  const auto request = [&](int number, std::size_t names) {
    Json message{{"op", "getParameters"}, {"parameterNames", Json::array()}, {"id", std::to_string(number)}};
    for (std::size_t i = 0; i < names; ++i) message["parameterNames"].push_back("p");
    session_.onText(message.dump());
  };
  constexpr std::size_t kNames = 100;
  constexpr int kRequests = 50;
  static_assert(kRequests < FoxgloveSession::kMaxWaiting, "their number is no reason to leave any out");
  for (int i = 0; i < kRequests; ++i) request(i, kNames);
  EXPECT_NE(sink_.newest("status").value("message", "").find("left out"), std::string::npos);
  session_.onParameters({{"p", 1}});
  std::vector<int> answered;
  for (const Json& text : sink_.texts) {
    if (text["op"] == "parameterValues") answered.push_back(std::stoi(text["id"].get<std::string>()));
  }
  ASSERT_FALSE(answered.empty());
  EXPECT_LE(answered.size() * kNames * sizeof(std::string), FoxgloveSession::kMaxWaitingBytes);
  EXPECT_EQ(answered.back(), kRequests - 1);
  EXPECT_EQ(answered.front(), kRequests - static_cast<int>(answered.size())) << "the newest, in their order";

  session_.onBox(false, "gone");
  const std::size_t texts = sink_.texts.size();
  request(kRequests, kNames);
  EXPECT_EQ(sink_.texts.size(), texts + 1) << "what is known is answered at once";
}

TEST_F(FoxgloveProtocol, NothingWaitsForASubscriptionThatHasEnded) {
  sink_.slow = true;
  for (std::uint32_t id = 0; id < 200; ++id) {
    subscribe(id, FoxgloveChannel::depth_image);
    session_.onDepth(pictureAt(id));
    session_.onText(Json{{"op", "unsubscribe"}, {"subscriptionIds", {id}}}.dump());
  }
  ASSERT_EQ(sink_.binaries.size(), 200U);
  for (const auto& binary : sink_.binaries) EXPECT_FALSE(sink_.waits(binary.key));
}

TEST_F(FoxgloveProtocol, WhatIsWrongIsReportedAndWhatIsUnknownIgnored) {
  const std::size_t before = sink_.texts.size();
  session_.onText(R"({"op":"subscribeConnectionGraph"})");
  EXPECT_EQ(sink_.texts.size(), before);
  session_.onText("no JSON");
  EXPECT_EQ(sink_.newest("status")["level"], 2);
  session_.onText(R"({"op":"setParameters","parameters":[]})");
  EXPECT_EQ(sink_.newest("status")["level"], 1);
  session_.onText(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})");
  EXPECT_EQ(sink_.newest("status")["message"], "there is no channel 99");
  session_.onBox(false, "hapticd is gone");
  EXPECT_EQ(sink_.newest("status")["message"], "hapticd is gone");
  session_.onBox(true, "");
  EXPECT_EQ(sink_.newest("removeStatus")["statusIds"], Json({"box"}));
}

TEST_F(FoxgloveProtocol, SubscriptionsAreLimitedAndEachHasItsOwnMessages) {
  for (std::uint32_t id = 0; id < 100; ++id) subscribe(id, FoxgloveChannel::tick);
  subscribe(3, FoxgloveChannel::scene);
  EXPECT_EQ(sink_.newest("status")["message"], "subscription 3 is in use already");
  deliverTicks(0, 18);
  EXPECT_EQ(sink_.binaries.size(), FoxgloveSession::kMaxSubscriptions);
  std::set<MessageKey> keys;
  for (const auto& binary : sink_.binaries) keys.insert(binary.key);
  EXPECT_EQ(keys.size(), FoxgloveSession::kMaxSubscriptions);
}

TEST_F(FoxgloveProtocol, RandomTicksAreEncodedAsInTraces) {
  subscribe(1, FoxgloveChannel::tick);
  subscribe(2, FoxgloveChannel::scene);
  std::mt19937_64 random(1);
  std::vector<std::string> expected;
  for (std::uint64_t number = 0; number < 2000; number += 17) {  // each in a window of its own
    const rt::Tick tick = test::madeUpTick(random, number);
    session_.onTick(tick);
    trace::encode(tick, static_cast<std::uint64_t>(tick.planned_ns + kOffset_ns), expected.emplace_back());
  }
  expected.pop_back();  // its window has not ended
  EXPECT_EQ(payloadsOf(1), expected);
  EXPECT_EQ(payloadsOf(2).size(), expected.size());
}

TEST(FoxgloveSessions, NameProgramAndVersion) {
  MadeUpSource source;
  MadeUpSink sink;
  makeFoxgloveSession(source, sink);
  EXPECT_EQ(sink.newest("serverInfo")["name"], "hapticd 1.2.3");
}

}  // namespace
}  // namespace hapticd::tools::view
