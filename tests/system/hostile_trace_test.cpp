// SPDX-License-Identifier: Apache-2.0
// Files of which every part is allowed by the format, and which take far more memory or time than their size:
// the programs that read traces refuse them or get along, in memory and time that follow from the size.

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "daemon/trace/format/messages.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/reader/trace_folder.h"
#include "tests/support/raw_mcap.h"
#include "tests/support/sanitizer.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd {
namespace {

namespace fs = std::filesystem;
using namespace test::raw_mcap;
using test::Program;

constexpr std::size_t kMega = 1'000'000;
// As many as are read of a file as small as these become.
constexpr std::size_t kMaxEvents = 350;
constexpr std::size_t kMaxDirectives = 1500;

std::string repeated(const std::string& text, std::size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

std::string beginOf() {
  return kMcapMagic + headerOf("") + traceMetadata() + ownerMetadata("one");
}

/// Returns the definition of the ticks of a version that knows these fields only, and of nothing else.
std::string ticksWith(const std::string& fields) {
  return schemaRecordOf(1, "hapticd_msgs/msg/Tick", fields) + channelRecordOf(1, 1, "/hapticd/tick");
}
template <typename Record>
std::string channelFor(std::uint16_t id) {
  const auto& [topic, schema] = trace::kChannelName<Record>;
  return schemaRecordOf(id, std::string(schema), trace::schemaOf<Record>()) +
         channelRecordOf(id, id, std::string(topic));
}
template <typename Record>
std::string messageWith(std::uint16_t id, const Record& record) {
  std::string data;
  trace::encode(record, 0, data);
  return messageOf(id, 0, data);
}

std::string constantsInEachField() {
  std::string fields;
  for (int i = 0; i < 700; ++i) fields += "uint8 A=255\nuint8 a" + std::to_string(i) + "\n";
  std::string bytes = beginOf() + schemaRecordOf(1, "hapticd_msgs/msg/Tick", fields);
  for (std::uint16_t id = 1; id <= 300; ++id) bytes += channelRecordOf(id, 1, "/hapticd/tick");
  return bytes + endOf();
}
std::string oneSchemaForAllChannels() {
  std::string fields;
  for (int i = 0; i < 900; ++i) fields += "uint8 a" + std::string(200, 'a') + std::to_string(i) + "\n";
  std::string bytes = beginOf() + schemaRecordOf(1, "hapticd_msgs/msg/Tick", fields);
  for (std::uint16_t id = 1; id <= 60'000; ++id) bytes += channelRecordOf(id, 1, "/hapticd/tick");
  return bytes + endOf();
}
std::string smallMessages() {
  const std::string tick = messageOf(1, 0, std::string("\0\1\0\0\0", 5));
  return beginOf() + ticksWith("uint8 x\n") + chunkOf(0, 0, repeated(tick, 6 * kMega), "zstd") + endOf();
}
std::string manyChunksOfSmallMessages() {
  const std::string tick = messageOf(1, 0, std::string("\0\1\0\0\0", 5));
  const std::string chunk = chunkOf(0, 0, repeated(tick, kMega), "zstd");
  return beginOf() + ticksWith("uint8 x\n") + repeated(chunk, 30) + endOf();
}
std::string eventsOfEmptyTexts(std::size_t count) {
  const std::string event = messageWith(1, trace::EventRecord{.fields = Pairs(20)});
  return beginOf() + channelFor<trace::EventRecord>(1) + chunkOf(0, 0, repeated(event, count), "zstd") +
         endOf();
}
std::string emptyDirectives(std::size_t count) {
  const std::string tick = messageOf(2, 0, std::string("\0\1\0\0\0", 5));
  const std::string directive = messageWith(1, trace::DirectiveRecord{});
  return beginOf() + channelFor<trace::DirectiveRecord>(1) +
         schemaRecordOf(2, "hapticd_msgs/msg/Tick", "uint8 x\n") + channelRecordOf(2, 2, "/hapticd/tick") +
         chunkOf(0, 0, tick + repeated(directive, count), "zstd") + endOf();
}
std::string aParameterForEachDirective() {
  std::string directives;
  for (int i = 0; i < 30'000; ++i)
    directives += messageWith(1, trace::DirectiveRecord{.parameters = {{std::to_string(i), "1"}}});
  return beginOf() + channelFor<trace::DirectiveRecord>(1) + chunkOf(0, 0, directives, "zstd") + endOf();
}
std::string changesOf(const std::string& field, std::uint64_t one, std::uint64_t other) {
  std::string ticks;
  for (std::uint64_t i = 0; i < 200'000; ++i) {
    const std::uint64_t value = i % 2 == 0 ? one : other;
    const std::string data = std::string("\0\1\0\0", 4) + little(field == "planned_ns" ? value : i, 8) +
                             little(field == "planned_ns" ? 1 : value, 1);
    ticks += messageOf(1, i, data);
  }
  // the contact state is 1 in one, and the mode changes in the other
  const std::string byte = field == "planned_ns" ? "contact" : field;
  const std::string words = byte == "contact" ? "uint8 CONTACT_FREE=0\nuint8 CONTACT_CONTACT=1\n"
                                              : "uint8 MODE_IDLE=0\nuint8 MODE_ENGAGED=1\n";
  return beginOf() + ticksWith("int64 planned_ns\n" + words + "uint8 " + byte + "\n") +
         chunkOf(0, 199'999, ticks, "zstd") + endOf();
}
std::string fieldsWithoutBytes() {
  std::string fields;
  for (int i = 0; i < 100'000; ++i) fields += "bool[0] a" + std::to_string(i) + "\n";
  return beginOf() + ticksWith(fields) +
         chunkOf(0, 0, repeated(messageOf(1, 0, std::string("\0\1\0\0", 4)), 100'000), "zstd") + endOf();
}
std::string metadataOnly() {
  std::string bytes = beginOf();
  for (std::size_t i = 0; i < kMega; ++i) bytes += metadataOf(std::to_string(i), {});
  return bytes;
}
std::string channelsOnly() {
  std::string bytes = beginOf();
  std::string messages;
  for (std::uint16_t id = 1; id < 65'535; ++id) {
    bytes += channelRecordOf(id, 0, "/" + std::to_string(id));
    messages += messageOf(id, 0, "");
  }
  return bytes + chunkOf(0, 0, messages);
}
/// Chunks whose length reaches to the end of the data, and a summary that names them all.
std::string falseChunks() {
  constexpr std::size_t kChunks = 60'000, kHead = 9, kFill = 300;
  std::string bytes = beginOf(), summary;
  const std::size_t data_end = bytes.size() + kChunks * (kHead + kFill);
  for (std::size_t i = 0; i < kChunks; ++i) {
    const std::size_t at = bytes.size();
    bytes += "\6" + little(data_end - at - kHead, 8) + std::string(kFill, '\0');
    summary +=
        recordOf(8, little(0, 16) + little(at, 8) + little(data_end - at, 8) + little(0, 4 + 8 + 4 + 16));
  }
  bytes += recordOf(15, little(0, 4));
  const std::string footer = recordOf(2, little(bytes.size(), 8) + little(0, 8) + little(0, 4));
  const std::uint32_t crc = trace::mcap::crcOf(summary + footer.substr(0, footer.size() - 4));
  return bytes + summary + footer.substr(0, footer.size() - 4) + little(crc, 4) + kMcapMagic;
}
std::string falseChunksWithoutSummary() {
  constexpr std::size_t kChunks = 30'000, kHead = 9, kFill = 300;
  std::string bytes = beginOf() + std::string(1, '\0');  // no record begins so
  const std::size_t end = bytes.size() + kChunks * (kHead + kFill);
  while (bytes.size() < end) bytes += "\6" + little(end - bytes.size() - kHead, 8) + std::string(kFill, '\0');
  return bytes;
}
std::string endsOfData() {
  return beginOf() + std::string(20 * kMega, '\5') + repeated(recordOf(15, little(1, 4)), 100'000) +
         repeated(recordOf(2, little(8, 8) + little(0, 8) + little(1, 4)), 100'000);
}
std::string reversedIndexes() {
  constexpr std::size_t kMessages = 300'000;
  std::string messages, places;
  for (std::uint64_t i = 0; i < kMessages; ++i) messages += messageOf(1, i, std::string("\0\1\0\0\0", 5));
  for (std::uint64_t i = kMessages; i-- > 0;)
    places += little(i, 8) + little(i * messages.size() / kMessages, 8);
  return beginOf() + ticksWith("uint8 x\n") + chunkOf(0, kMessages - 1, messages) +
         recordOf(7, little(1, 2) + sizedText(places));
}

struct Hostile {
  const char* name;
  std::function<std::string()> bytes;
};
void PrintTo(const Hostile& hostile, std::ostream* to) {
  *to << hostile.name;
}

const Hostile kHostile[] = {
    {"ConstantsInEachField", constantsInEachField},
    {"OneSchemaForAllChannels", oneSchemaForAllChannels},
    {"SmallMessages", smallMessages},
    {"ManyChunksOfSmallMessages", manyChunksOfSmallMessages},
    {"EventsOfEmptyTexts", [] { return eventsOfEmptyTexts(kMega / 2); }},
    {"AsManyEventsAsAreRead", [] { return eventsOfEmptyTexts(kMaxEvents); }},
    {"EmptyDirectives", [] { return emptyDirectives(kMega); }},
    {"AsManyDirectivesAsAreRead", [] { return emptyDirectives(kMaxDirectives); }},
    {"AParameterForEachDirective", aParameterForEachDirective},
    {"ChangesOfMode", [] { return changesOf("mode", 0, 1); }},
    {"ChangesOfTime", [] { return changesOf("planned_ns", 0, std::numeric_limits<std::int64_t>::max()); }},
    {"FieldsWithoutBytes", fieldsWithoutBytes},
    {"MetadataOnly", metadataOnly},
    {"ChannelsOnly", channelsOnly},
    {"FalseChunks", falseChunks},
    {"FalseChunksWithoutSummary", falseChunksWithoutSummary},
    {"EndsOfData", endsOfData},
    {"ReversedIndexes", reversedIndexes},
};

class HostileTrace : public testing::TestWithParam<Hostile> {
 protected:
  HostileTrace() : bytes_(GetParam().bytes()), file_(folder_.write("a.mcap", bytes_)) {}

  /// What a program takes for itself, what may be held of the file with an entry for each of its messages,
  /// and the records outside of chunks.
  std::size_t mostBytes() const {
    using namespace trace::mcap;
    return 50 * kMega + 3 * mostInChunk(bytes_.size()) + 4 * bytes_.size();
  }

  void expectModest(const std::string& what, std::vector<std::string> command) {
    Program program(command);
    const test::Ending ending = program.wait();
    EXPECT_TRUE(ending.exited) << what << ": " << ending << ", " << program.errors();
    if (!test::kMemoryOfSanitizer) {
      EXPECT_LE(program.peakMemoryBytes(), mostBytes()) << what << " of " << bytes_.size() << " bytes";
    }
  }

  const test::TemporaryFolder folder_;
  const std::string bytes_;
  const fs::path file_;
};
INSTANTIATE_TEST_SUITE_P(Kinds, HostileTrace, testing::ValuesIn(kHostile),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(HostileTraceOfTheLargestKind, IsRead) {
  const test::TemporaryFolder folder;
  for (const std::string& bytes : {eventsOfEmptyTexts(kMaxEvents), emptyDirectives(kMaxDirectives)}) {
    const test::Finished info =
        test::runToEnd(test::hapticctlCommand({"trace", "info", folder.write("a.mcap", bytes).string()}));
    EXPECT_EQ(info.ending, test::exitedWith(0)) << info.errors;
  }
}

TEST_P(HostileTrace, IsReadInTheMemoryAndTimeOfItsSize) {
  const std::string file = file_.string(), out = folder_.path() / "out";
  expectModest("info", test::hapticctlCommand({"trace", "info", file}));
  expectModest("recover", test::hapticctlCommand({"trace", "recover", file, "--out", out + ".mcap"}));
  for (const char* channel : {"ticks", "models", "directives", "events"}) {
    expectModest(std::string("export ") + channel,
                 test::hapticctlCommand(
                     {"trace", "export", file, "--channel", channel, "--out", out + "-" + channel + ".csv"}));
  }
  expectModest("replay", test::hapticReplayCommand({"--trace", file}));
  expectModest("palpate", {HAPTIC_PALPATE_PROGRAM, file});
}

/// The daemon finishes what a crash has left, whatever it is.
TEST_P(HostileTrace, LeftByACrashDoesNotHarmTheDaemon) {
  const test::DaemonHome home;
  fs::create_directories(home.traceFolder());
  fs::copy_file(file_, home.traceFolder() / "a.mcap.part");
  test::Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(test::becomesTrue([&] {
    const auto trace = daemon.status().at("trace");
    return trace::openTraces(home.traceFolder()).empty() || !trace.at("problems").empty();
  }));
  EXPECT_EQ(daemon.terminate(), test::exitedWith(0));
}

TEST(OutOfMemory, IsAnErrorAndNotASignal) {
  if (test::kMemoryOfSanitizer) GTEST_SKIP() << "sanitizers take any amount of address space";
  const test::TemporaryFolder folder;
  const std::string data(200 * kMega, 'x');
  const fs::path file =
      folder.write("a.mcap", beginOf() +
                                 recordOf(9, little(0, 16) + sizedText("a") + sizedText("b") +
                                                 little(data.size(), 8) + data + little(0, 4)) +
                                 endOf());
  const test::ProgramOptions little_memory{.largest_memory_bytes = 150 * kMega};
  for (const std::vector<std::string>& command :
       {test::hapticctlCommand({"trace", "info", file}), test::hapticctlCommand({"trace", "recover", file}),
        test::hapticReplayCommand({"--trace", file})}) {
    const test::Finished finished = test::runToEnd(command, little_memory);
    EXPECT_TRUE(finished.ending.exited && finished.ending.code != 0) << finished.ending << finished.errors;
    EXPECT_TRUE(test::contains(finished.errors, "more memory than there is"));
  }
}

}  // namespace
}  // namespace hapticd
