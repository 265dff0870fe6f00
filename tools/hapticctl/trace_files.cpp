// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/trace_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/counted.h"
#include "daemon/trace/export/trace_export.h"
#include "daemon/trace/export/trace_summary.h"
#include "daemon/trace/mcap/trace_file.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "tools/hapticctl/text/breach_text.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/printer.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/plot/trace_plot.h"
#include "tools/lib/ros/ros_bag.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

/// A line such as "reading 42 %" on stderr that is overwritten as work goes on; nothing if stderr is not a
/// terminal that understands control sequences.
class ProgressLine {
 public:
  explicit ProgressLine(std::string doing) : doing_(std::move(doing)), terminal_(isScreen(STDERR_FILENO)) {}
  /// Erases the line.
  ~ProgressLine() {
    if (shown_percent_ >= 0) fmt::print(stderr, "\r\033[K");
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// `share`: 0..1.
  void show(double share) {
    const int percent = static_cast<int>(100 * share);
    if (!terminal_ || percent == shown_percent_) return;
    shown_percent_ = percent;
    fmt::print(stderr, "\r{} {} %\033[K", doing_, percent);
    std::fflush(stderr);
  }

 private:
  std::string doing_;
  bool terminal_;
  int shown_percent_ = -1;
};

/// Returns the result of `work(progress)`, which says meanwhile how far it is.
template <typename Work>
auto withProgress(std::string doing, Work work) {
  ProgressLine line(std::move(doing));
  return work([&line](double share) {
    line.show(share);
    return true;
  });
}

/// Prints a result in the requested form.
int show(const CommandOptions& options, const Json& json, const std::string& text) {
  if (options.json) {
    printJson(json);
  } else {
    fmt::print("{}", text);
  }
  return kOk;
}

Json durationsJson(const trace::TraceDurations& durations) {
  const auto& [median_us, p99_us, p999_us, max_us] = durations;
  return {{"p50Us", median_us}, {"p99Us", p99_us}, {"p999Us", p999_us}, {"maxUs", max_us}};
}

constexpr const char* kFinishFirst = "finish it first: hapticctl trace stop";

/// Returns the error of a trace that cannot be read. One that is being written has no end yet, but
/// needs no recovery.
base::Error errorOf(const std::filesystem::path& file, const base::Error& error) {
  if (!error.where.starts_with(file.string()) || !trace::isBeingWritten(file)) return error;
  return {file.string(), "is being written", kFinishFirst};
}

std::string stateText(const trace::TraceSummary& summary, bool being_written) {
  if (summary.info.complete) return "complete";
  return being_written ? fmt::format("being written ({})", kFinishFirst)
                       : "not closed: hapticctl trace recover";
}

Json timesJson(const std::vector<std::pair<std::string, double>>& times_s) {
  Json times = Json::object();
  for (const auto& [name, seconds] : times_s) times[name] = seconds;
  return times;
}

Json emptyPeriodsJson(const trace::TraceSummary& summary) {
  const trace::EmptyPeriods& periods = summary.empty_periods;
  return {{"count", periods.empty},
          {"stretches", periods.stretches},
          {"longest", periods.longest},
          {"longestAfterTick", periods.after_tick},
          {"longestTimeS", summary.longest_empty_time_s}};
}

Json infoJson(const trace::TraceSummary& summary, bool being_written) {
  const trace::TraceInfo& info = summary.info;
  Json metadata = Json::object();
  for (const auto& [name, value] : info.metadata) metadata[name] = value;
  Json attachments = Json::array();
  for (const trace::TraceAttachment& attachment : info.attachments) attachments.push_back(attachment.name);
  return {{"bytes", info.bytes},
          {"complete", info.complete},
          {"beingWritten", being_written},
          {"firstNs", info.first_ns},
          {"clockIsSet", info.clock_is_set ? Json(*info.clock_is_set) : Json(nullptr)},
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
          {"fixtureContacts", summary.fixture_contacts},
          {"fixtureContactShare", summary.fixture_contact_share},
          {"largestFixtureForceN", summary.largest_fixture_force_n},
          {"largestGuidanceForceN", summary.largest_guidance_force_n},
          {"modesS", timesJson(summary.modes_s)},
          {"lawsS", timesJson(summary.laws_s)},
          {"models", info.models},
          {"directives", info.directives},
          {"additions", info.additions},
          {"events", info.events},
          {"snapshots", info.snapshots},
          {"depthFrames", info.depth_frames},
          {"chunks", info.chunks},
          {"note", summary.note},
          {"metadata", metadata},
          {"metadataLost", info.metadata_lost},
          {"attachments", attachments},
          {"missingFields", Json(info.missing)}};
}

/// Adds a line, or a part of one.
template <typename... Values>
void add(std::string& text, fmt::format_string<Values...> form, Values&&... values) {
  fmt::format_to(std::back_inserter(text), form, std::forward<Values>(values)...);
}

void addDurations(std::string& text, const char* name, const trace::TraceDurations& durations) {
  add(text, "{:<12} p50 {} us, p99 {} us, p99.9 {} us, max {} us\n", name, fixed(durations.median_us, 1),
      fixed(durations.p99_us, 1), fixed(durations.p999_us, 1), fixed(durations.max_us, 1));
}

void addPeriods(std::string& text, const trace::TraceSummary& summary) {
  const trace::EmptyPeriods& periods = summary.empty_periods;
  if (periods.period_ns == 0) return;
  add(text, "periods      {} of {}, {} without a tick", periods.periods,
      duration(static_cast<double>(periods.period_ns)), periods.empty);
  if (periods.empty > 0) {
    add(text, " in {} stretches, the longest of {} after tick {}, at {} s", periods.stretches,
        periods.longest, periods.after_tick, fixed(summary.longest_empty_time_s, 3));
  }
  add(text, "\n");
}

/// Returns a text from a file in printable form, because it may contain anything.
std::string shown(const std::string& text) {
  constexpr std::size_t kMaxTextColumns = 200;
  return cutTo(printable(text), kMaxTextColumns);
}

void addLaws(std::string& text, const trace::TraceSummary& summary) {
  for (const auto& [law, seconds] : summary.laws_s) {
    add(text, "law          {} for {} s\n", law, fixed(seconds, 1));
  }
  if (summary.law_without_proxy) {
    add(text,
        "             contact state and penetration do not apply to a law of springs: it has no proxy\n");
  }
}

std::string infoText(const trace::TraceSummary& summary, bool being_written) {
  std::string text;
  const trace::TraceInfo& info = summary.info;
  if (!summary.note.empty()) add(text, "note         {}\n", summary.note);
  add(text, "time         {}{}, {} s\n", utcTime(static_cast<double>(info.first_ns)),
      info.clock_is_set.value_or(true) ? "" : " (the clock had not been set)", fixed(summary.duration_s, 3));
  add(text, "ticks        {} at {} Hz, {} missing in {} gaps, {} overruns\n", info.ticks,
      fixed(summary.rate_hz, 1), info.ticks_dropped, summary.gaps, summary.overruns);
  addPeriods(text, summary);
  for (const trace::TraceGap& gap : summary.first_gaps) {
    add(text, "gap          {} ticks after tick {}, at {} s\n", gap.ticks, gap.after_tick,
        fixed(gap.time_s, 3));
  }
  addDurations(text, "wake-up", summary.wakeup_latency);
  addDurations(text, "compute", summary.compute_time);
  add(text, "force        at most {} N, at {} s; in contact {} % of the time\n",
      fixed(summary.largest_force_n, 3), fixed(summary.largest_force_time_s, 3),
      fixed(100 * summary.contact_share, 1));
  if (summary.fixture_contacts > 0) {
    add(text, "fixtures     {} contacts, {} % of the time; at most {} N, guidance at most {} N\n",
        summary.fixture_contacts, fixed(100 * summary.fixture_contact_share, 1),
        fixed(summary.largest_fixture_force_n, 3), fixed(summary.largest_guidance_force_n, 3));
  }
  for (const auto& [mode, seconds] : summary.modes_s) {
    add(text, "mode         {} for {} s\n", mode, fixed(seconds, 1));
  }
  addLaws(text, summary);
  add(text, "records      {}, {}, {}, {}, {}, {}\n", base::counted(info.models, "model(s)"),
      base::counted(info.directives, "parameter set(s)"), base::counted(info.additions, "fixture set(s)"),
      base::counted(info.events, "event(s)"), base::counted(info.snapshots, "snapshot(s)"),
      base::counted(info.depth_frames, "depth frame(s)"));
  add(text, "file         {}, {}, {}\n", bytesText(static_cast<double>(info.bytes)),
      base::counted(info.chunks, "chunk(s)"), stateText(summary, being_written));
  for (const auto& [name, value] : info.metadata) {
    add(text, "{:<12} {}\n", shown(name), shown(value));
  }
  if (info.metadata_lost) {
    add(text,
        "lacks        its metadata, which another program has removed: times are by the first "
        "record\n");
  }
  for (const auto& [topic, fields] : info.missing) {
    add(text, "lacks        {} of {}: it is of another version of hapticd\n",
        shown(fmt::format("{}", fmt::join(fields, ", "))), topic);
  }
  for (const trace::TraceAttachment& attachment : info.attachments) {
    add(text, "contains     {} ({})\n", shown(attachment.name),
        bytesText(static_cast<double>(attachment.data.size())));
  }
  return text;
}

const char* nameOf(trace::RecoveredTrace::Outcome outcome) {
  return outcome == trace::RecoveredTrace::Outcome::intact ? "intact" : "rewritten";
}

Json recoveryJson(const trace::RecoveredTrace& recovered) {
  Json damages = Json::array();
  for (const trace::mcap::Damage& damage : recovered.damages) {
    damages.push_back({{"offset", damage.offset},
                       {"bytes", damage.bytes},
                       {"what", damage.what},
                       {"loses", damage.loses},
                       {"afterNs", damage.after_ns},
                       {"beforeNs", damage.before_ns}});
  }
  Json json{{"file", recovered.file.string()},
            {"outcome", nameOf(recovered.outcome)},
            {"chunks", recovered.chunks},
            {"bytesLost", recovered.bytes_lost},
            {"ticksMissing", recovered.ticks_missing},
            {"damage", std::move(damages)}};
  json["messagesLost"] = recovered.messages_lost ? Json(*recovered.messages_lost) : Json(nullptr);
  return json;
}

/// Which messages may be lost, as far as the intact ones around the damage show.
std::string whenText(const trace::mcap::Damage& damage) {
  if (!damage.loses) return "; no message is lost by that";
  const auto time = [](std::uint64_t time_ns) {
    return utcTimeWithMilliseconds(static_cast<double>(time_ns));
  };
  if (damage.after_ns != 0 && damage.before_ns > damage.after_ns) {
    const auto gap_s = static_cast<double>(damage.before_ns - damage.after_ns) * 1e-9;
    return fmt::format("; {} s after {} are missing there", fixed(gap_s, 3), time(damage.after_ns));
  }
  if (damage.after_ns != 0 && damage.before_ns == 0) {
    return fmt::format("; everything after {} is missing", time(damage.after_ns));
  }
  return "";
}

std::string recoveryText(const trace::RecoveredTrace& recovered) {
  std::string text;
  const std::string name = printable(recovered.file.string());
  if (recovered.outcome == trace::RecoveredTrace::Outcome::intact) {
    add(text, "{}: nothing is wrong with it; nothing was written\n", name);
    return text;
  }
  for (const trace::mcap::Damage& damage : recovered.damages) {
    const std::string where =
        damage.bytes == 0 ? fmt::format("at byte {}", damage.offset)
                          : fmt::format("bytes {} to {}", damage.offset, damage.offset + damage.bytes - 1);
    add(text, "damaged      {}: {}{}\n", where, printable(damage.what), whenText(damage));
  }
  if (recovered.messages_lost)
    add(text, "lost         {}\n", base::counted(*recovered.messages_lost, "message(s)"));
  add(text, "missing      {} between the first and the last one\n",
      base::counted(recovered.ticks_missing, "tick(s)"));
  add(text, "{}: {} kept, {} lost; {} is left as it was\n", name, base::counted(recovered.chunks, "chunk(s)"),
      base::counted(recovered.bytes_lost, "byte(s)"), printable(recovered.original.string()));
  return text;
}

/// The name of the trace with another ending, in the current folder.
std::filesystem::path besideHere(const std::filesystem::path& trace, const std::string& ending) {
  return trace.filename().replace_extension(ending);
}

base::Result<void> mayBecome(const std::filesystem::path& out, const std::filesystem::path& trace) {
  std::error_code ignored;
  if (!std::filesystem::equivalent(out, trace, ignored)) return {};
  return std::unexpected(base::Error{out.string(), "is the trace itself", "give another name with --out"});
}

constexpr std::pair<const char*, trace::TraceChannel> kChannels[] = {
    {"ticks", trace::TraceChannel::ticks},
    {"models", trace::TraceChannel::models},
    {"directives", trace::TraceChannel::directives},
    {"events", trace::TraceChannel::events}};

trace::TraceChannel channelOf(const std::string& name) {
  for (const auto& [word, channel] : kChannels) {
    if (name == word) return channel;
  }
  return trace::TraceChannel::ticks;
}

/// Exports the raw depth of a trace as a recording.
int exportDepth(const CommandOptions& options, const std::filesystem::path& file,
                const ExportOptions& requested) {
  const std::filesystem::path folder =
      requested.out.empty() ? besideHere(file, ".depth") : std::filesystem::path(requested.out);
  const auto frames = withProgress("exporting", [&](const auto& progress) {
    return trace::exportRecording(file, folder, requested.selection, progress);
  });
  if (!frames) return report(frames.error(), options.json);
  return show(options, {{"file", folder.string()}, {"frames", *frames}},
              fmt::format("{}: {}\n", printable(folder.string()), base::counted(*frames, "depth frame(s)")));
}

/// Exports a trace as a bag of ROS 2.
int exportAsBag(const CommandOptions& options, const std::filesystem::path& file,
                const ExportOptions& requested) {
  constexpr std::array<std::string_view, 1> kEndings{".mcap"};
  const std::filesystem::path out =
      requested.out.empty() ? besideHere(file, ".rosbag2.mcap") : std::filesystem::path(requested.out);
  if (const auto good = mayBecome(out, file); !good) return report(good.error(), options.json);
  if (const auto good = base::checkEnding(out, kEndings); !good) return report(good.error(), options.json);
  const auto bag = withProgress("exporting", [&](const auto& progress) {
    return ros::exportBag(file, out, requested.name_space, requested.selection, progress,
                          requested.if_exists);
  });
  if (!bag) return report(errorOf(file, bag.error()), options.json);
  return show(options, {{"file", out.string()}, {"messages", bag->messages}, {"frames", bag->depth_frames}},
              fmt::format("{}: {}, {}\n", printable(out.string()), base::counted(bag->messages, "message(s)"),
                          base::counted(bag->depth_frames, "depth frame(s)")));
}

base::Result<void> mayBecomeCsv(const std::filesystem::path& out) {
  constexpr std::array<std::string_view, 1> kEndings{".csv"};
  auto good = base::checkEnding(out, kEndings);
  if (!good) good.error().remedy += "; HDF5 is made by hdf5_from_trace.py, among the examples";
  return good;
}

}  // namespace

int runTraceInfo(const CommandOptions& options, const std::filesystem::path& file) {
  const auto summary =
      withProgress("reading", [&](const auto& progress) { return trace::summariseTrace(file, progress); });
  if (!summary) return report(errorOf(file, summary.error()), options.json);
  const bool being_written = trace::isBeingWritten(file);
  return show(options, infoJson(*summary, being_written),
              fitted(infoText(*summary, being_written), terminalSize().columns));
}

int runTraceBreaches(const CommandOptions& options, const std::filesystem::path& file) {
  const auto breaches =
      withProgress("reading", [&](const auto& progress) { return trace::breachesIn(file, progress); });
  if (!breaches) return report(errorOf(file, breaches.error()), options.json);
  return show(options, breachJson(*breaches), breachText(*breaches, terminalSize().columns));
}

int runTraceRecover(const CommandOptions& options, const std::filesystem::path& file,
                    const std::string& out) {
  const auto recovered = withProgress("recovering", [&](const auto& progress) {
    return trace::recoverTrace(file, out.empty() ? trace::recoveredName(file) : std::filesystem::path(out),
                               progress);
  });
  if (!recovered) return report(recovered.error(), options.json);
  return show(options, recoveryJson(*recovered), fitted(recoveryText(*recovered), terminalSize().columns));
}

int runTraceExport(const CommandOptions& options, const std::filesystem::path& file,
                   const ExportOptions& requested) {
  if (requested.format == "recording") return exportDepth(options, file, requested);
  if (requested.format == "rosbag2") return exportAsBag(options, file, requested);
  const std::filesystem::path out =
      requested.out.empty() ? besideHere(file, ".csv") : std::filesystem::path(requested.out);
  if (const auto good = mayBecome(out, file); !good) return report(good.error(), options.json);
  if (const auto good = mayBecomeCsv(out); !good) return report(good.error(), options.json);
  const auto rows = withProgress("exporting", [&](const auto& progress) {
    return exportCsv(file, out, channelOf(requested.channel), requested.selection, progress,
                     requested.if_exists);
  });
  if (!rows) return report(errorOf(file, rows.error()), options.json);
  const std::string settings = trace::settingsBeside(out).string();
  return show(options, {{"file", out.string()}, {"rows", *rows}, {"settings", settings}},
              fmt::format("{}: {}\n{}: the settings\n", printable(out.string()),
                          base::counted(*rows, "row(s)"), printable(settings)));
}

int runTracePlot(const CommandOptions& options, const std::filesystem::path& file,
                 const PlotOptions& requested) {
  const std::filesystem::path out =
      requested.out.empty() ? besideHere(file, "." + requested.format) : std::filesystem::path(requested.out);
  if (const auto good = mayBecome(out, file); !good) return report(good.error(), options.json);
  const auto drawn = withProgress("drawing", [&](const auto& progress) {
    return plotTrace(file, out, requested.selection, progress, requested.if_exists);
  });
  if (!drawn) return report(errorOf(file, drawn.error()), options.json);
  return show(options, {{"file", out.string()}}, printable(out.string()) + "\n");
}

}  // namespace hapticd::tools
