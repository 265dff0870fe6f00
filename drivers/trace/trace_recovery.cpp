// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/trace_recovery.h"

#include <algorithm>
#include <new>
#include <string>
#include <utility>

#include "drivers/trace/format/messages.h"
#include "drivers/trace/mcap/mcap_reader.h"
#include "drivers/trace/mcap/trace_file.h"
#include "drivers/trace/trace_format.h"
#include "drivers/trace/trace_reader.h"
#include "drivers/trace/trace_rewriter.h"

namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;
using Outcome = RecoveredTrace::Outcome;

std::unexpected<base::Error> refuse(const fs::path& where, std::string what, std::string remedy) {
  return std::unexpected(base::Error{where.string(), std::move(what), std::move(remedy)});
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
  bool stopped = false;
  void channel(const mcap::Channel& channel) override { of_hapticd |= isTopicOfHapticd(channel.topic); }
  std::string message(const mcap::Message&) override { return ""; }
  void metadata(std::string_view name, mcap::Pairs) override { of_hapticd |= name == kTraceMetadata; }
  void attachment(const mcap::AttachmentRecord&) override {}
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
    return std::unexpected(
        mcap::Fault{mcap::Fault::Kind::foreign, {path.string(), "is not a trace of hapticd", ""}});
  }
  return RecoveredTrace{.outcome = Outcome::intact, .file = path, .chunks = everything.chunks};
}

bool isOfHapticd(const mcap::Salvage& whole) {
  const auto isTraceMetadata = [](const mcap::IntactRecord& metadata) {
    return mcap::ByteReader(metadata.content).text() == kTraceMetadata;
  };
  const auto hasOurTopic = [](const auto& entry) {
    mcap::ChannelRecord channel;
    mcap::ChannelRecord::of(entry.second.content, channel);
    return isTopicOfHapticd(channel.topic);
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
    return refuse(file.path(), "is not a trace of hapticd", "it was not changed");
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

base::Result<RecoveredTrace> endInPlace(TraceFile& file, const mcap::Salvage& whole, std::uint64_t intact_to,
                                        const RecoveryProgress& progress) {
  const fs::path name = finishedName(file.path());
  auto done = endTrace(file, whole, intact_to, progress);
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
    return refuse(path, "is being written", "stop the trace first, e.g. with hapticctl trace stop");
  }
  const auto complete = intact(path, progress);
  if (complete) return *complete;
  const auto whole = salvageOf(*file, complete.error(), progress);
  if (!whole) return std::unexpected(whole.error());
  if (whole->chunks.empty()) return refuse(path, "has no intact chunk", "it was not changed");
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
  if (whole->intact_to) return endInPlace(*file, *whole, *whole->intact_to, progress);
  return replaceDamaged(*file, *whole, progress);
} catch (const std::bad_alloc&) {
  return std::unexpected(mcap::outOfMemory(part));
}

}  // namespace hapticd::drivers
