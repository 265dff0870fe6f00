// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/recording_export.h"

#include <memory>
#include <system_error>
#include <utility>

#include "drivers/camera/recorded/recording_writer.h"
#include "drivers/trace/depth_codec.h"
#include "drivers/trace/trace_head.h"
#include "tools/lib/trace/selected_trace.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

std::unexpected<config::Error> refuse(const fs::path& where, std::string what, std::string remedy) {
  return std::unexpected(config::Error{where.string(), std::move(what), std::move(remedy)});
}

fs::path draftOf(const fs::path& folder) {
  return folder.string() + ".part";
}

config::Result<void> mayBegin(const fs::path& trace, const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder, ignored)) return refuse(folder, "exists already", "name a new folder with --out");
  if (fs::exists(draftOf(folder), ignored)) {
    return refuse(draftOf(folder), "exists: an export is at work, or was cut off",
                  "wait for it, or delete it");
  }
  fs::path beside = trace;
  beside.replace_extension(".depth");
  if (fs::is_directory(beside, ignored)) {
    return refuse(trace, "has its depth beside it, as older versions recorded it",
                  "take " + beside.string() + ", which is in this format already");
  }
  if (drivers::hasDepthChannel(trace)) return {};
  return refuse(trace, "holds no depth", "write it with depth: hapticctl trace start --depth");
}

/// Writes the content of the folder.
config::Result<std::uint64_t> writeFrames(const SelectedTrace& trace, const fs::path& file,
                                          const fs::path& draft, const Progress& progress) {
  auto writer = drivers::RecordingWriter::create(draft, trace.realtimeOffset_ns());
  if (!writer) return std::unexpected(writer.error());
  drivers::DepthDecoder decoder;
  const auto frame = std::make_unique<rt::DepthFrame>();
  config::Result<void> written;
  const auto write = [&](const drivers::DepthRecord& record) {
    const std::string wrong = decoder.decode(record, *frame);
    written = wrong.empty() ? (*writer)->write(*frame) : refuse(file, wrong, "");
    return written.has_value();
  };
  const auto info = trace.readAll({.depth = write}, progress);
  if (!written) return std::unexpected(written.error());
  if (!info) return std::unexpected(info.error());
  return (*writer)->frames();
}

}  // namespace

config::Result<std::uint64_t> exportRecording(const fs::path& trace, const fs::path& folder,
                                              const TraceSelection& selection, const Progress& progress) {
  const auto selected = SelectedTrace::open(trace, selection);
  if (!selected) return std::unexpected(selected.error());
  if (auto possible = mayBegin(trace, folder); !possible) return std::unexpected(possible.error());
  const fs::path draft = draftOf(folder);
  auto frames = writeFrames(*selected, trace, draft, progress);
  std::error_code failure;
  if (frames) fs::rename(draft, folder, failure);
  if (frames && !failure) return frames;
  std::error_code ignored;
  fs::remove_all(draft, ignored);
  if (!frames) return frames;
  return refuse(folder, "cannot be created: " + failure.message(), "name a new folder with --out");
}

}  // namespace hapticd::tools
