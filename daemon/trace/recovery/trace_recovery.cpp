// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/recovery/trace_recovery.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <string>
#include <utility>

#include "daemon/trace/format/messages.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/mcap/mcap_reader.h"
#include "daemon/trace/mcap/mcap_writer.h"
#include "daemon/trace/mcap/trace_file.h"
#include "daemon/trace/reader/trace_reader.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;
using mcap::IntactChunk;
using mcap::IntactRecord;
using mcap::Opcode;
using Outcome = RecoveredTrace::Outcome;

/// A decompressed chunk of a file.
struct Unpacked {
  std::string record;  ///< content of the record
  std::string records;
  mcap::ChunkRecord chunk;
  mcap::ChunkContent content;

  /// Reads a chunk that was intact when the file was scanned.
  base::Result<void> read(const TraceFile& file, const IntactChunk& whole, mcap::Allowance& allowance) {
    if (auto there =
            file.readAt(whole.offset + mcap::kRecordHeadBytes, whole.bytes - mcap::kRecordHeadBytes, record);
        !there) {
      return there;
    }
    const bool good = mcap::ChunkRecord::of(record, chunk) && chunk.unpack(records, allowance).empty() &&
                      mcap::ChunkContent::of(records, content);
    chunk.start_ns = content.start_ns;
    chunk.end_ns = content.end_ns;
    if (good) return {};
    return base::failure(file.path(), "was modified while it was read", "try again");
  }
};

/// The content of a channel record; if its schema is lost, it has none, and keeps its messages.
std::string withKnownSchema(std::string content, const mcap::Salvage& whole) {
  constexpr std::size_t kSchemaAt = sizeof(std::uint16_t);
  mcap::ChannelRecord channel;
  mcap::ChannelRecord::of(content, channel);
  if (!whole.schemas.contains(channel.schema)) content.replace(kSchemaAt, sizeof channel.schema, 2, '\0');
  return content;
}

/// Adds everything that stands in front of the chunks.
void addHead(mcap::Writer& to, const mcap::Salvage& whole) {
  for (const auto& [id, schema] : whole.schemas) to.add(Opcode::schema, schema.content);
  for (const auto& [id, channel] : whole.channels) {
    to.add(Opcode::channel, withKnownSchema(channel.content, whole));
  }
  for (const std::uint16_t id : whole.used_channels) {
    if (whole.channels.contains(id)) continue;
    std::string record;
    mcap::addChannel(record, id, 0, fmt::format("/lost_channel_{}", id));
    to.add(Opcode::channel, std::string_view(record).substr(mcap::kRecordHeadBytes));
  }
  for (const IntactRecord& metadata : whole.metadata) to.add(Opcode::metadata, metadata.content);
  for (const IntactRecord& attachment : whole.attachments) to.add(Opcode::attachment, attachment.content);
}

base::Result<void> addChunks(mcap::Writer& to, const TraceFile& from, const mcap::Salvage& whole,
                             const mcap::GoesOn& goes_on) {
  mcap::Allowance allowance(whole.file_bytes);
  std::vector<IntactChunk> chunks = whole.chunks;
  std::ranges::stable_sort(chunks, {}, &IntactChunk::start_ns);
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    Unpacked chunk;
    auto written = chunk.read(from, chunks[i], allowance);
    if (written) written = to.addChunk(chunk.chunk, chunk.content);
    if (!written) return written;
    const double done = static_cast<double>(i + 1) / static_cast<double>(chunks.size());
    if (goes_on && !goes_on(done)) return std::unexpected(mcap::interrupted(from.path()));
  }
  return {};
}

/// Writes the intact parts of a file to a new one in the order of time: definitions, metadata and
/// attachments, then chunks with their records unchanged, with new indexes and a new summary. `out` must not
/// exist; while it is being written its name ends in ".rewriting", which hapticd does not treat as an
/// unfinished trace. Errors: system errors, stopped; there is then no new file.
base::Result<void> rewriteTrace(const TraceFile& from, const mcap::Salvage& whole, const fs::path& out,
                                const mcap::GoesOn& goes_on) {
  std::error_code ignored;
  if (fs::exists(out, ignored))
    return base::failure(out, "already exists", "give another name, or move it away");
  const fs::path part = out.string() + ".rewriting";
  if (!isBeingWritten(part)) fs::remove(part, ignored);  // left by an interrupted attempt
  auto file = TraceFile::create(part);
  if (!file) return std::unexpected(file.error());
  mcap::Writer writer(std::move(*file), out, /*compress=*/false, "", mcap::Durable::whole_file);
  addHead(writer, whole);
  auto done = writer.begin();
  if (done) done = addChunks(writer, from, whole, goes_on);
  if (done) done = writer.finish();
  if (!done) fs::remove(part, ignored);
  return done;
}

/// Writes the ending of a file that was never closed after its intact part, which ends at `intact_to`. It may
/// be interrupted at any time and repeated.
base::Result<void> endTrace(TraceFile& file, const mcap::Salvage& whole, std::uint64_t intact_to) {
  mcap::Summary summary = whole.chunk_summary;
  for (const auto& [id, schema] : whole.schemas) summary.add(Opcode::schema, schema.offset, schema.content);
  for (const auto& [id, channel] : whole.channels) {
    summary.add(Opcode::channel, channel.offset, channel.content);
  }
  for (const auto& [offset, content] : whole.metadata) summary.add(Opcode::metadata, offset, content);
  for (const auto& [offset, content] : whole.attachments) summary.add(Opcode::attachment, offset, content);
  const auto crc = mcap::crcOf(file, 0, intact_to);
  if (!crc) return std::unexpected(crc.error());
  std::string ending = whole.missing_indexes;
  ending += summary.ending(intact_to + ending.size(), mcap::crcOf(ending, *crc));
  auto done = file.truncate(intact_to);
  if (done) done = file.writeAt(intact_to, ending);
  if (done) done = file.synchronise();
  if (!done) (void)file.truncate(intact_to);
  return done;
}

bool isPart(const fs::path& file) {
  return file.extension() == ".part";
}

/// Returns its name as a complete file.
fs::path finishedName(const fs::path& file) {
  return isPart(file) ? file.parent_path() / file.stem() : file;
}

/// Checks whether a file can be read to its end.
class Everything final : public mcap::Visitor {
 public:
  explicit Everything(const RecoveryProgress& progress) : progress_(progress) {}

  std::uint64_t chunks = 0;
  bool of_hapticd = false;
  bool is_bag = false;
  bool stopped = false;
  void channel(const mcap::Channel& channel) override {
    of_hapticd |= isChannelOfTrace(channel.topic, channel.schema_name);
  }
  void metadata(std::string_view name, mcap::Pairs) override {
    of_hapticd |= name == kTraceMetadata;
    is_bag |= name == kBagMetadata;
  }
  void chunk(std::uint64_t offset, std::uint64_t size) override {
    ++chunks;
    stopped = progress_ && !progress_(static_cast<double>(offset) / static_cast<double>(size));
  }
  bool enough() const override { return stopped; }

 private:
  const RecoveryProgress& progress_;
};

/// Errors: why the file is not intact, as reported by the reader.
std::expected<RecoveredTrace, mcap::Fault> intact(const fs::path& path, const RecoveryProgress& progress) {
  Everything everything(progress);
  if (auto read = mcap::read(path, everything); !read) return std::unexpected(read.error());
  if (everything.stopped) {
    return std::unexpected(mcap::Fault{mcap::Fault::Kind::unreadable, mcap::interrupted(path)});
  }
  if (!everything.of_hapticd) {
    const char* const what =
        everything.is_bag ? "is a bag of ROS 2 and not a trace of hapticd" : "is not a trace of hapticd";
    return std::unexpected(mcap::Fault{mcap::Fault::Kind::foreign, {path.string(), what, ""}});
  }
  return RecoveredTrace{.outcome = Outcome::intact, .file = path, .chunks = everything.chunks};
}

bool isOfHapticd(const mcap::Salvage& whole) {
  const auto isTraceMetadata = [](const mcap::IntactRecord& metadata) {
    return mcap::ByteReader(metadata.content).text() == kTraceMetadata;
  };
  const auto hasOurTopic = [&whole](const auto& entry) {
    mcap::ChannelRecord channel;
    mcap::ChannelRecord::of(entry.second.content, channel);
    mcap::SchemaRecord schema;
    const auto found = whole.schemas.find(channel.schema);
    if (found != whole.schemas.end()) mcap::SchemaRecord::of(found->second.content, schema);
    return isChannelOfTrace(channel.topic, schema.name);
  };
  return std::ranges::any_of(whole.metadata, isTraceMetadata) ||
         std::ranges::any_of(whole.channels, hasOurTopic);
}

std::uint64_t bytesLost(const mcap::Salvage& whole) {
  std::uint64_t bytes = 0;
  for (const mcap::Damage& damage : whole.damages) bytes += damage.loses ? damage.bytes : 0;
  return bytes;
}

/// Returns the result of a recovery; `file` was made from `whole`.
RecoveredTrace reported(Outcome outcome, const fs::path& file, const mcap::Salvage& whole) {
  RecoveredTrace recovered{.outcome = outcome, .file = file, .chunks = whole.chunks.size()};
  recovered.bytes_lost = bytesLost(whole);
  recovered.damages = whole.damages;
  if (whole.messages_meant && *whole.messages_meant >= whole.messages_whole) {
    recovered.messages_lost = *whole.messages_meant - whole.messages_whole;
  }
  // that of another version may not be read by this program
  if (const auto info = readTrace(file)) recovered.ticks_missing = info->ticks_dropped;
  return recovered;
}

/// `why`: the fault reported by the reader.
base::Result<mcap::Salvage> salvageOf(const TraceFile& file, const mcap::Fault& why,
                                      const RecoveryProgress& progress) {
  const auto size = file.size();
  if (!size) return std::unexpected(size.error());
  auto whole = mcap::salvage(file, *size, progress);
  if (whole && !isOfHapticd(*whole) && !whole->chunks.empty()) {
    const bool is_known = why.kind == mcap::Fault::Kind::foreign;
    return base::failure(file.path(), is_known ? why.error.what : "is not a trace of hapticd",
                         "it was not changed");
  }
  if (whole && whole->damages.empty()) {
    whole->damages.push_back({.what = why.error.where + ": " + why.error.what});
    whole->intact_to.reset();
  }
  return whole;
}

/// Returns the name under which a damaged file is kept.
fs::path damagedName(const fs::path& finished) {
  fs::path name = finished.string() + ".damaged";
  std::error_code ignored;
  for (int number = 2; fs::exists(name, ignored); ++number) {
    name = finished.string() + ".damaged-" + std::to_string(number);
  }
  return name;
}

base::Result<RecoveredTrace> hopeless(const fs::path& part, const mcap::Salvage& whole) {
  RecoveredTrace recovered{
      .outcome = Outcome::hopeless, .file = {}, .original = damagedName(finishedName(part))};
  recovered.bytes_lost = bytesLost(whole);
  recovered.damages = whole.damages;
  if (auto moved = renameDurably(part, recovered.original); !moved) return std::unexpected(moved.error());
  return recovered;
}

base::Result<RecoveredTrace> endInPlace(TraceFile& file, const mcap::Salvage& whole,
                                        std::uint64_t intact_to) {
  const fs::path name = finishedName(file.path());
  auto done = endTrace(file, whole, intact_to);
  if (done) done = renameDurably(file.path(), name);
  if (!done) return std::unexpected(done.error());
  return reported(whole.chunks.empty() ? Outcome::empty : Outcome::ended, name, whole);
}

/// If it is interrupted, both files exist, which the next attempt reports.
base::Result<RecoveredTrace> replaceDamaged(const TraceFile& file, const mcap::Salvage& whole,
                                            const RecoveryProgress& progress) {
  const fs::path name = finishedName(file.path()), kept = damagedName(name);
  if (auto written = rewriteTrace(file, whole, name, progress); !written)
    return std::unexpected(written.error());
  if (auto moved = renameDurably(file.path(), kept); !moved) return std::unexpected(moved.error());
  RecoveredTrace recovered = reported(Outcome::rewritten, name, whole);
  recovered.original = kept;
  return recovered;
}

}  // namespace

fs::path recoveredName(const fs::path& file) {
  const std::string name = file.filename().string();
  return file.parent_path() / (name.substr(0, name.rfind(".mcap")) + "-recovered.mcap");
}

base::Result<RecoveredTrace> recoverTrace(const fs::path& path, const fs::path& out,
                                          const RecoveryProgress& progress) try {
  const auto file = TraceFile::openToRead(path);
  if (!file) return std::unexpected(file.error());
  if (isBeingWritten(path)) {
    return base::failure(path, "is being written", "stop the trace first, e.g. with hapticctl trace stop");
  }
  const auto complete = intact(path, progress);
  if (complete) return *complete;
  const auto whole = salvageOf(*file, complete.error(), progress);
  if (!whole) return std::unexpected(whole.error());
  if (whole->chunks.empty()) return base::failure(path, "has no intact chunk", "it was not changed");
  if (auto written = rewriteTrace(*file, *whole, out, progress); !written)
    return std::unexpected(written.error());
  RecoveredTrace recovered = reported(Outcome::rewritten, out, *whole);
  recovered.original = path;
  return recovered;
} catch (const std::bad_alloc&) {
  return std::unexpected(mcap::outOfMemory(path));
}

base::Result<RecoveredTrace> finishTrace(const fs::path& part, const RecoveryProgress& progress) try {
  auto file = TraceFile::openToMend(part);
  if (!file) return std::unexpected(file.error());
  const fs::path name = finishedName(part);
  auto complete = intact(part, progress);
  if (complete) {
    if (auto renamed = renameDurably(part, name); !renamed) return std::unexpected(renamed.error());
    complete->file = name;
    return *complete;
  }
  const auto whole = salvageOf(*file, complete.error(), progress);
  if (!whole) return std::unexpected(whole.error());
  if (!isOfHapticd(*whole)) return hopeless(part, *whole);
  if (whole->intact_to) return endInPlace(*file, *whole, *whole->intact_to);
  return replaceDamaged(*file, *whole, progress);
} catch (const std::bad_alloc&) {
  return std::unexpected(mcap::outOfMemory(part));
}

}  // namespace hapticd::trace
