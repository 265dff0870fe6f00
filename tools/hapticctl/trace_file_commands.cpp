#include "tools/hapticctl/trace_file_commands.h"

#include <fmt/format.h>

#include "drivers/trace/trace_reader.h"
#include "drivers/trace/trace_recovery.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/events.h"
#include "tools/hapticctl/progress.h"
#include "tools/hapticctl/reply_reader.h"
#include "tools/hapticctl/status_text.h"

namespace hapticd::tools {
namespace {

Json infoJson(const drivers::TraceInfo& info) {
  Json metadata = Json::object();
  for (const auto& [name, value] : info.metadata) metadata[name] = value;
  Json attachments = Json::array();
  for (const drivers::TraceAttachment& attachment : info.attachments) attachments.push_back(attachment.name);
  return {
      {"bytes", info.bytes},         {"complete", info.complete},     {"firstNs", info.first_ns},
      {"lastNs", info.last_ns},      {"ticks", info.ticks},           {"ticksDropped", info.ticks_dropped},
      {"models", info.models},       {"directives", info.directives}, {"events", info.events},
      {"snapshots", info.snapshots}, {"chunks", info.chunks},         {"metadata", metadata},
      {"attachments", attachments}};
}

void showInfo(const drivers::TraceInfo& info) {
  fmt::print("time         {}, {} s\n", localTime(static_cast<double>(info.first_ns)),
             fixed(static_cast<double>(info.last_ns - info.first_ns) * 1e-9, 3));
  fmt::print("ticks        {}, {} missing\n", info.ticks, info.ticks_dropped);
  fmt::print("records      {} models, {} directives, {} events, {} snapshots\n", info.models, info.directives,
             info.events, info.snapshots);
  fmt::print("file         {}, {} chunks, {}\n", bytesText(static_cast<double>(info.bytes)), info.chunks,
             info.complete ? "complete" : "not closed: hapticctl trace recover");
  for (const auto& [name, value] : info.metadata) {
    fmt::print("{:<12} {}\n", printable(name), printable(value));
  }
  for (const drivers::TraceAttachment& attachment : info.attachments) {
    fmt::print("holds        {} ({} bytes)\n", printable(attachment.name), attachment.data.size());
  }
}

int notInThisBuild(const CommandOptions& options, const std::filesystem::path& file) {
  return report(
      config::Error{file.string(), "this build cannot read what is in traces", "use a released hapticctl"},
      options.json);
}

}  // namespace

int runTraceInfo(const CommandOptions& options, const std::filesystem::path& file) {
  Progress progress("reading");
  drivers::TraceVisitor visitor;
  visitor.progress = [&](double share) { progress.show(share); };
  const auto info = drivers::readTrace(file, visitor);
  progress.end();
  if (!info) return report(info.error(), options.json);
  if (options.json) {
    printJson(infoJson(*info));
  } else {
    showInfo(*info);
  }
  return kOk;
}

int runTraceRecover(const CommandOptions& options, const std::filesystem::path& file) {
  Progress progress("recovering");
  const auto recovered = drivers::recoverTrace(file, [&](double share) { progress.show(share); });
  progress.end();
  if (!recovered) return report(recovered.error(), options.json);
  if (options.json) {
    printJson({{"file", recovered->file.string()},
               {"chunks", recovered->chunks},
               {"bytesCut", recovered->bytes_cut}});
  } else if (recovered->file.empty()) {
    fmt::print("nothing whole was in it; it was removed\n");
  } else {
    fmt::print("{}: {} chunks kept, {} bytes cut\n", printable(recovered->file.string()), recovered->chunks,
               recovered->bytes_cut);
  }
  return kOk;
}

int runTraceExport(const CommandOptions& options, const std::filesystem::path& file, const ExportOptions&) {
  return notInThisBuild(options, file);
}

int runTracePlot(const CommandOptions& options, const std::filesystem::path& file, const PlotOptions&) {
  return notInThisBuild(options, file);
}

}  // namespace hapticd::tools
