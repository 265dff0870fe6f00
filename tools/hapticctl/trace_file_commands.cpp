#include "tools/hapticctl/trace_file_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "drivers/trace/trace_reader.h"
#include "drivers/trace/trace_recovery.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/events.h"
#include "tools/hapticctl/progress.h"
#include "tools/hapticctl/reply_reader.h"
#include "tools/hapticctl/status_text.h"
#include "tools/hapticctl/terminal_text.h"
#include "tools/trace/csv_export.h"
#include "tools/trace/hdf5_program.h"
#include "tools/trace/recording_export.h"
#include "tools/trace/trace_plot.h"
#include "tools/trace/trace_summary.h"

namespace hapticd::tools {
namespace {

Json durationsJson(const TraceDurations& durations) {
  const auto& [median_us, p99_us, p999_us, max_us] = durations;
  return {{"p50Us", median_us}, {"p99Us", p99_us}, {"p999Us", p999_us}, {"maxUs", max_us}};
}

Json timesJson(const std::vector<std::pair<std::string, double>>& times_s) {
  Json times = Json::object();
  for (const auto& [name, seconds] : times_s) times[name] = seconds;
  return times;
}

Json emptyPeriodsJson(const TraceSummary& summary) {
  const EmptyPeriods& periods = summary.empty_periods;
  return {{"count", periods.empty},
          {"stretches", periods.stretches},
          {"longest", periods.longest},
          {"longestAfterTick", periods.after_tick},
          {"longestTimeS", summary.longest_empty_time_s}};
}

Json infoJson(const TraceSummary& summary) {
  const drivers::TraceInfo& info = summary.info;
  Json metadata = Json::object();
  for (const auto& [name, value] : info.metadata) metadata[name] = value;
  Json attachments = Json::array();
  for (const drivers::TraceAttachment& attachment : info.attachments) attachments.push_back(attachment.name);
  return {{"bytes", info.bytes},
          {"complete", info.complete},
          {"firstNs", info.first_ns},
          {"lastNs", info.last_ns},
          {"durationS", summary.duration_s},
          {"rateHz", summary.rate_hz},
          {"ticks", info.ticks},
          {"ticksMissing", info.ticks_dropped},
          {"gaps", summary.gaps},
          {"periodNs", summary.empty_periods.period_ns},
          {"periods", summary.empty_periods.periods},
          {"emptyPeriods", emptyPeriodsJson(summary)},
          {"overruns", summary.overruns},
          {"wakeupLatency", durationsJson(summary.wakeup_latency)},
          {"computeTime", durationsJson(summary.compute_time)},
          {"largestForceN", summary.largest_force_n},
          {"largestForceTimeS", summary.largest_force_time_s},
          {"contactShare", summary.contact_share},
          {"modesS", timesJson(summary.modes_s)},
          {"lawsS", timesJson(summary.laws_s)},
          {"models", info.models},
          {"directives", info.directives},
          {"events", info.events},
          {"snapshots", info.snapshots},
          {"depthFrames", info.depth_frames},
          {"chunks", info.chunks},
          {"metadata", metadata},
          {"attachments", attachments},
          {"missingFields", Json(info.missing)}};
}

void showDurations(const char* name, const TraceDurations& durations) {
  fmt::print("{:<12} p50 {} us, p99 {} us, p99.9 {} us, longest {} us\n", name, fixed(durations.median_us, 1),
             fixed(durations.p99_us, 1), fixed(durations.p999_us, 1), fixed(durations.max_us, 1));
}

void showPeriods(const TraceSummary& summary) {
  const EmptyPeriods& periods = summary.empty_periods;
  if (periods.period_ns == 0) return;
  fmt::print("periods      {} of {}, {} without a tick", periods.periods,
             duration(static_cast<double>(periods.period_ns)), periods.empty);
  if (periods.empty > 0) {
    fmt::print(" in {} stretches, the longest of {} after tick {}, at {} s", periods.stretches,
               periods.longest, periods.after_tick, fixed(summary.longest_empty_time_s, 3));
  }
  fmt::print("\n");
}

/// What a file says of itself: it may be anything.
std::string shown(const std::string& text) {
  constexpr std::size_t kMostColumns = 200;
  return cutTo(printable(text), kMostColumns);
}

void showLaws(const TraceSummary& summary) {
  for (const auto& [law, seconds] : summary.laws_s) {
    fmt::print("law          {} for {} s\n", law, fixed(seconds, 1));
  }
  if (summary.law_without_proxy) {
    fmt::print(
        "             contact state and penetration do not apply to a law of springs: it has no proxy\n");
  }
}

void showInfo(const TraceSummary& summary) {
  const drivers::TraceInfo& info = summary.info;
  fmt::print("time         {}, {} s\n", localTime(static_cast<double>(info.first_ns)),
             fixed(summary.duration_s, 3));
  fmt::print("ticks        {} at {} Hz, {} missing in {} gaps, {} overruns\n", info.ticks,
             fixed(summary.rate_hz, 1), info.ticks_dropped, summary.gaps, summary.overruns);
  showPeriods(summary);
  for (const TraceGap& gap : summary.first_gaps) {
    fmt::print("gap          {} ticks after tick {}, at {} s\n", gap.ticks, gap.after_tick,
               fixed(gap.time_s, 3));
  }
  showDurations("woken late", summary.wakeup_latency);
  showDurations("computing", summary.compute_time);
  fmt::print("force        at most {} N, at {} s; in contact {} % of the time\n",
             fixed(summary.largest_force_n, 3), fixed(summary.largest_force_time_s, 3),
             fixed(100 * summary.contact_share, 1));
  for (const auto& [mode, seconds] : summary.modes_s) {
    fmt::print("mode         {} for {} s\n", mode, fixed(seconds, 1));
  }
  showLaws(summary);
  fmt::print("records      {} models, {} parameter sets, {} events, {} snapshots, {} depth frames\n",
             info.models, info.directives, info.events, info.snapshots, info.depth_frames);
  fmt::print("file         {}, {} chunks, {}\n", bytesText(static_cast<double>(info.bytes)), info.chunks,
             info.complete ? "complete" : "not closed: hapticctl trace recover");
  for (const auto& [name, value] : info.metadata) {
    fmt::print("{:<12} {}\n", shown(name), shown(value));
  }
  for (const auto& [topic, fields] : info.missing) {
    fmt::print("lacks        {} of {}: it is of another version of hapticd\n",
               shown(fmt::format("{}", fmt::join(fields, ", "))), topic);
  }
  for (const drivers::TraceAttachment& attachment : info.attachments) {
    fmt::print("holds        {} ({} bytes)\n", shown(attachment.name), attachment.data.size());
  }
}

/// The trace's name with that ending, here.
std::filesystem::path besideHere(const std::filesystem::path& trace, const std::string& ending) {
  return trace.filename().replace_extension(ending);
}

config::Result<void> mayBecome(const std::filesystem::path& out, const std::filesystem::path& trace) {
  std::error_code ignored;
  if (!std::filesystem::equivalent(out, trace, ignored)) return {};
  return std::unexpected(config::Error{out.string(), "is the trace itself", "give another name with --out"});
}

constexpr std::pair<const char*, TraceChannel> kChannels[] = {{"ticks", TraceChannel::ticks},
                                                              {"models", TraceChannel::models},
                                                              {"directives", TraceChannel::directives},
                                                              {"events", TraceChannel::events}};

TraceChannel channelOf(const std::string& name) {
  for (const auto& [word, channel] : kChannels) {
    if (name == word) return channel;
  }
  return TraceChannel::ticks;
}

/// The depth as a folder.
int exportDepth(const CommandOptions& options, const std::filesystem::path& file,
                const ExportOptions& wanted) {
  const std::filesystem::path folder =
      wanted.out.empty() ? besideHere(file, ".depth") : std::filesystem::path(wanted.out);
  ProgressLine progress("exporting");
  const auto frames =
      exportRecording(file, folder, wanted.selection, [&](double share) { progress.show(share); });
  progress.end();
  if (!frames) return report(frames.error(), options.json);
  if (options.json) {
    printJson({{"file", folder.string()}, {"frames", *frames}});
  } else {
    fmt::print("{}: {} depth frames\n", printable(folder.string()), *frames);
  }
  return kOk;
}

/// A form that traces are exported in, by the ending of a file's name.
struct ExportFormat {
  std::string_view name;
  std::string_view ending;
};
constexpr std::string_view kHdf5 = "hdf5";
constexpr std::array<ExportFormat, 3> kFormats{{{"csv", ".csv"}, {kHdf5, ".h5"}, {kHdf5, ".hdf5"}}};

/// What the ending of --out says, else --format, else CSV.
config::Result<ExportFormat> formatFor(const ExportOptions& wanted) {
  if (wanted.out.empty()) {
    const auto named = std::ranges::find(kFormats, wanted.format, &ExportFormat::name);
    return named == kFormats.end() ? kFormats.front() : *named;
  }
  std::vector<std::string_view> endings;
  for (const ExportFormat& format : kFormats) {
    if (checkEnding(wanted.out, std::array{format.ending})) {
      if (wanted.format.empty() || wanted.format == format.name) return format;
      return std::unexpected(config::Error{wanted.out, "is not of the format " + wanted.format,
                                           "leave out --format, or give another ending"});
    }
    endings.push_back(format.ending);
  }
  return std::unexpected(checkEnding(wanted.out, endings).error());
}

}  // namespace

int runTraceInfo(const CommandOptions& options, const std::filesystem::path& file) {
  ProgressLine progress("reading");
  const auto summary = summariseTrace(file, [&](double share) { progress.show(share); });
  progress.end();
  if (!summary) return report(summary.error(), options.json);
  if (options.json) {
    printJson(infoJson(*summary));
  } else {
    showInfo(*summary);
  }
  return kOk;
}

int runTraceRecover(const CommandOptions& options, const std::filesystem::path& file) {
  ProgressLine progress("recovering");
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

int runTraceExport(const CommandOptions& options, const std::filesystem::path& file,
                   const ExportOptions& wanted) {
  if (wanted.format == "libfreenect") return exportDepth(options, file, wanted);
  if (const auto good = mayBecome(wanted.out, file); !good) return report(good.error(), options.json);
  const auto format = formatFor(wanted);
  if (!format) return report(format.error(), options.json);
  const bool hdf5 = format->name == kHdf5;
  const std::filesystem::path out =
      wanted.out.empty() ? besideHere(file, std::string(format->ending)) : std::filesystem::path(wanted.out);
  ProgressLine progress("exporting");
  const auto show = [&](double share) { progress.show(share); };
  const auto rows =
      hdf5 ? exportHdf5ByProgram(file, out, wanted.selection, show, wanted.if_exists)
           : exportCsv(file, out, channelOf(wanted.channel), wanted.selection, show, wanted.if_exists);
  progress.end();
  if (!rows) return report(rows.error(), options.json);
  if (options.json) {
    Json document{{"file", out.string()}, {"rows", *rows}};
    if (!hdf5) document["settings"] = settingsBeside(out).string();
    printJson(document);
  } else {
    fmt::print("{}: {} rows\n", printable(out.string()), *rows);
    if (!hdf5) fmt::print("{}: the settings\n", printable(settingsBeside(out).string()));
  }
  return kOk;
}

int runTracePlot(const CommandOptions& options, const std::filesystem::path& file,
                 const PlotOptions& wanted) {
  const std::filesystem::path out =
      wanted.out.empty() ? besideHere(file, ".png") : std::filesystem::path(wanted.out);
  if (const auto good = mayBecome(out, file); !good) return report(good.error(), options.json);
  ProgressLine progress("drawing");
  const auto drawn = plotTrace(
      file, out, wanted.selection, [&](double share) { progress.show(share); }, wanted.if_exists);
  progress.end();
  if (!drawn) return report(drawn.error(), options.json);
  if (options.json) {
    printJson({{"file", out.string()}});
  } else {
    fmt::print("{}\n", printable(out.string()));
  }
  return kOk;
}

}  // namespace hapticd::tools
