// SPDX-License-Identifier: Apache-2.0
// Content of trace files: the bytes as a file, as the records of a chunk in an otherwise valid file, and as a
// message of each channel.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "daemon/trace/writer/trace_writer.h"
#include "tests/fuzz/seeds.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/raw_mcap.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
namespace trace = hapticd::trace;
namespace mcap = trace::mcap;

const fs::path& folder() {
  static const hapticd::test::TemporaryFolder own(hapticd::test::memoryFolder());
  return own.path();
}

/// Recovery only reads the file, finds nothing wrong with a readable one, and names damage if it writes a new
/// file.
void readAndRecover(std::string_view bytes) {
  const fs::path file = folder() / "input.mcap", out = folder() / "out.mcap";
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << bytes << std::flush;
  require(stream.good());
  const auto info = trace::readTrace(file);
  if (info) require(info->complete && info->bytes == bytes.size());
  const auto recovered = trace::recoverTrace(file, out);
  require(fs::file_size(file) == bytes.size());
  if (info) require(recovered && recovered->outcome == trace::RecoveredTrace::Outcome::intact);
  if (recovered && !fs::exists(out)) require(recovered->outcome == trace::RecoveredTrace::Outcome::intact);
  if (!fs::exists(out)) return;
  require(recovered.has_value() && !recovered->damages.empty());
  fs::remove(out);
}

/// Everything before the chunks of a trace.
const std::string& head() {
  static const std::string bytes = [] {
    const auto writer = trace::TraceWriter::create(folder() / "head.mcap", {});
    require(writer.has_value());
    std::ifstream stream(folder() / "head.mcap.part", std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }();
  return bytes;
}

/// Most inputs would fail at the checksums: the same bytes as a chunk with correct ones.
std::string asChunk(std::string_view records) {
  mcap::ChunkContent content;
  mcap::ChunkContent::of(records, content);
  std::string file = head();
  mcap::addChunk(file, {content.start_ns, content.end_ns, records.size(), mcap::crcOf(records), "", records});
  file += content.indexRecords();
  return file + mcap::Summary().ending(file.size(), mcap::crcOf(file));
}

template <typename Record>
void takeMessage(std::string_view bytes) {
  trace::MessageDecoder<Record> decoder;
  Record record;
  if (!decoder.decode(bytes, record)) return;
  std::string once, twice;
  trace::encode(record, 0, once);
  require(decoder.decode(once, record));
  trace::encode(record, 0, twice);
  require(once == twice);
}

/// An image with arbitrary encoded bytes, plain and compressed with zstd.
void takeImage(std::string_view bytes) {
  trace::DepthDecoder decoder;
  trace::DepthRecord record;
  if (!trace::MessageDecoder<trace::DepthRecord>().decode(bytes, record)) {
    record.header.width_px = 16;
    record.header.height_px = 8;
    record.header.stride_bytes = 32;
    record.image.bytes = bytes;
  }
  std::string image;
  for (const auto encoding : {trace::DepthEncoding::plain, trace::DepthEncoding::above_zstd}) {
    record.encoding = encoding;
    require(!decoder.decode(record, image).empty() || image.size() == record.header.imageBytes());
  }
}

/// A schema of another version, followed by a message.
template <typename Record>
void takeMessageOfOtherVersion(std::string_view bytes) {
  const std::string_view schema = bytes.substr(0, bytes.find('\0'));
  auto decoder = trace::MessageDecoder<Record>::forSchema(schema);
  Record record;
  if (decoder) (void)decoder->decode(bytes.substr(std::min(schema.size() + 1, bytes.size())), record);
}

template <typename Record>
std::string encoded(const Record& record) {
  std::string message;
  trace::encode(record, 1'000, message);
  return message;
}

/// A message and the same as the content of a chunk.
template <typename Record>
void addMessage(std::vector<std::string>& all, std::uint16_t channel, const Record& record) {
  all.push_back(encoded(record));
  all.push_back(hapticd::test::raw_mcap::messageOf(channel, 1'000, all.back()));
}

/// What another program writes: a channel of its own, an attachment, chunks with and without compression.
std::string foreignTrace(const std::string& metadata) {
  using namespace hapticd::test::raw_mcap;
  const std::string channel = schemaRecordOf(1, "a/msg/B", "uint8 x\n") + channelRecordOf(1, 1, "/foreign");
  const auto messages = [](std::uint64_t from_ns) {
    return messageOf(1, from_ns, "x") + messageOf(1, from_ns + 1'000, std::string(40, 'y'));
  };
  const std::string attachment =
      little(1, 8) + little(2, 8) + sizedText("a") + sizedText("b") + little(4, 8) + "data" + little(0, 4);
  return kMcapMagic + headerOf("x") + metadata + channel + recordOf(9, attachment) + messages(1'000) +
         chunkOf(2'000, 3'000, channel + messages(2'000)) +
         chunkOf(3'000, 4'000, channel + messages(3'000), "lz4") +
         chunkOf(4'000, 5'000, channel + messages(4'000), "zstd") + endOf();
}

/// A file that its writer closed: a chunk, and a summary that tells the places of everything.
std::string closedTrace() {
  using namespace hapticd::test::raw_mcap;
  const std::string schema = schemaRecordOf(1, "a/msg/B", "uint8 x\n");
  const std::string channel = channelRecordOf(1, 1, "/foreign");
  const std::string records = messageOf(1, 1'000, "x") + messageOf(1, 2'000, "y");
  std::string file = kMcapMagic + headerOf("hapticd") + traceMetadata("5") + schema + channel;
  const std::size_t begin = file.size();
  mcap::ChunkContent content;
  require(mcap::ChunkContent::of(records, content));
  const mcap::ChunkRecord chunk{content.start_ns, content.end_ns, records.size(), mcap::crcOf(records), "",
                                records};
  mcap::addChunk(file, chunk);
  mcap::Summary summary;
  summary.add(mcap::Opcode::schema, 0, std::string_view(schema).substr(mcap::kRecordHeadBytes));
  summary.add(mcap::Opcode::channel, 0, std::string_view(channel).substr(mcap::kRecordHeadBytes));
  summary.addChunk(begin, file.size() - begin, chunk, content);
  file += content.indexRecords();
  return file + summary.ending(file.size(), mcap::crcOf(file));
}

/// A message of a schema with other fields than any of ours, and one without the first of them.
std::vector<std::string> messagesOfOtherVersions(const hapticd::rt::Tick& tick) {
  const std::string other =
      "builtin_interfaces/Time stamp\nuint64 number\nuint8 MODE_IDLE=0\nuint8 MODE_ENGAGED=1\nuint8 mode\n"
      "float64[3] hip_m_in_world\nstring note\nhapticd_msgs/NamedText[] fields\nuint8[] memory\nint16 "
      "spare\n";
  std::string older = trace::schemaOf<hapticd::rt::Tick>();
  const std::size_t second_line = older.find('\n') + 1;
  older.erase(second_line, older.find('\n', second_line) + 1 - second_line);
  return {other + '\0' + encoded(tick), older + '\0' + encoded(tick)};
}

}  // namespace

std::vector<std::string> seeds() {
  using namespace hapticd::test::raw_mcap;
  std::mt19937_64 random(1);
  const hapticd::rt::Tick tick = hapticd::test::madeUpTick(random, 1);
  std::vector<std::string> all = messagesOfOtherVersions(tick);
  addMessage(all, 1, tick);
  addMessage(all, 2, hapticd::test::madeUpModel(random));
  addMessage(all, 3, hapticd::test::madeUpDirective(random));
  addMessage(all, 4, hapticd::test::madeUpEvent(random));
  addMessage(all, 5, hapticd::test::madeUpSnapshot(random));
  addMessage(all, 6, hapticd::test::madeUpAdditions(random));
  addMessage(all, 7, hapticd::test::madeUpDepth(random));
  const std::string trace = foreignTrace(traceMetadata("5"));
  all.push_back(trace);
  all.push_back(foreignTrace(""));
  all.push_back(closedTrace());
  all.push_back(trace.substr(0, trace.size() / 2));
  all.push_back(kMcapMagic + headerOf("x") + traceMetadata("5") + endOf());
  all.push_back(kMcapMagic);
  return all;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  readAndRecover(bytes);
  readAndRecover(asChunk(bytes));
  takeMessage<hapticd::rt::Tick>(bytes);
  takeMessage<trace::ModelRecord>(bytes);
  takeMessage<trace::DirectiveRecord>(bytes);
  takeMessage<trace::AdditionsRecord>(bytes);
  takeMessage<trace::PoseRecord>(bytes);
  takeMessage<trace::EventRecord>(bytes);
  takeMessage<trace::SnapshotRecord>(bytes);
  takeMessage<trace::DepthRecord>(bytes);
  takeImage(bytes);
  takeMessageOfOtherVersion<hapticd::rt::Tick>(bytes);
  takeMessageOfOtherVersion<trace::EventRecord>(bytes);
  takeMessageOfOtherVersion<trace::SnapshotRecord>(bytes);
  return 0;
}
