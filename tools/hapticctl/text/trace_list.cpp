// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/trace_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/hapticctl/text/status_text.h"
#include "tools/hapticctl/text/time_text.h"
#include "tools/lib/text/table.h"

namespace hapticd::tools {
namespace {

/// "2026-03-04T05-06-07Z-", what names of traces begin with in front of their label.
constexpr std::size_t kTimeLength = 21;

/// The part of a name that a person has chosen; the whole name where it does not begin with a time.
std::string labelOf(const std::string& name) {
  const bool timed = name.size() >= kTimeLength - 1 && name[kTimeLength - 2] == 'Z' && name[10] == 'T';
  if (!timed) return name;
  return name.size() > kTimeLength ? name.substr(kTimeLength) : "";
}

bool isChosen(const Json& trace, const TraceListOptions& options) {
  const auto begin_ns = traceBegin_ns(trace);
  if (options.since_ns && !(begin_ns && *begin_ns >= static_cast<double>(*options.since_ns))) return false;
  if (options.until_ns && !(begin_ns && *begin_ns <= static_cast<double>(*options.until_ns))) return false;
  if (options.state == "writing" && !flagAt(trace, "open")) return false;
  if (options.state == "finished" && (flagAt(trace, "open") || flagAt(trace, "damaged"))) return false;
  if (options.state == "damaged" && !flagAt(trace, "damaged")) return false;
  if (options.state == "kept" && !flagAt(trace, "kept")) return false;
  return labelOf(textAt(trace, "name")).find(options.label) != std::string::npos;
}

std::string stateText(const Json& trace) {
  std::string text = flagAt(trace, "open")      ? "being written"
                     : flagAt(trace, "damaged") ? "damaged original"
                                                : "finished";
  if (flagAt(trace, "kept")) text += ", kept";
  if (flagAt(trace, "depth")) text += ", with depth";
  return text;
}

double bytesOf(const Json& traces) {
  double bytes = 0;
  for (const Json& trace : traces) bytes += std::max(numberAt(trace, "bytes"), 0.0);
  return bytes;
}

}  // namespace

std::optional<double> traceBegin_ns(const Json& trace) {
  const Json* const clock = fieldAt(trace, "clockIsSet");
  if (clock != nullptr && *clock == false) return std::nullopt;
  return numberAt(trace, fieldAt(trace, "beginNs") ? "beginNs" : "timeNs");
}

std::int64_t latestBegin_ns(const Json& reply) {
  double latest_ns = 0;
  for (const Json& trace : listAt(reply, "traces")) {
    latest_ns = std::fmax(latest_ns, traceBegin_ns(trace).value_or(0));
  }
  return static_cast<std::int64_t>(latest_ns);
}

Json chosenTraces(const Json& reply, const TraceListOptions& options) {
  std::vector<Json> traces;
  for (const Json& trace : listAt(reply, "traces")) {
    if (isChosen(trace, options)) traces.push_back(trace);
  }
  // the reply is in the order of time, which traces of the same size or name keep
  if (options.sort == "name") {
    std::ranges::stable_sort(traces, {}, [](const Json& trace) { return textAt(trace, "name"); });
  } else if (options.sort == "size") {
    std::ranges::stable_sort(traces, {}, [](const Json& trace) { return numberAt(trace, "bytes"); });
  }
  if (options.reverse) std::ranges::reverse(traces);
  Json chosen = Json::array();
  for (Json& trace : traces) chosen.push_back(std::move(trace));
  return chosen;
}

std::string traceSumText(const Json& traces) {
  return fmt::format("{} {}, {}", traces.size(), traces.size() == 1 ? "trace" : "traces",
                     bytesText(bytesOf(traces)));
}

std::string traceListText(const Json& traces, const Json& reply, std::optional<std::int64_t> now_ns,
                          std::size_t columns) {
  const Json& all = listAt(reply, "traces");
  if (all.empty()) return fmt::format("there are no traces in {}\n", textAt(reply, "folder"));
  Table table({{"NAME"}, {"BEGIN"}, {"AGE", true}, {"SIZE", true}, {"STATE"}, {"NOTE"}});
  for (const Json& trace : traces) {
    const auto begin_ns = traceBegin_ns(trace);
    const std::string note = textAt(trace, "note");
    const std::string age =
        begin_ns && now_ns ? ageText((static_cast<double>(*now_ns) - *begin_ns) / 1e9) : "-";
    table.add({textAt(trace, "name"), begin_ns ? utcTime(*begin_ns) : "-", age,
               bytesText(numberAt(trace, "bytes")), stateText(trace), note == "-" ? "" : note});
  }
  std::string text = (traces.empty() ? "" : table.text(columns)) + traceSumText(traces);
  if (traces.size() != all.size()) text += fmt::format(" of {}", traceSumText(all));
  if (const double omitted = numberAt(reply, "omitted"); omitted > 0) {
    text += fmt::format("; hapticd lists the newest only and left out {:.0f}", omitted);
  }
  return text + "\n";
}

TraceDeletion deletionOf(const std::vector<std::string>& names, const Json& reply) {
  TraceDeletion deletion;
  const Json& traces = listAt(reply, "traces");
  for (const std::string& name : names) {
    const auto found =
        std::ranges::find_if(traces, [&](const Json& trace) { return textAt(trace, "name") == name; });
    if (found == traces.end()) {
      deletion.problems.push_back(printable(name) + ": there is no such trace");
    } else if (flagAt(*found, "open")) {
      deletion.problems.push_back(name + " is being written (hapticctl trace stop)");
    } else if (flagAt(*found, "kept")) {
      deletion.problems.push_back(fmt::format("{0} is kept (hapticctl trace keep --undo {0})", name));
    } else if (std::ranges::find(deletion.to_delete, *found) == deletion.to_delete.end()) {
      deletion.to_delete.push_back(*found);
    }
  }
  return deletion;
}

TraceDeletion deletionBefore(std::int64_t time_ns, const Json& reply) {
  TraceDeletion deletion;
  for (const Json& trace : listAt(reply, "traces")) {
    const auto begin_ns = traceBegin_ns(trace);
    if (begin_ns && !(*begin_ns < static_cast<double>(time_ns))) continue;
    const std::string name = textAt(trace, "name");
    if (flagAt(trace, "open") || flagAt(trace, "kept")) {
      deletion.staying.push_back(name + " stays: it is kept or being written");
    } else if (!begin_ns) {
      deletion.staying.push_back(name + " stays: its age is not known, because the clock had not been set");
    } else {
      deletion.to_delete.push_back(trace);
    }
  }
  return deletion;
}

}  // namespace hapticd::tools
