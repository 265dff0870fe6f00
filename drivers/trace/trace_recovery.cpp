#include "drivers/trace/trace_recovery.h"

#include <optional>
#include <utility>
#include <vector>

#include "drivers/trace/mcap_reader.h"
#include "drivers/trace/mcap_scanner.h"
#include "drivers/trace/trace_file.h"
#include "drivers/trace/trace_format.h"

namespace hapticd::drivers {
namespace {

using mcap::Fault;
using mcap::Opcode;
using Progress = std::function<void(double)>;

/// What of a file is whole.
struct Salvage {
  mcap::Summary summary;
  std::uint64_t good_end = 0;  ///< all in front of it is whole, once `indexes` are written
  std::uint32_t crc = 0;       ///< of all that
  std::vector<std::pair<std::uint64_t, std::string>> indexes;  ///< to be written, and where
  bool of_hapticd = false;
  bool whole_data = false;     ///< only what comes after the messages is missing
  std::optional<Fault> fault;  ///< why it does not go on
};

/// Goes through a file up to what is not whole.
class Search {
 public:
  Search(mcap::Scanner scanner, const Progress& progress)
      : scanner_(std::move(scanner)), progress_(progress) {}

  Salvage run() && {
    do {
      found_.good_end = scanner_.offset();
      found_.crc = scanner_.crc();
    } while (takeNext());
    return std::move(found_);
  }

 private:
  bool takeNext() {
    const auto record = scanner_.next();
    if (!record) {
      found_.fault = record.error();
      return false;
    }
    if (record->opcode == Opcode::data_end) {
      found_.whole_data = true;
      return false;
    }
    const std::string wrong = take(*record);
    if (!wrong.empty()) found_.fault = scanner_.damaged(record->offset, wrong);
    return wrong.empty();
  }

  /// What is wrong with it, or "".
  std::string take(const mcap::Record& record) {
    switch (record.opcode) {
      case Opcode::header:
        return "";
      case Opcode::schema:
        found_.summary.addSchema(record.content);
        return "";
      case Opcode::channel:
        found_.summary.addChannel(record.content);
        return "";
      case Opcode::metadata:
        found_.of_hapticd |= mcap::ByteReader(record.content).text() == kTraceMetadata;
        found_.summary.addMetadata(record.offset, record.bytes(), record.content);
        return "";
      case Opcode::attachment:
        return attachment(record);
      case Opcode::chunk:
        return chunk(record);
      default:
        return "a record that does not belong here";
    }
  }

  std::string attachment(const mcap::Record& record) {
    mcap::AttachmentRecord attachment;
    std::string wrong = mcap::AttachmentRecord::of(record.content, attachment);
    if (wrong.empty()) found_.summary.addAttachment(record.offset, record.bytes(), attachment);
    return wrong;
  }

  /// The indexes behind a chunk follow from it: they are written again where they are not as they should be.
  std::string chunk(const mcap::Record& record) {
    mcap::ChunkRecord chunk;
    mcap::ChunkContent content;
    std::string_view records;
    if (!mcap::ChunkRecord::of(record.content, chunk)) return "a chunk that is not whole";
    if (std::string wrong = chunk.unpack(buffer_, records); !wrong.empty()) return wrong;
    if (!mcap::ChunkContent::of(records, content)) return "something else than messages in a chunk";
    found_.summary.addChunk(record.offset, record.bytes(), chunk, content);

    std::string index = content.indexRecords();
    const auto there = scanner_.peek(index.size());
    if (!there) return there.error().error.what;
    const std::uint64_t index_at = scanner_.offset();
    scanner_.skip(index);
    if (*there != index) found_.indexes.emplace_back(index_at, std::move(index));
    if (progress_) {
      progress_(static_cast<double>(scanner_.offset()) / static_cast<double>(scanner_.size()));
    }
    return "";
  }

  mcap::Scanner scanner_;
  const Progress& progress_;
  Salvage found_;
  std::string buffer_;  ///< of an uncompressed chunk
};

/// Whether a file can be read to its end.
class Everything final : public mcap::Visitor {
 public:
  std::uint64_t chunks = 0;
  bool of_hapticd = false;
  void channel(const mcap::Channel&) override {}
  std::string message(const mcap::Message&) override { return ""; }
  void metadata(std::string_view name, mcap::Pairs) override { of_hapticd |= name == kTraceMetadata; }
  void attachment(const mcap::AttachmentRecord&) override {}
  void chunk(std::uint64_t, std::uint64_t) override { ++chunks; }
  bool enough() const override { return false; }
};

bool isPart(const std::filesystem::path& file) {
  return file.extension() == ".part";
}

/// Its name as a complete file.
std::filesystem::path finishedName(const std::filesystem::path& file) {
  return isPart(file) ? file.parent_path() / file.stem() : file;
}

/// Writes what is missing. It may be cut short at any time: what is found is the same the next time.
config::Result<void> mend(const std::filesystem::path& path, const Salvage& salvage) {
  auto file = TraceFile::openToMend(path);
  if (!file) return std::unexpected(file.error());
  auto done = file->truncate(salvage.good_end);
  for (const auto& [offset, index] : salvage.indexes) {
    if (done) done = file->writeAt(offset, index);
  }
  if (done) done = file->writeAt(salvage.good_end, salvage.summary.ending(salvage.good_end, salvage.crc));
  if (done) done = file->synchronise();
  if (!done) (void)file->truncate(salvage.good_end);
  return done;
}

config::Result<RecoveredTrace> finished(const std::filesystem::path& path, std::uint64_t chunks,
                                        std::uint64_t bytes_cut) {
  const std::filesystem::path name = finishedName(path);
  if (name != path) {
    if (auto renamed = renameDurably(path, name); !renamed) return std::unexpected(renamed.error());
  }
  return RecoveredTrace{name, chunks, bytes_cut};
}

/// A ".part" that broke off before its first chunk was whole holds nothing; anything else is left alone.
config::Result<RecoveredTrace> nothingWhole(const std::filesystem::path& path, std::uint64_t bytes,
                                            const Fault& fault) {
  std::error_code failure;
  if (fault.kind != Fault::Kind::cut || !isPart(path)) return std::unexpected(fault.error);
  if (!std::filesystem::remove(path, failure)) {
    return std::unexpected(config::Error{path.string(), "cannot be removed: " + failure.message(),
                                         "check the permissions of the folder"});
  }
  return RecoveredTrace{{}, 0, bytes};
}

}  // namespace

config::Result<RecoveredTrace> recoverTrace(const std::filesystem::path& path, const Progress& progress) {
  Everything everything;
  if (mcap::read(path, everything) && everything.of_hapticd) return finished(path, everything.chunks, 0);

  std::error_code ignored;
  const std::uint64_t bytes = std::filesystem::file_size(path, ignored);
  auto scanner = mcap::Scanner::open(path);
  if (!scanner) return nothingWhole(path, bytes, scanner.error());
  const Salvage salvage = Search(std::move(*scanner), progress).run();
  if (salvage.fault && salvage.fault->kind == Fault::Kind::unreadable) {
    return std::unexpected(salvage.fault->error);
  }
  if (salvage.summary.chunks() > 0 && !salvage.of_hapticd) {
    return std::unexpected(config::Error{path.string(), "is no trace of hapticd", "it is left as it is"});
  }
  if (salvage.summary.chunks() == 0 && salvage.fault) return nothingWhole(path, bytes, *salvage.fault);
  if (auto mended = mend(path, salvage); !mended) return std::unexpected(mended.error());
  const bool lost = !salvage.whole_data && bytes > salvage.good_end;
  return finished(path, salvage.summary.chunks(), lost ? bytes - salvage.good_end : 0);
}

}  // namespace hapticd::drivers
