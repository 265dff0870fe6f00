// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/jitter/jitter_study.h"

#include <fmt/format.h>

#include "tools/hapticbench/table.h"

namespace hapticd::tools {
namespace {

/// The loop and load of one line of the table.
struct LoopRow {
  std::string load;
  std::string loop;
  WakeupCounts counts;
};

const std::vector<Column<LoopRow>>& columns() {
  using Row = LoopRow;
  static const std::vector<Column<Row>> all{
      {"", "load", 0, &Row::load},
      {"", "loop", 0, &Row::loop},
      {"", "wake-ups", 0, [](const Row& r) { return r.counts.total(); }},
      {"/p50_us", "p50", 0, [](const Row& r) { return r.counts.quantile_us(0.5); }},
      {"/p99_us", "p99", 0, [](const Row& r) { return r.counts.quantile_us(0.99); }},
      {"/p999_us", "p99.9", 0, [](const Row& r) { return r.counts.quantile_us(0.999); }},
      {"/max_us", "max", 0, [](const Row& r) { return r.counts.max_us(); }}};
  return all;
}

std::string loadText(const LoadJitter& load) {
  const LoopRun ours = load.ours();
  const std::vector<double> ratios = load.sortedRatios();
  std::string text = fmt::format(
      "\n{}: p99.9, hapticd by cyclictest: {:.2f}, at most {:.2f} ({})\n"
      "  in single rounds {:.2f} to {:.2f}, in half of them up to {:.2f}\n"
      "  overruns of hapticd {}, longest tick {:.1f} us, in contact {:.0f} %",
      load.load, load.ratio(), kMostLatencyRatio, load.kept() ? "kept" : "not kept", ratios.front(),
      ratios.back(), ratios[(ratios.size() - 1) / 2], ours.overruns,
      static_cast<double>(ours.longest_tick_ns) * 1e-3,
      100 * static_cast<double>(ours.contact_ticks) / static_cast<double>(ours.wakeups.total()));
  if (ours.lost_ticks != 0) text += fmt::format(", {} ticks lost because the ring was full", ours.lost_ticks);
  return text + "\n";
}

Json countsJson(const WakeupCounts& counts, const char* counted) {
  Json object{{counted, counts.total()}};
  object.update(tableJson(columns(), std::vector<LoopRow>{{"", "", counts}}).front());
  Json& histogram = object["histogram_us"] = Json::object();
  for (const auto& [latency_us, wakeups] : counts.counts()) histogram[std::to_string(latency_us)] = wakeups;
  return object;
}

Json loadJson(const LoadJitter& load) {
  const LoopRun ours = load.ours();
  Json hapticd = countsJson(ours.wakeups, "wakeups");
  hapticd.update({{"overruns", ours.overruns},
                  {"lost_ticks", ours.lost_ticks},
                  {"contact_ticks", ours.contact_ticks},
                  {"longest_tick_ns", ours.longest_tick_ns}});
  Json ratios = Json::array();
  for (const JitterRound& round : load.rounds) ratios.push_back(round.ratio());
  return {{"load", load.load},
          {"hapticd", std::move(hapticd)},
          {"cyclictest", countsJson(load.theirs(), "wakeups")},
          {"last_hop", countsJson(ours.last_hop, "commands")},
          {"ratio_p999", load.ratio()},
          {"ratio_limit", kMostLatencyRatio},
          {"kept", load.kept()},
          {"round_ratios_p999", std::move(ratios)}};
}

}  // namespace

std::string jitterText(const JitterResult& result) {
  const JitterOptions& options = result.options;
  std::string text = fmt::format(
      "Wake-up latency, us: CPU {}, SCHED_FIFO {}, period {} us, {} rounds of {} s each in turn\n",
      options.cpu, options.priority, options.period_us, options.rounds, options.seconds);
  if (!result.memory_locked) text += "hapticd's memory is not locked (not permitted)\n";
  if (!result.idle_limited) text += "CPUs may sleep deeply (/dev/cpu_dma_latency is not writable)\n";
  std::vector<LoopRow> rows;
  for (const LoadJitter& load : result.loads) {
    rows.push_back({load.load, "hapticd", load.ours().wakeups});
    rows.push_back({load.load, "cyclictest", load.theirs()});
    rows.push_back({load.load, "last hop", load.ours().last_hop});
  }
  text += "\n" + tableText(columns(), rows);
  for (const LoadJitter& load : result.loads) text += loadText(load);
  return text;
}

std::string jitterJson(const JitterResult& result) {
  const JitterOptions& options = result.options;
  Json loads = Json::array();
  for (const LoadJitter& load : result.loads) loads.push_back(loadJson(load));
  const Json document{{"cpu", options.cpu},
                      {"priority", options.priority},
                      {"period_us", options.period_us},
                      {"rounds", options.rounds},
                      {"phase_s", options.seconds},
                      {"memory_locked", result.memory_locked},
                      {"idle_limited", result.idle_limited},
                      {"loads", std::move(loads)}};
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
