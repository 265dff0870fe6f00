// SPDX-License-Identifier: Apache-2.0
// Traces rewritten by other programs, in every form that the specification of MCAP allows; their bytes are
// assembled here without the writer's code.

#include <gtest/gtest.h>
#include <lz4frame.h>

#include <algorithm>
#include <functional>
#include <string>

#include "drivers/trace/messages.h"
#include "drivers/trace/trace_reader.h"
#include "drivers/trace/trace_recovery.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

const std::string kMcapMagic("\x89MCAP0\r\n", 8);

std::string little(std::uint64_t value, std::size_t bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes; ++i, value >>= 8) text.push_back(static_cast<char>(value));
  return text;
}
std::string sizedText(const std::string& text) {
  return little(text.size(), 4) + text;
}
std::string recordOf(unsigned opcode, const std::string& content) {
  return little(opcode, 1) + little(content.size(), 8) + content;
}
std::string headerOf(const std::string& profile) {
  return recordOf(1, sizedText(profile) + sizedText("some other program 1.0"));
}
std::string schemaRecordOf(std::uint16_t id, const std::string& name, const std::string& text) {
  return recordOf(3, little(id, 2) + sizedText(name) + sizedText("ros2msg") + sizedText(text));
}
std::string channelRecordOf(std::uint16_t id, std::uint16_t schema, const std::string& topic) {
  return recordOf(4, little(id, 2) + little(schema, 2) + sizedText(topic) + sizedText("cdr") +
                         sizedText(sizedText("offered_qos_profiles") + sizedText("")));
}
std::string messageOf(std::uint16_t channel, std::uint64_t time_ns, const std::string& data) {
  return recordOf(5, little(channel, 2) + little(0, 4) + little(time_ns, 8) + little(time_ns, 8) + data);
}
std::string metadataOf(const std::string& name,
                       const std::vector<std::pair<std::string, std::string>>& pairs) {
  std::string map;
  for (const auto& [key, value] : pairs) map += sizedText(key) + sizedText(value);
  return recordOf(12, sizedText(name) + sizedText(map));
}
std::string traceMetadata(const std::string& offset_ns = "0") {
  return metadataOf("hapticd_trace", {{"version", "1"}, {"realtime_offset_ns", offset_ns}});
}
std::string ownerMetadata(const std::string& run) {
  return metadataOf("hapticd", {{"hapticd_version", "1.0"}, {"run", run}});
}
/// Returns a chunk without checksums.
std::string chunkOf(std::uint64_t start_ns, std::uint64_t end_ns, const std::string& records,
                    const std::string& compression = "") {
  std::string packed = records;
  if (compression == "lz4") {
    packed.resize(LZ4F_compressFrameBound(records.size(), nullptr));
    packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), records.data(), records.size(), nullptr));
  }
  return recordOf(6, little(start_ns, 8) + little(end_ns, 8) + little(records.size(), 8) + little(0, 4) +
                         sizedText(compression) + little(packed.size(), 8) + packed);
}
/// Returns the end of a file without a summary.
std::string endOf() {
  return recordOf(15, little(0, 4)) + recordOf(2, little(0, 20)) + kMcapMagic;
}

constexpr std::uint16_t kTicks = 700, kTickSchema = 9;
constexpr std::size_t kTickCount = 60;

class OtherWriters : public testing::Test {
 protected:
  static std::string tickDefinitions(std::uint16_t channel = kTicks) {
    return schemaRecordOf(kTickSchema, "hapticd_msgs/msg/Tick", schemaOf<rt::Tick>()) +
           channelRecordOf(channel, kTickSchema, "/hapticd/tick");
  }
  std::uint64_t time_ns(std::size_t tick) const {
    return static_cast<std::uint64_t>(ticks_[tick].planned_ns);
  }
  std::string tick(std::size_t i, std::uint16_t channel = kTicks) const {
    std::string data;
    encode(ticks_[i], time_ns(i), data);
    return messageOf(channel, time_ns(i), data);
  }
  /// Returns a chunk with the records `before` and the ticks from `begin` to `end`.
  std::string tickChunk(std::size_t begin, std::size_t end, const std::string& compression = "",
                        const std::string& before = "") const {
    std::string records = before;
    for (std::size_t i = begin; i < end; ++i) records += tick(i);
    return chunkOf(time_ns(begin), time_ns(end - 1), records, compression);
  }

  /// Reads an intact file and finds every tick in order.
  void expectAllTicks(const std::string& content) const {
    const fs::path file = folder_.write("a.mcap", content);
    std::vector<rt::Tick> read;
    const auto info = readTrace(file, {.tick = [&](const rt::Tick& t) { return read.push_back(t), true; }});
    ASSERT_TRUE(info) << info.error().text();
    EXPECT_TRUE(info->complete);
    EXPECT_EQ(info->ticks_dropped, 0U);
    ASSERT_EQ(read.size(), ticks_.size());
    for (std::size_t i = 0; i < read.size(); ++i)
      ASSERT_EQ(test::bitsOf(read[i]), test::bitsOf(ticks_[i])) << i;
    const auto recovered = recoverTrace(file, folder_.path() / "out.mcap");
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->outcome, RecoveredTrace::Outcome::intact);
  }
  std::string errorOf(const std::string& content) const {
    const auto info = readTrace(folder_.write("a.mcap", content));
    return info ? "" : info.error().text();
  }

  const TemporaryFolder folder_{test::memoryFolder()};
  const std::vector<rt::Tick> ticks_ = test::madeUpRecords(1, kTickCount).ticks;
};

TEST_F(OtherWriters, DefinitionsMayBeInChunksAndMetadataAfterThem) {
  expectAllTicks(kMcapMagic + headerOf("ros2") + tickChunk(0, 30, "", tickDefinitions()) +
                 tickChunk(30, 60, "", tickDefinitions()) + traceMetadata() + endOf());
}

TEST_F(OtherWriters, ChunksMayBeCompressedByLz4) {
  expectAllTicks(kMcapMagic + headerOf("") + traceMetadata() + tickDefinitions() + tickChunk(0, 40, "lz4") +
                 tickChunk(40, 60, "lz4") + endOf());
}

TEST_F(OtherWriters, MessagesMayBeOutsideOfChunksEvenInAdditionToThem) {
  std::string some, all;
  for (std::size_t i = 0; i < 20; ++i) some += tick(i);
  for (std::size_t i = 0; i < kTickCount; ++i) all += tick(i);
  const std::string head = kMcapMagic + headerOf("") + traceMetadata() + tickDefinitions();
  expectAllTicks(head + all + endOf());
  expectAllTicks(head + some + tickChunk(20, 60) + endOf());
}

TEST_F(OtherWriters, MessagesAndChunksMayBeInAnyOrder) {
  std::string backwards, even, odd;
  for (std::size_t i = kTickCount; i-- > 30;) backwards += tick(i);
  for (std::size_t i = 0; i < 30; ++i) (i % 2 == 0 ? even : odd) += tick(i);
  expectAllTicks(kMcapMagic + headerOf("") + traceMetadata() +
                 chunkOf(time_ns(30), time_ns(59), tickDefinitions() + backwards) +
                 chunkOf(time_ns(1), time_ns(29), odd) + chunkOf(time_ns(0), time_ns(28), even) + endOf());
}

TEST_F(OtherWriters, ChunksMayOverlapInTime) {
  std::string even, odd;
  for (std::size_t i = 0; i < kTickCount; ++i) (i % 2 == 0 ? even : odd) += tick(i);
  expectAllTicks(kMcapMagic + headerOf("") + traceMetadata() + tickDefinitions() +
                 chunkOf(time_ns(0), time_ns(58), even) + chunkOf(time_ns(1), time_ns(59), odd) + endOf());
}

TEST_F(OtherWriters, UnknownRecordsAndChannelsAreSkipped) {
  const std::string unknown = recordOf(0x85, "anything") + recordOf(0x20, "");
  const std::string foreign = channelRecordOf(3, 0, "/camera") + messageOf(3, time_ns(0), "image");
  expectAllTicks(kMcapMagic + headerOf("") + unknown + traceMetadata() + metadataOf("other", {}) + unknown +
                 tickChunk(0, 60, "", tickDefinitions() + unknown + foreign) + chunkOf(0, 0, "") + unknown +
                 endOf());
}

TEST_F(OtherWriters, ATopicMayHaveSeveralChannelsOfOneRun) {
  std::string records;
  for (std::size_t i = 0; i < kTickCount; ++i) records += tick(i, i < 25 ? 1 : 2);
  const std::string definitions = tickDefinitions(1) + channelRecordOf(2, kTickSchema, "/hapticd/tick");
  const std::string chunk = chunkOf(time_ns(0), time_ns(59), definitions + records);
  const std::string head = kMcapMagic + headerOf("") + traceMetadata();
  expectAllTicks(head + ownerMetadata("one") + chunk + traceMetadata("20") + ownerMetadata("one") + endOf());

  for (const std::string& other : {ownerMetadata("two"), traceMetadata("7200000000000")}) {
    const std::string error = errorOf(head + ownerMetadata("one") + chunk + other + endOf());
    EXPECT_NE(error.find("several runs"), std::string::npos) << error;
  }
}

TEST_F(OtherWriters, FaultsAreReported) {
  const std::string head = kMcapMagic + headerOf("") + traceMetadata();
  const auto expectError = [&](const std::string& content, const char* part) {
    const std::string error = errorOf(content);
    EXPECT_NE(error.find(part), std::string::npos) << error << " instead of " << part;
  };
  expectError(head + tickChunk(0, 5) + endOf(), "channel 700, which is not defined");
  expectError(head + channelRecordOf(1, 2, "/x") + endOf(), "the schema of channel 1 is missing");
  expectError(head + channelRecordOf(1, 0, "/x") + channelRecordOf(1, 0, "/y") + endOf(),
              "two different definitions");
  expectError(head + tickDefinitions() + chunkOf(time_ns(2), time_ns(3), tick(1)) + endOf(),
              "outside the range of its chunk");
  expectError(head + chunkOf(0, 0, "x", "lz5") + endOf(), "only lz4 and zstd");
  expectError(head + chunkOf(0, 0, recordOf(12, "")) + endOf(), "a record type that a chunk may not contain");
  expectError(head +
                  recordOf(6, little(0, 16) + little(std::uint64_t{1} << 40, 8) + little(0, 4) +
                                  sizedText("zstd") + little(0, 8)) +
                  endOf(),
              "at most 268435456 are accepted");
}

TEST_F(OtherWriters, AFilteredTraceReportsItsMissingChannel) {
  const auto info = readTrace(folder_.write(
      "a.mcap", kMcapMagic + headerOf("") + traceMetadata() + channelRecordOf(3, 0, "/camera") + endOf()));
  ASSERT_TRUE(info) << info.error().text();
  const auto required = info->require("a.mcap", "/hapticd/tick");
  ASSERT_FALSE(required);
  EXPECT_NE(required.error().text().find("/hapticd/tick"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::drivers
