// SPDX-License-Identifier: Apache-2.0
// Traces rewritten by other programs, in every form that the specification of MCAP allows; their bytes are
// assembled here without the writer's code. Traces of older and newer versions of hapticd, whose messages
// have other fields than this version's.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <tuple>

#include "daemon/trace/format/cdr.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/mcap/mcap_writer.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/raw_mcap.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;
using namespace test::raw_mcap;
using test::TemporaryFolder;

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

TEST_F(OtherWriters, AFileOutOfOrderIsRefusedWithThePlaceAndTheToolThatSortsIt) {
  const std::string head = kMcapMagic + headerOf("") + traceMetadata() + tickDefinitions();
  std::string even, odd;
  for (std::size_t i = 0; i < kTickCount; ++i) (i % 2 == 0 ? even : odd) += tick(i);
  const std::string overlapping = head + chunkOf(time_ns(0), time_ns(58), even),
                    backwards = head + tickChunk(30, 60), loose = head + tick(1) + tick(2);
  for (const auto& [before, out_of_order, earlier] :
       {std::tuple{overlapping, chunkOf(time_ns(1), time_ns(59), odd), "0.057000000 s"},
        std::tuple{backwards, tickChunk(0, 30), "0.059000000 s"},
        std::tuple{head, chunkOf(time_ns(3), time_ns(4), tick(4) + tick(3)), "0.001000000 s"},
        std::tuple{loose, tick(0), "0.002000000 s"}}) {
    const std::string content = before + out_of_order + endOf(), error = errorOf(content);
    EXPECT_NE(error.find(fmt::format("at byte {} there is a message {}", before.size(), earlier)),
              std::string::npos)
        << error;
    EXPECT_NE(error.find("mcap sort"), std::string::npos) << error;
    const auto recovered = recoverTrace(folder_.write("a.mcap", content), folder_.path() / "out.mcap");
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->outcome, RecoveredTrace::Outcome::intact) << "nothing is lost";
  }
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

TEST_F(OtherWriters, ATraceWithoutItsMetadataIsReadByItsChannels) {
  constexpr std::uint64_t kOffset_ns = 1'700'000'000'000'000'000;
  std::string records;
  for (std::size_t i = 0; i < kTickCount; ++i) {
    std::string data;
    encode(ticks_[i], 0, data);
    // the log time is that of the other program
    records += recordOf(5, little(kTicks, 2) + little(0, 4) + little(kOffset_ns + 5 + time_ns(i), 8) +
                               little(kOffset_ns + time_ns(i), 8) + data);
  }
  const std::string chunk = chunkOf(kOffset_ns, kOffset_ns + 5 + time_ns(59), tickDefinitions() + records);
  const fs::path file = folder_.write("a.mcap", kMcapMagic + headerOf("") + chunk + endOf());
  std::size_t read = 0;
  const auto info = readTrace(file, {.tick = [&](const rt::Tick&) { return ++read > 0; }});
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(read, kTickCount);
  EXPECT_TRUE(info->metadata_lost);
  EXPECT_EQ(info->realtime_offset_ns, static_cast<std::int64_t>(kOffset_ns));
}

TEST_F(OtherWriters, AFileOfOtherChannelsOnlyIsNoTrace) {
  const std::string definition = channelRecordOf(3, 0, "/camera");
  std::string few, many;
  for (std::uint64_t i = 0; i < 5; ++i) few += messageOf(3, i, "image");
  for (std::uint64_t i = 0; i < 20'000; ++i) many += messageOf(3, i, "image");
  for (const std::string& records : {few, many}) {
    const std::string error =
        errorOf(kMcapMagic + headerOf("") + definition + chunkOf(0, 20'000, records) + endOf());
    EXPECT_NE(error.find("is not a trace of hapticd"), std::string::npos) << error;
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
              "are accepted in a file of this size");
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

namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

constexpr std::uint64_t kWrittenAt_ns = 1'700'000'000'000'000'000;

/// Returns this version's schema with `from` replaced by `to`.
template <typename Record>
std::string changedSchema(const std::string& from, const std::string& to) {
  std::string schema = schemaOf<Record>();
  const std::size_t place = schema.find(from);
  EXPECT_NE(place, std::string::npos) << from << " in " << schema;
  return place == std::string::npos ? schema : schema.replace(place, from.size(), to);
}

/// A model as written by a version without `radius_m` and with two fields unknown to this one.
const char* const kOlderSchema =
    "builtin_interfaces/Time stamp\n"
    "uint64 model\n"
    "string note\n"
    "int64 time_ns\n"
    "float32[3] weights\n"
    "float64[3] centre_m_in_world\n"
    "bool forgot\n"
    "uint32 points\n"
    "================================================================================\n"
    "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

std::string olderMessage() {
  std::string message;
  CdrWriter writer(message);
  writer.number(std::int32_t{1});
  writer.number(std::uint32_t{2});
  writer.number(std::uint64_t{42});
  writer.text("odd length");
  writer.number(std::int64_t{-7});
  for (const float weight : {1.F, 2.F, 3.F}) writer.number(weight);
  for (const double component : {0.1, 0.2, 0.3}) writer.number(component);
  writer.number(true);
  writer.number(std::uint32_t{900});
  return message;
}

TEST(OtherVersion, FieldsAreFoundByTheirNamesAndOthersAreSkipped) {
  auto decoder = MessageDecoder<ModelRecord>::forSchema(kOlderSchema);
  ASSERT_TRUE(decoder) << decoder.error();
  ModelRecord record;
  record.radius_m = 1;
  record.frames = 5;
  ASSERT_TRUE(decoder->decode(olderMessage(), record));
  EXPECT_EQ(record.model, 42U);
  EXPECT_EQ(record.time_ns, -7);
  EXPECT_EQ(record.centre_m_in_world, (rt::Vec3{0.1, 0.2, 0.3}));
  EXPECT_TRUE(record.forgot);
  EXPECT_EQ(record.points, 900U);
  EXPECT_TRUE(std::isnan(record.radius_m)) << "not known";
  EXPECT_EQ(record.frames, 0U);
  EXPECT_EQ(decoder->missing().size(), 11U);
  EXPECT_EQ(std::ranges::count(decoder->missing(), "radius_m"), 1);
}

TEST(OtherVersion, AnIncompleteMessageIsRefused) {
  auto decoder = MessageDecoder<ModelRecord>::forSchema(kOlderSchema);
  ASSERT_TRUE(decoder) << decoder.error();
  const std::string whole = olderMessage();
  ModelRecord record;
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(decoder->decode(whole.substr(0, length), record)) << length;
  }
  EXPECT_FALSE(decoder->decode(whole + "x", record));
}

TEST(OtherVersion, EnumeratorsAreMatchedByName) {
  // a version with another order of laws and one unknown law
  const std::string schema = changedSchema<rt::Tick>(
      "uint8 LAW_NEAREST_SPRINGS=0\nuint8 LAW_SMOOTH_SPRINGS=1\nuint8 LAW_PROXY=2\nuint8 LAW_SURFACE=3\n",
      "uint8 LAW_PROXY=0\nuint8 LAW_NEAREST_SPRINGS=1\nuint8 LAW_SURFACE=2\nuint8 LAW_MAGNETIC=3\n");
  auto decoder = MessageDecoder<rt::Tick>::forSchema(schema);
  ASSERT_TRUE(decoder) << decoder.error();
  const auto decoded = [&](rt::ForceLaw law_as_number, rt::Tick& tick) {
    rt::Tick written;
    written.law = law_as_number;
    std::string message;
    encode(written, kWrittenAt_ns, message);
    return decoder->decode(message, tick);
  };
  rt::Tick tick;
  ASSERT_TRUE(decoded(rt::ForceLaw{0}, tick));
  EXPECT_EQ(tick.law, rt::ForceLaw::proxy);
  ASSERT_TRUE(decoded(rt::ForceLaw{2}, tick));
  EXPECT_EQ(tick.law, rt::ForceLaw::surface);
  EXPECT_EQ(decoder->unknownValue(), "");
  EXPECT_FALSE(decoded(rt::ForceLaw{3}, tick));
  EXPECT_EQ(decoder->unknownValue(), "law");
  EXPECT_TRUE(decoder->missing().empty());
}

TEST(OtherVersion, ASchemaThatCannotBeReadIsRefusedWithTheReason) {
  const auto refusal = [](const std::string& schema) {
    const auto decoder = MessageDecoder<rt::Tick>::forSchema(schema);
    return decoder ? std::string() : decoder.error();
  };
  EXPECT_TRUE(contains(refusal(changedSchema<rt::Tick>("uint32 points_used", "uint64 points_used")),
                       "'points_used' is of the type uint64 there, not uint32"));
  for (const char* line : {"wstring name", "float64[] many", "float64[4097] many", "float64[x] many",
                           "float64[3 many", "nonsense", "uint8 X=256", "uint8 X=", "uint8 X=-1", " "}) {
    EXPECT_TRUE(contains(refusal(schemaOf<rt::Tick>().insert(0, std::string(line) + "\n")), line)) << line;
  }
}

TEST(OtherVersion, ASnapshotIsReadWithoutItsMemory) {
  auto decoder = MessageDecoder<SnapshotRecord>::forSchema(
      changedSchema<SnapshotRecord>("uint64 tick\n", "uint64 tick\nfloat64 warmth\n"));
  ASSERT_TRUE(decoder) << decoder.error();
  std::string message;
  CdrWriter writer(message);
  writer.number(std::int32_t{1});
  writer.number(std::uint32_t{2});
  writer.number(std::int64_t{77});  // time_ns
  writer.number(std::uint64_t{1});
  writer.number(std::uint64_t{2});
  writer.number(0.5);
  writer.number(std::uint32_t{1});
  writer.bytes("memory");
  SnapshotRecord record;
  ASSERT_TRUE(decoder->decode(message, record));
  EXPECT_EQ(record.time_ns, 77);
  EXPECT_FALSE(record.usable);
}

TEST(OtherVersion, ASnapshotOfAnotherLayoutIsNotUsable) {
  std::string message;
  CdrWriter writer(message);
  writer.number(std::int32_t{1});
  writer.number(std::uint32_t{2});
  writer.number(std::int64_t{77});
  writer.number(std::uint64_t{1});
  writer.number(std::uint64_t{2});
  writer.number(std::uint32_t{999});
  writer.bytes("memory");
  SnapshotRecord record;
  ASSERT_TRUE(MessageDecoder<SnapshotRecord>().decode(message, record));
  EXPECT_FALSE(record.usable);
}

class OtherVersionFile : public testing::Test {
 protected:
  using Pairs = std::vector<std::pair<std::string, std::string>>;

  /// Writes a finished file with one channel and one message.
  void write(const std::string& topic, const std::string& schema_name, const std::string& schema,
             const std::string& message, const std::string& format = std::string(kTraceVersion)) {
    const fs::path part = partOf(file_);
    auto file = TraceFile::create(part);
    ASSERT_TRUE(file) << file.error().text();
    mcap::Writer writer(std::move(*file), file_, false);
    writer.addMetadata(kTraceMetadata,
                       Pairs{{std::string(kVersionKey), format}, {std::string(kOffsetKey), "1000"}});
    writer.addMetadata(kOwnerMetadata, Pairs{{std::string(kWriterVersionKey), "0.0.7"}});
    const std::uint16_t channel = writer.addChannel(topic, schema_name, schema);
    ASSERT_TRUE(writer.begin());
    writer.addMessage(channel, 1, kWrittenAt_ns, message);
    const auto finished = writer.finish();
    ASSERT_TRUE(finished) << finished.error().text();
  }
  std::string error() const {
    const auto info = readTrace(file_);
    return info ? "" : info.error().text();
  }

  const TemporaryFolder folder_{test::memoryFolder()};
  const fs::path file_ = folder_.path() / "a.mcap";
};

TEST_F(OtherVersionFile, IsReadAndReportsMissingFields) {
  write("/hapticd/model", "hapticd_msgs/msg/Model", kOlderSchema, olderMessage());
  std::uint64_t model = 0;
  const auto info = readTrace(file_, {.model = [&](const ModelRecord& record) {
                                model = record.model;
                                return true;
                              }});
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(model, 42U);
  EXPECT_EQ(info->models, 1U);
  EXPECT_TRUE(info->lacks("/hapticd/model", "radius_m"));
  EXPECT_FALSE(info->lacks("/hapticd/model", "model"));
  EXPECT_FALSE(info->lacks("/hapticd/tick", "radius_m"));
}

TEST_F(OtherVersionFile, IsRefusedWithItsVersionAndWithoutMentionOfDamageWhereItCannotBeRead) {
  write("/hapticd/tick", "hapticd_msgs/msg/Tick",
        changedSchema<rt::Tick>("uint32 points_used", "uint64 points_used"), "");
  for (const char* part : {"/hapticd/tick", "points_used", "0.0.7", "Foxglove"}) {
    EXPECT_TRUE(contains(error(), part));
  }
  EXPECT_FALSE(contains(error(), "damaged"));
  EXPECT_FALSE(contains(error(), "recover"));
}

TEST_F(OtherVersionFile, IsRefusedWhereAValueOccursThatHasNoNameHere) {
  const std::string schema = changedSchema<rt::Tick>("uint8 LAW_SURFACE=3\n", "uint8 LAW_MAGNETIC=3\n");
  std::string message;
  rt::Tick tick;
  tick.law = rt::ForceLaw::surface;
  encode(tick, kWrittenAt_ns, message);
  write("/hapticd/tick", "hapticd_msgs/msg/Tick", schema, message);
  EXPECT_TRUE(contains(error(), "a law in /hapticd/tick that this version does not know")) << error();
  EXPECT_FALSE(contains(error(), "damaged"));
}

TEST_F(OtherVersionFile, OfAnotherFormatIsRefusedAsSuch) {
  write("/hapticd/tick", "hapticd_msgs/msg/Tick", schemaOf<rt::Tick>(), "", "2");
  EXPECT_TRUE(contains(error(), "a trace of the format \"2\", of which this is 1"));
  EXPECT_TRUE(contains(error(), "0.0.7"));
}

}  // namespace
}  // namespace hapticd::trace
