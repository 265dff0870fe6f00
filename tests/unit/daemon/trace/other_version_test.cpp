// SPDX-License-Identifier: Apache-2.0
// Traces of older and newer versions of hapticd, whose messages have other fields than this version's.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "daemon/trace/format/cdr.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/mcap/mcap_writer.h"
#include "daemon/trace/reader/trace_reader.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
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
