// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tools/hapticd-view/live/live_session.h"
#include "tools/hapticd-view/live/source.h"

namespace hapticd::tools::view {
namespace {

TEST(ClientMessage, IsNothingWhereItIsNoneOfTheProtocol) {
  for (const std::string& text : std::vector<std::string>{"",
                                                          "{",
                                                          "[]",
                                                          "null",
                                                          "1",
                                                          R"("depth")",
                                                          "{}",
                                                          R"({"type":1})",
                                                          R"({"type":"engage"})",
                                                          R"({"type":"depth"})",
                                                          R"({"type":"depth","maxHz":"30"})",
                                                          R"({"type":"depth","maxHz":-1})",
                                                          R"({"type":"depth","maxHz":1e9})",
                                                          R"({"type":"depth","maxHz":1e999})",
                                                          R"({"type":"depth","maxHz":null})",
                                                          R"({"type":"hand"})",
                                                          R"({"type":"hand","target":[0,0]})",
                                                          R"({"type":"hand","target":[0,0,null]})",
                                                          R"({"type":"hand","target":[1e308,1e308,0]})",
                                                          R"({"type":"hand","target":[0,0,1e999]})",
                                                          R"({"type":"hand","target":{"x":0}})",
                                                          "{\"type\":\"drawn\"}\x01",
                                                          "{\"type\":\"dr\xff\"}",
                                                          std::string(4096, '['),
                                                          std::string(2048, '[') + std::string(2048, ']')}) {
    EXPECT_FALSE(parseClientMessage(text)) << text;
  }
}

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

rt::Tick proxyTick(std::uint64_t number) {
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = static_cast<std::int64_t>(number) * 1'000'000;
  tick.law = rt::ForceLaw::surface;
  tick.contact = rt::ContactState::contact;
  tick.hip_m_in_world = {0.1, 0, -0.8};
  tick.proxy_m_in_world = {0.1, 0, -0.795};
  tick.fixture_proxy_m_in_world = tick.hip_m_in_world;
  tick.command_force_n_in_world = {0, 0, 1.5};
  tick.gain = 0.5;
  tick.scene_frame = 7;
  tick.scene_age_ns = 30'000'000;
  tick.wakeup_latency_ns = 12'000;
  return tick;
}

json messageOf(const TickSummary& summary) {
  return json::parse(summary.message());
}

TEST(TickSummary, ShowsASingleTickAsItIs) {
  TickSummary summary;
  summary.add(proxyTick(42));
  const json expected = {{"type", "window"},
                         {"ticks", 1},
                         {"lost", 0},
                         {"number", 42},
                         {"timeNs", 42'000'000},
                         {"hip", {0.1, 0, -0.8}},
                         {"orientation", nullptr},
                         {"proxy", {0.1, 0, -0.795}},
                         {"force", {0, 0, 1.5}},
                         {"forceMaxN", 1.5},
                         {"penetrationMaxM", messageOf(summary)["penetrationMaxM"]},
                         {"sceneAgeMaxNs", 30'000'000},
                         {"wakeupLatencyMaxNs", 12'000},
                         {"contact", "contact"},
                         {"contactTicks", 1},
                         {"gain", 0.5},
                         {"law", "surface"},
                         {"sceneFrame", 7},
                         {"fixtureContacts", 0},
                         {"nearestFixture", -1},
                         {"fixtureDistanceM", nullptr},
                         {"fixtureProxy", nullptr},
                         {"fixtureForce", {0, 0, 0}},
                         {"guidanceForce", {0, 0, 0}},
                         {"tissueRegion", -1}};
  EXPECT_EQ(messageOf(summary), expected);
  EXPECT_NEAR(messageOf(summary)["penetrationMaxM"].get<double>(), 0.005,
              1e-12);  // rounding of the difference
}

TEST(TickSummary, ShowsHowAToolIsHeldWhereThatIsMeasured) {
  rt::Tick tick = proxyTick(1);
  tick.handle.has_orientation = true;
  tick.handle.orientation_in_world = {0.5, -0.5, 0.5, 0.5};
  TickSummary summary;
  summary.add(tick);
  EXPECT_EQ(messageOf(summary)["orientation"], json({0.5, -0.5, 0.5, 0.5}));
}

TEST(TickSummary, ShowsTheForcesOfFixturesThatAreExerted) {
  rt::Tick tick = proxyTick(1);
  tick.fixtures_in_contact = 5;
  tick.fixture_force_n_in_world = {0, 0, 4};
  tick.guidance_force_n_in_world = {2, 0, 0};
  tick.stiffness_gain = 0.5;
  tick.gain = 0.25;  // half of the ramp
  TickSummary ramping;
  ramping.add(tick);
  EXPECT_EQ(messageOf(ramping)["fixtureForce"], json({0, 0, 2}));
  EXPECT_EQ(messageOf(ramping)["guidanceForce"], json({1, 0, 0}));
  EXPECT_EQ(messageOf(ramping)["fixtureContacts"], 5);
  tick.gain = 0;
  TickSummary idle;
  idle.add(tick);
  EXPECT_EQ(messageOf(idle)["fixtureForce"], json({0, 0, 0}));
  EXPECT_EQ(messageOf(idle)["fixtureContacts"], 0);
}

TEST(TickSummary, KeepsTheLargestValuesOfTicksThatNobodyIsShown) {
  TickSummary summary;
  rt::Tick peak = proxyTick(1);
  peak.command_force_n_in_world = {0, 3, 4};
  peak.proxy_m_in_world = {0.1, 0, -0.77};
  peak.scene_age_ns = 90'000'000;
  peak.wakeup_latency_ns = 800'000;
  summary.add(peak);
  rt::Tick last = proxyTick(2);
  last.contact = rt::ContactState::free;
  last.command_force_n_in_world = {};
  last.proxy_m_in_world = last.hip_m_in_world;
  summary.add(last);
  summary.addLost(3);

  const json message = messageOf(summary);
  EXPECT_EQ(message["ticks"], 2);
  EXPECT_EQ(message["lost"], 3);
  EXPECT_EQ(message["number"], 2);
  EXPECT_EQ(message["force"], json({0, 0, 0}));
  EXPECT_EQ(message["forceMaxN"], 5);
  EXPECT_NEAR(message["penetrationMaxM"].get<double>(), 0.03, 1e-12);
  EXPECT_EQ(message["sceneAgeMaxNs"], 90'000'000);
  EXPECT_EQ(message["wakeupLatencyMaxNs"], 800'000);
  EXPECT_EQ(message["contact"], "free");
  EXPECT_EQ(message["contactTicks"], 1);
}

TEST(TickSummary, HasNoProxyWhereTheLawHasNone) {
  TickSummary summary;
  rt::Tick tick = proxyTick(1);
  tick.law = rt::ForceLaw::nearest_springs;
  summary.add(tick);
  const json message = messageOf(summary);
  EXPECT_TRUE(message["proxy"].is_null());
  EXPECT_TRUE(message["contact"].is_null());
  EXPECT_TRUE(message["penetrationMaxM"].is_null());
  EXPECT_EQ(message["law"], "nearest_springs");
}

TEST(TickSummary, WritesNullForWhatIsNotFinite) {
  TickSummary summary;
  rt::Tick tick = proxyTick(1);
  tick.hip_m_in_world = {kNaN, std::numeric_limits<double>::infinity(), 1};
  tick.gain = kNaN;
  summary.add(tick);
  const json message = messageOf(summary);
  EXPECT_EQ(message["hip"], json({nullptr, nullptr, 1}));
  EXPECT_TRUE(message["gain"].is_null());
  EXPECT_EQ(message["forceMaxN"], 1.5);
}

TEST(TickSummary, IsEmptyUntilSomethingComesAndOnceItIsCleared) {
  TickSummary summary;
  EXPECT_TRUE(summary.empty());
  summary.addLost(1);
  EXPECT_FALSE(summary.empty());
  summary.clear();
  EXPECT_TRUE(summary.empty());
}

std::size_t bytesOf(const RecentEvents& events) {
  std::size_t bytes = 0;
  events.forEach([&](const Json& event) { bytes += event.dump().size(); });
  return bytes;
}

TEST(RecentEvents, AreTheNewestWithinTheirLimits) {
  std::mt19937 random(5);
  RecentEvents events;
  std::vector<Json> all;
  for (int number = 0; number < 500; ++number) {
    // now and then one that has hardly room beside others
    const std::size_t length = random() % (number % 20 == 0 ? 200'000 : 2000);
    all.push_back({{"number", number}, {"text", std::string(length, 'x')}});
    events.add(all.back());
    ASSERT_LE(events.size(), RecentEvents::kMaxEvents);
    ASSERT_LE(bytesOf(events), RecentEvents::kMaxBytes);
    ASSERT_TRUE(events.contains(all.back()));
    const std::size_t next = all.size() - events.size() - 1;  // the newest that is not kept
    if (events.size() == RecentEvents::kMaxEvents || events.size() == all.size()) continue;
    ASSERT_GT(bytesOf(events) + all[next].dump().size(), RecentEvents::kMaxBytes) << "it would have had room";
  }
}

TEST(RecentEvents, KeepNoneThatIsLongerThanAllMayBe) {
  RecentEvents events;
  events.add({{"text", "short"}});
  events.add({{"text", std::string(RecentEvents::kMaxBytes, 'x')}});
  EXPECT_EQ(events.size(), 0U);
  events.add({{"text", "short"}});
  EXPECT_EQ(events.size(), 1U);
}

using namespace std::chrono_literals;

/// Keeps what is sent, as a client that takes it at once or not at all.
class Sink final : public MessageSink {
 public:
  void send(Message message, MessageKey key) override {
    if (key != MessageKey::queued && !takes) {
      waiting[key] = std::move(message);
    } else {
      sent.push_back(std::move(message));
    }
  }
  bool waits(MessageKey key) const override { return waiting.contains(key); }
  void withdraw(MessageKey key) override { waiting.erase(key); }
  void close(std::string_view) override { ADD_FAILURE() << "closed"; }

  /// The texts of that type, oldest first.
  std::vector<Json> texts(const std::string& type) const {
    std::vector<Json> found;
    for (const Message& message : sent) {
      if (!message.is_text) continue;
      const Json parsed = Json::parse(message.head);
      if (parsed.at("type") == type) found.push_back(parsed);
    }
    return found;
  }

  bool takes = true;
  std::vector<Message> sent;
  std::map<MessageKey, Message> waiting;
};

class FakeSource final : public Source {
 public:
  Json hello() const override { return {{"type", "hello"}, {"protocol", 1}}; }
  void add(Viewer&) override {}
  void remove(Viewer&) override {}
  void wantsChanged() override { ++changes; }

  int changes = 0;
};

struct Fixture {
  FakeSource source;
  Sink sink;
  LiveSession::Clock::time_point now{100s};
  LiveSession session{source, sink, [this] { return now; }};
};

rt::Tick tickOf(std::uint64_t number, double force_n) {
  rt::Tick tick;
  tick.number = number;
  tick.command_force_n_in_world = {force_n, 0, 0};
  return tick;
}

std::shared_ptr<DepthPicture> pictureOf(std::uint64_t frame) {
  auto picture = std::make_shared<DepthPicture>();
  picture->header.width_px = 2;
  picture->header.height_px = 1;
  picture->header.stride_bytes = 4;
  picture->header.frame = frame;
  picture->image = {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};
  return picture;
}

TEST(LiveSession, SendsAtMostSixtyWindowsASecondWithEveryTickInOne) {
  Fixture live;
  std::uint64_t number = 0;
  for (int batch = 0; batch < 200; ++batch) {  // 1 s of 5 ms
    for (int i = 0; i < 5; ++i) live.session.onTick(tickOf(++number, 0));
    live.session.onBatchEnd();
    live.now += 5ms;
  }
  const auto windows = live.sink.texts("window");
  EXPECT_LE(windows.size(), 61U);
  EXPECT_GE(windows.size(), 59U);
  std::uint64_t ticks = 0;
  for (const Json& window : windows) ticks += window.at("ticks").get<std::uint64_t>();
  EXPECT_EQ(ticks, windows.back().at("number").get<std::uint64_t>());
}

TEST(LiveSession, SendsTheShapesOfSolidsAndOnlyTheNewest) {
  Fixture live;
  live.session.onSolids({{"a", {{"source", "a.stl"}}}});
  ASSERT_EQ(live.sink.texts("solids").size(), 1U);
  EXPECT_EQ(live.sink.texts("solids")[0].at("solids").at("a").at("source"), "a.stl");
  live.sink.takes = false;
  live.session.onSolids({{"b", 1}});
  live.session.onSolids({{"c", 1}});
  ASSERT_EQ(live.sink.waiting.size(), 1U);
  EXPECT_TRUE(Json::parse(live.sink.waiting.begin()->second.head).at("solids").contains("c"));
}

TEST(LiveSession, MergesWindowsThatAClientDoesNotTake) {
  Fixture live;
  live.sink.takes = false;
  live.session.onTick(tickOf(1, 1));
  live.session.onBatchEnd();
  for (std::uint64_t number = 2; number <= 100; ++number) {
    live.now += 20ms;
    live.session.onTick(tickOf(number, number == 50 ? 4 : 0));
    live.session.onBatchEnd();
  }
  ASSERT_EQ(live.sink.waiting.size(), 1U);
  EXPECT_EQ(Json::parse(live.sink.waiting.begin()->second.head).at("number"), 1);
  live.sink.waiting.clear();
  live.sink.takes = true;
  live.session.onBatchEnd();
  const auto windows = live.sink.texts("window");
  ASSERT_EQ(windows.size(), 1U);
  EXPECT_EQ(windows[0].at("ticks"), 99);
  EXPECT_EQ(windows[0].at("number"), 100);
  EXPECT_EQ(windows[0].at("forceMaxN"), 4);
}

TEST(LiveSession, ShowsAsManyDepthFramesAsTheClientAskedFor) {
  Fixture live;
  live.session.onText(R"({"type":"depth","maxHz":10})");
  EXPECT_EQ(live.source.changes, 1);
  EXPECT_TRUE(live.session.wantsDepth());
  for (int i = 0; i < 90; ++i) {  // 3 s at 30 Hz
    live.session.onDepth(pictureOf(static_cast<std::uint64_t>(i)));
    live.now += 33'333us;
  }
  EXPECT_GE(live.sink.sent.size() - 1, 29U);
  EXPECT_LE(live.sink.sent.size() - 1, 31U);
  live.session.onText(R"({"type":"depth","maxHz":0})");
  EXPECT_FALSE(live.session.wantsDepth());
  EXPECT_EQ(live.source.changes, 2);
}

TEST(LiveSession, SendsTheNewestFrameWhenTheOneBeforeHasBeenDrawn) {
  Fixture live;
  const auto frames = [&live] {
    std::vector<std::uint64_t> numbers;
    for (const Message& message : live.sink.sent) {
      if (message.is_text) continue;
      rt::DepthFrameHeader header;
      std::memcpy(&header, message.head.data() + 8, sizeof header);
      numbers.push_back(header.frame);
    }
    return numbers;
  };
  const auto arrives = [&live](std::uint64_t number) {
    live.now += 50ms;
    live.session.onDepth(pictureOf(number));
  };
  arrives(1);
  arrives(2);  // a client that reports nothing gets each
  EXPECT_EQ(frames(), (std::vector<std::uint64_t>{1, 2}));
  live.session.onText(R"({"type":"drawn"})");
  arrives(3);
  arrives(4);
  arrives(5);
  EXPECT_EQ(frames(), (std::vector<std::uint64_t>{1, 2, 3}));
  live.session.onText(R"({"type":"drawn"})");
  EXPECT_EQ(frames(), (std::vector<std::uint64_t>{1, 2, 3, 5}));
  live.session.onText(R"({"type":"drawn"})");
  EXPECT_EQ(frames().size(), 4U) << "nothing has arrived since";
  arrives(6);
  EXPECT_EQ(frames().back(), 6U);
}

TEST(LiveSession, SendsValidTextWhateverTheBoxWrites) {
  Fixture live;
  live.session.onEvent({{"text", "caf\xe9"}});
  const auto events = live.sink.texts("event");
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].at("event").at("text"), "caf\xef\xbf\xbd");
}

TEST(LiveSession, SaysWhyThereIsNoDepth) {
  Fixture live;
  live.session.onDepthState(false, "no camera");
  const auto depth = live.sink.texts("depth");
  ASSERT_EQ(depth.size(), 1U);
  EXPECT_EQ(depth[0].at("available"), false);
  EXPECT_EQ(depth[0].at("reason"), "no camera");
}

}  // namespace
}  // namespace hapticd::tools::view
