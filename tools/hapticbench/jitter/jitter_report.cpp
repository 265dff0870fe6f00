// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/jitter/jitter_report.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/gnuplot/gnuplot.h"

namespace hapticd::tools {
namespace {

using nlohmann::ordered_json;

void addRow(fmt::memory_buffer& text, const std::string& load, const char* who, const WakeupCounts& counts) {
  fmt::format_to(std::back_inserter(text), "  {:<8}{:<12}{:>10}{:>8}{:>8}{:>8}{:>8}\n", load, who,
                 counts.total(), counts.quantile_us(0.5), counts.quantile_us(0.99), counts.quantile_us(0.999),
                 counts.max_us());
}

void addLoad(fmt::memory_buffer& text, const LoadJitter& load) {
  const LoopRun ours = load.ours();
  addRow(text, load.load, "hapticd", ours.wakeups);
  addRow(text, "", "cyclictest", load.theirs());
  addRow(text, "", "last hop", ours.last_hop);
  const std::vector<double> ratios = load.sortedRatios();
  fmt::format_to(std::back_inserter(text),
                 "  {:<8}p99.9, hapticd by cyclictest: {:.2f}, at most {:.2f} ({})\n", "", load.ratio(),
                 kMostLatencyRatio, load.kept() ? "kept" : "not kept");
  fmt::format_to(std::back_inserter(text),
                 "  {:<8}in single rounds {:.2f} to {:.2f}, in half of them up to {:.2f}\n", "",
                 ratios.front(), ratios.back(), ratios[(ratios.size() - 1) / 2]);
  fmt::format_to(std::back_inserter(text),
                 "  {:<8}hapticd's overruns {}, longest tick {:.1f} us, in contact {:.0f} %", "",
                 ours.overruns, static_cast<double>(ours.longest_tick_ns) * 1e-3,
                 100 * static_cast<double>(ours.contact_ticks) / static_cast<double>(ours.wakeups.total()));
  if (ours.lost_ticks != 0) {
    fmt::format_to(std::back_inserter(text), ", {} ticks not taken out in time", ours.lost_ticks);
  }
  fmt::format_to(std::back_inserter(text), "\n");
}

ordered_json countsJson(const WakeupCounts& counts, const char* counted = "wakeups") {
  ordered_json histogram = ordered_json::object();
  for (const auto& [latency_us, wakeups] : counts.counts()) histogram[std::to_string(latency_us)] = wakeups;
  return {{counted, counts.total()},
          {"p50_us", counts.quantile_us(0.5)},
          {"p99_us", counts.quantile_us(0.99)},
          {"p999_us", counts.quantile_us(0.999)},
          {"max_us", counts.max_us()},
          {"histogram_us", std::move(histogram)}};
}

ordered_json loadJson(const LoadJitter& load) {
  const LoopRun ours = load.ours();
  ordered_json hapticd = countsJson(ours.wakeups);
  hapticd.update({{"overruns", ours.overruns},
                  {"lost_ticks", ours.lost_ticks},
                  {"contact_ticks", ours.contact_ticks},
                  {"longest_tick_ns", ours.longest_tick_ns}});
  ordered_json ratios = ordered_json::array();
  for (const JitterRound& round : load.rounds) ratios.push_back(round.ratio());
  return {{"load", load.load},
          {"hapticd", std::move(hapticd)},
          {"cyclictest", countsJson(load.theirs())},
          {"last_hop", countsJson(ours.last_hop, "commands")},
          {"ratio_p999", load.ratio()},
          {"ratio_limit", kMostLatencyRatio},
          {"kept", load.kept()},
          {"round_ratios_p999", std::move(ratios)}};
}

void addBlock(fmt::memory_buffer& script, const std::string& name, const WakeupCounts& counts) {
  fmt::format_to(std::back_inserter(script), "${} << END\n", name);
  // a logarithmic axis has no place for 0
  for (const auto& [latency_us, wakeups] : counts.counts()) {
    fmt::format_to(std::back_inserter(script), "{} {}\n", static_cast<double>(latency_us) + 0.5, wakeups);
  }
  fmt::format_to(std::back_inserter(script), "END\n");
}

}  // namespace

std::string jitterTable(const JitterResult& result) {
  const JitterOptions& options = result.options;
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "Wake-up latency, us: CPU {}, SCHED_FIFO {}, period {} us, {} rounds of {} s each in turn\n",
                 options.cpu, options.priority, options.period_us, options.rounds, options.seconds);
  if (!result.memory_locked)
    fmt::format_to(std::back_inserter(text), "hapticd's memory is not locked (not permitted)\n");
  if (!result.idle_limited) {
    fmt::format_to(std::back_inserter(text),
                   "CPUs may sleep deeply (/dev/cpu_dma_latency is not writable)\n");
  }
  fmt::format_to(std::back_inserter(text), "\n  {:<8}{:<12}{:>10}{:>8}{:>8}{:>8}{:>8}\n", "load", "loop",
                 "wake-ups", "p50", "p99", "p99.9", "max");
  for (const LoadJitter& load : result.loads) addLoad(text, load);
  return fmt::to_string(text);
}

std::string jitterJson(const JitterResult& result) {
  const JitterOptions& options = result.options;
  ordered_json loads = ordered_json::array();
  for (const LoadJitter& load : result.loads) loads.push_back(loadJson(load));
  const ordered_json document = {{"cpu", options.cpu},
                                 {"priority", options.priority},
                                 {"period_us", options.period_us},
                                 {"rounds", options.rounds},
                                 {"phase_s", options.seconds},
                                 {"memory_locked", result.memory_locked},
                                 {"idle_limited", result.idle_limited},
                                 {"loads", std::move(loads)}};
  return document.dump(2) + "\n";
}

std::string jitterPlotScript(const JitterResult& result) {
  fmt::memory_buffer script;
  const auto add = [&script](const std::string& text) {
    fmt::format_to(std::back_inserter(script), "{}", text);
  };
  add(fmt::format("set terminal svg size 900,{} background rgb 'white'\n", 360 * result.loads.size()));
  add(
      fmt::format("set multiplot layout {},1\nset logscale xy\nset grid\nset key top right\n"
                  "set xlabel 'wake-up latency, us'\nset ylabel 'wake-ups'\n",
                  result.loads.size()));
  for (const LoadJitter& load : result.loads) {
    addBlock(script, "ours", load.ours().wakeups);
    addBlock(script, "theirs", load.theirs());
    add(
        fmt::format("set title '{}: {} rounds of {} s each' noenhanced\n"
                    "plot $theirs with steps lw 2 lc rgb '#909090' title 'cyclictest', "
                    "$ours with steps lw 2 lc rgb '#303090' title 'hapticd'\n",
                    load.load, result.options.rounds, result.options.seconds));
  }
  add("unset multiplot\n");
  return fmt::to_string(script);
}

}  // namespace hapticd::tools
