// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/live_session.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace hapticd::tools::view {
namespace {

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
      const Json json = Json::parse(message.head);
      if (json.at("type") == type) found.push_back(json);
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
