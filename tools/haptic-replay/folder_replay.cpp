// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/folder_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "tools/haptic-replay/trace_replay.h"
#include "tools/lib/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

std::unexpected<base::Error> unreadable(const fs::path& folder, const std::error_code& error) {
  return std::unexpected(
      base::Error{folder.string(), "cannot be read: " + error.message(), "name a folder of traces"});
}

base::Result<TraceComparison> replayInto(ForceTable* table, const fs::path& trace) {
  auto replay = TraceReplay::open(trace);
  if (!replay) return std::unexpected(replay.error());
  TraceReplay::OnTick on_tick;
  if (table != nullptr) {
    on_tick = [table](const rt::Tick& recorded, const rt::Tick& computed) { table->add(recorded, computed); };
  }
  return replay->run(on_tick);
}

}  // namespace

base::Result<std::vector<TraceFile>> tracesIn(const fs::path& folder) {
  std::error_code error;
  std::vector<TraceFile> traces;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code vanished;
    const std::uint64_t bytes = entry->file_size(vanished);
    if (entry->path().extension() == ".mcap" && !vanished)
      traces.push_back({entry->path().filename().string(), bytes});
  }
  if (error) return unreadable(folder, error);
  if (traces.empty()) {
    return std::unexpected(base::Error{folder.string(), "holds no finished trace (*.mcap)",
                                       "hapticctl trace stop finishes one"});
  }
  std::ranges::sort(traces, {}, &TraceFile::name);
  return traces;
}

TraceOutcome replayOne(const fs::path& trace, const fs::path& out) {
  TraceOutcome outcome{.name = trace.filename().string(), .error = {}, .comparison = {}};
  ForceTable table;
  const auto comparison = replayInto(out.empty() ? nullptr : &table, trace);
  if (!comparison) {
    outcome.error = comparison.error().text();
    return outcome;
  }
  outcome.comparison = *comparison;
  if (out.empty()) return outcome;
  const fs::path csv = out / trace.stem().concat(".csv");
  if (const auto written = writeWholeFile(csv, table.text(), IfExists::replace); !written)
    outcome.error = written.error().text();
  return outcome;
}

std::string outcomesText(const std::vector<TraceOutcome>& outcomes) {
  std::string text;
  std::size_t replayed = 0;
  TraceComparison all;
  std::uint64_t left_out = 0;
  std::string worst;
  for (const TraceOutcome& outcome : outcomes) {
    const TraceComparison& one = outcome.comparison;
    text += outcome.name + "\n";
    text += outcome.error.empty() ? comparisonText(one) : "not replayed: " + outcome.error + "\n";
    text += "\n";
    if (!outcome.error.empty()) continue;
    ++replayed;
    all.ticks += one.ticks;
    all.different += one.different;
    left_out += leftOut(one);
    if (one.worst_tick != 0 && one.largest_difference_n >= all.largest_difference_n) {
      all.largest_difference_n = one.largest_difference_n;
      worst = fmt::format(" in {} at tick {}", outcome.name, one.worst_tick);
    }
  }
  return text + fmt::format(
                    "{} traces, {} of them replayed: {} ticks computed again, {} left out\n"
                    "different: {} ticks\n"
                    "largest difference: {:g} N of the commanded force{}\n",
                    outcomes.size(), replayed, all.ticks, left_out, all.different, all.largest_difference_n,
                    worst);
}

std::string outcomesJson(const std::vector<TraceOutcome>& outcomes) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& [name, error, one] : outcomes) {
    auto& row = list.emplace_back(nlohmann::ordered_json{{"name", name}});
    if (!error.empty()) {
      row["error"] = error;
      continue;
    }
    row["ticks"] = one.ticks;
    row["in_contact"] = one.in_contact;
    row["left_out"] = leftOut(one);
    row["missing_frames"] = one.missing_frames;
    row["different"] = one.different;
    row["largest_difference_n"] = one.largest_difference_n;
    row["worst_tick"] = one.worst_tick;
    row["largest_law_difference_n"] = one.largest_law_difference_n;
  }
  return nlohmann::ordered_json{{"traces", list}}.dump(2) + "\n";
}

DividedRun runOf(const std::vector<TraceFile>& traces) {
  nlohmann::json input = nlohmann::json::array();
  for (const TraceFile& trace : traces) input.push_back({trace.name, trace.bytes});
  return {.program = "haptic-replay", .version = HAPTICD_VERSION, .input = input, .cases = traces.size()};
}

}  // namespace hapticd::tools
