// SPDX-License-Identifier: Apache-2.0
// The 3D picture in traces: scene, camera and points in channels of their own.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <random>
#include <set>
#include <string>

#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/mcap/mcap_reader.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "daemon/trace/ros/scene_picture.h"
#include "daemon/trace/writer/trace_writer.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/strict_mcap.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;

rt::Tick tickWithForce(std::int64_t ms, double force_n) {
  rt::Tick tick;
  tick.planned_ns = ms * 1'000'000;
  tick.command_force_n_in_world = {0, force_n, 0};
  return tick;
}

TEST(TickDecimator, GivesTheTickWithTheLargestForceOfEachWindowAndOfEqualOnesTheNewest) {
  ros::TickDecimator window(10'000'000);
  std::vector<std::int64_t> shown_ms;
  const std::map<std::int64_t, double> peaks{{3, -2}, {12, 1}, {17, 1}};
  for (std::int64_t ms = 0; ms < 40; ++ms) {
    const auto peak = peaks.find(ms);
    const auto shown = window.add(tickWithForce(ms, peak == peaks.end() ? 0 : peak->second));
    if (shown) shown_ms.push_back(shown->planned_ns / 1'000'000);
  }
  EXPECT_EQ(shown_ms, (std::vector<std::int64_t>{3, 17, 29}));
}

/// Messages by topic.
std::map<std::string, std::vector<std::string>, std::less<>> messagesOf(const fs::path& file) {
  class Counting final : public mcap::Visitor {
   public:
    std::map<std::string, std::vector<std::string>, std::less<>> messages_by_topic;
    void channel(const mcap::Channel& channel) override {
      topics_[channel.id] = channel.topic;
      EXPECT_TRUE(channel.topic.starts_with("/hapticd/")) << channel.topic;
      messages_by_topic[std::string(channel.topic)];
    }
    std::string message(const mcap::Message& message) override {
      messages_by_topic[topics_[message.channel]].emplace_back(message.data);
      return "";
    }

   private:
    std::map<std::uint16_t, std::string> topics_;
  } counting;
  EXPECT_TRUE(mcap::read(file, counting));
  return counting.messages_by_topic;
}

/// Two seconds of ticks and a peak of the force, in chunks of half a second.
fs::path writeTrace(const fs::path& folder, const TraceOptions& options) {
  const fs::path file = folder / "a.mcap";
  auto writer = TraceWriter::create(file, options);
  EXPECT_TRUE(writer);
  EXPECT_TRUE((*writer)->write(DirectiveRecord{.parameters = {{"force.radius_m", "0.0625"}}}));
  EXPECT_TRUE((*writer)->write(ModelRecord{.centre_m_in_world = {1, 2, 3}, .radius_m = 0.75}));
  for (std::int64_t ms = 0; ms < 2000; ++ms) {
    EXPECT_TRUE((*writer)->write(tickWithForce(ms, ms == 1234 ? 3 : 1)));
    if (options.cloud && ms % 33 == 0) {
      EXPECT_TRUE((*writer)->write(CloudRecord{ms * 1'000'000, {1, 2, 3}}));
    }
  }
  EXPECT_TRUE((*writer)->close());
  return file;
}

const TraceOptions kWithScene{.chunk_ns = 500'000'000, .scene = true};

TEST(SceneInTrace, IsThereThirtyTimesASecondWithThePeaksOfTheForceAndTheCameraOnceASecond) {
  const test::TemporaryFolder folder(test::memoryFolder());
  const auto messages = messagesOf(writeTrace(folder.path(), kWithScene));
  const auto& scenes = messages.find(ros::kSceneChannel.topic)->second;
  EXPECT_NEAR(static_cast<double>(scenes.size()), 2 * kSceneRate_hz, 1);
  const auto holds = [](std::string_view text) {
    return [text](const std::string& message) { return message.find(text) != std::string::npos; };
  };
  EXPECT_EQ(std::ranges::count_if(scenes, holds("3.00 N")), 1);
  const double diameter = 2 * 0.0625, reach = 2 * 0.75;
  for (const double size : {diameter, reach}) {
    const std::string bytes(reinterpret_cast<const char*>(&size), sizeof size);
    EXPECT_EQ(std::ranges::count_if(scenes, holds(bytes)), std::ssize(scenes)) << size;
  }
  EXPECT_EQ(messages.find(ros::kTransformsChannel.topic)->second.size(), 2U);
}

TEST(SceneInTrace, LeavesEverythingElseOfTheTraceAsItIs) {
  const test::TemporaryFolder with(test::memoryFolder()), without(test::memoryFolder());
  TraceOptions options = kWithScene;
  auto shown = messagesOf(writeTrace(with.path(), options));
  options.scene = false;
  const auto plain = messagesOf(writeTrace(without.path(), options));
  EXPECT_EQ(shown.erase(std::string(ros::kSceneChannel.topic)), 1U);
  EXPECT_EQ(shown.erase(std::string(ros::kTransformsChannel.topic)), 1U);
  EXPECT_EQ(shown, plain);
}

TEST(SceneInTrace, IsWellFormedAndReadersOfTicksDoNotNoticeIt) {
  const test::TemporaryFolder folder(test::memoryFolder());
  TraceOptions options = kWithScene;
  options.cloud = true;
  const fs::path file = writeTrace(folder.path(), options);
  const test::StrictMcap strict = test::readStrictly(file);
  EXPECT_EQ(strict.allText(), "");
  std::uint64_t ticks = 0;
  const auto info = readTrace(file, {.tick = [&ticks](const rt::Tick&) { return ++ticks, true; }});
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(ticks, 2000U);
  EXPECT_TRUE(info->complete);
  EXPECT_TRUE(info->missing.empty());
  EXPECT_EQ(info->topics.size(), 7U);
}

TEST(SceneInTrace, SurvivesARecovery) {
  const test::TemporaryFolder folder(test::memoryFolder());
  TraceOptions options = kWithScene;
  options.cloud = true;
  const fs::path file = writeTrace(folder.path(), options);
  const auto before = messagesOf(file);
  fs::resize_file(file, fs::file_size(file) - 100);  // within the summary
  const fs::path recovered = folder.path() / "b.mcap";
  ASSERT_TRUE(recoverTrace(file, recovered));
  EXPECT_EQ(messagesOf(recovered), before);
}

TEST(SceneInTrace, ItsChannelsAreThoseOfATraceInEarlierMessagesTooAndOthersOfRos2AreNot) {
  for (const char* schema : {"visualization_msgs/msg/MarkerArray", "foxglove_msgs/msg/SceneUpdate", ""})
    EXPECT_TRUE(isChannelOfTrace(ros::kSceneChannel.topic, schema)) << schema;
  EXPECT_TRUE(isChannelOfTrace("/hapticd/tick", "hapticd_msgs/msg/Tick"));
  EXPECT_FALSE(isChannelOfTrace("/hapticd/measured_cp", "geometry_msgs/msg/PoseStamped"));
  EXPECT_FALSE(isChannelOfTrace("/hapticd/depth/image_raw", "sensor_msgs/msg/Image"));
}

TEST(SceneInTrace, CloudsNeedTheirChannel) {
  const test::TemporaryFolder folder(test::memoryFolder());
  auto writer = TraceWriter::create(folder.path() / "a.mcap", kWithScene);
  ASSERT_TRUE(writer);
  EXPECT_FALSE((*writer)->write(CloudRecord{0, {1, 2, 3}}));
}

}  // namespace
}  // namespace hapticd::trace
