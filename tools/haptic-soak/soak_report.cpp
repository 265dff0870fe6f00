// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/soak_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tools/haptic-soak/memory_trend.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

/// When a counter of the status must be zero.
enum class MustBeZero { never, always, when_strict, when_locked };

struct Counter {
  const char* what;
  const char* path;  ///< in GetStatus
  MustBeZero must;
};

constexpr Counter kCounters[] = {
    {"ticks lost between the loop and the trace", "loop.traceTicksDropped", MustBeZero::always},
    {"page faults of the force thread since its first tick", "loop.pageFaults", MustBeZero::when_locked},
    {"points over capacity", "scene.pointsOverCapacity", MustBeZero::always},
    {"ticks with a force that was not finite", "loop.counters.notFiniteTicks", MustBeZero::always},
    {"ticks that ended after the next was due", "loop.counters.overruns", MustBeZero::when_strict},
    {"periods left out", "loop.counters.skippedPeriods", MustBeZero::when_strict},
    {"ticks with a neighbourhood not modelled completely", "loop.counters.outsideModelTicks",
     MustBeZero::never},
    {"ticks with stale depth", "loop.counters.depthStaleTicks", MustBeZero::never},
    {"ticks with a stale handle", "loop.counters.handleStaleTicks", MustBeZero::never},
    {"ticks with an invalid handle", "loop.counters.handleInvalidTicks", MustBeZero::never},
    {"frames damaged", "camera.damagedFrames", MustBeZero::never},
    {"frames replaced before they were modelled", "scene.skippedFrames", MustBeZero::never},
};

std::optional<double> known(double value) {
  return std::isnan(value) ? std::nullopt : std::optional(value);
}

std::optional<double> limitOf(MustBeZero must, const SoakLimits& limits, bool locked) {
  const bool zero = must == MustBeZero::always || (must == MustBeZero::when_strict && limits.strict) ||
                    (must == MustBeZero::when_locked && (locked || limits.strict));
  return zero ? std::optional(0.0) : std::nullopt;
}

template <typename Member>
double sumOver(const std::vector<ClientTally>& clients, Member member) {
  double sum = 0;
  for (const ClientTally& tally : clients) sum += static_cast<double>(tally.*member);
  return sum;
}

/// The growth that is beyond what the scatter explains.
double grownMemory_kb(const std::vector<ProcessSample>& samples) {
  std::vector<MemoryPoint> points;
  for (const ProcessSample& sample : samples) {
    points.push_back({sample.time_s, static_cast<double>(sample.resident_kb)});
  }
  const MemoryTrend trend = memoryTrend(points);
  return std::max(0.0, trend.growth_kb - trend.noise_kb);
}

double difference(std::uint64_t after, std::uint64_t before) {
  return static_cast<double>(after) - static_cast<double>(before);
}

void addProcess(std::vector<SoakFinding>& findings, const SoakResult& result, const SoakLimits& limits,
                bool locked) {
  const auto& samples = result.samples;
  const bool ended = result.early_ending.has_value();
  const auto whenAlive = [ended](double value) { return ended ? std::nullopt : std::optional(value); };
  const double length_s = samples.empty() ? 0 : samples.back().time_s;
  double most_kb = 0;
  for (const ProcessSample& sample : samples)
    most_kb = std::max(most_kb, static_cast<double>(sample.resident_kb));
  const std::uint64_t first_faults = samples.empty() ? 0 : samples.front().force_thread_faults;
  const std::uint64_t last_faults = samples.empty() ? 0 : samples.back().force_thread_faults;
  findings.push_back({"growth of memory beyond its noise, kB", grownMemory_kb(samples),
                      limits.memory_growth_kb.value_or(allowedGrowth_kb(length_s))});
  findings.push_back({"most memory in use, kB", most_kb, limits.memory_kb});
  findings.push_back({"growth of descriptors, without clients",
                      whenAlive(difference(result.after.descriptors, result.before.descriptors)), 0});
  findings.push_back({"growth of threads, without clients",
                      whenAlive(difference(result.after.threads, result.before.threads)), 0});
  findings.push_back({"page faults of the force thread, by the kernel", difference(last_faults, first_faults),
                      limitOf(MustBeZero::when_locked, limits, locked)});
}

void addClients(std::vector<SoakFinding>& findings, const SoakResult& result, const SoakLimits& limits) {
  const auto& clients = result.clients;
  findings.push_back({"calls without an answer", sumOver(clients, &ClientTally::unanswered), 0});
  findings.push_back({"forbidden values taken", sumOver(clients, &ClientTally::wrongly_taken), 0});
  findings.push_back({"changes that the loop did not take in time",
                      sumOver(clients, &ClientTally::not_applied),
                      limitOf(MustBeZero::when_strict, limits, false)});
  findings.push_back(
      {"replies of streams left out for slow clients", sumOver(clients, &ClientTally::left_out), {}});
  findings.push_back({"replug commands that failed", static_cast<double>(result.failed_replugs), 0});
}

void addCounters(std::vector<SoakFinding>& findings, const SoakResult& result, const SoakLimits& limits,
                 bool locked) {
  for (const Counter& counter : kCounters) {
    findings.push_back(
        {counter.what, known(numberAt(result.status, counter.path)), limitOf(counter.must, limits, locked)});
  }
}

void addProfile(fmt::memory_buffer& text, const std::vector<ProcessSample>& samples) {
  fmt::format_to(std::back_inserter(text), "  {:>8}{:>12}{:>14}{:>10}{:>20}\n", "time, s", "memory, kB",
                 "descriptors", "threads", "force thread faults");
  constexpr std::size_t kRows = 10;
  for (std::size_t row = 0; row <= kRows && !samples.empty(); ++row) {
    const ProcessSample& sample = samples[row * (samples.size() - 1) / kRows];
    fmt::format_to(std::back_inserter(text), "  {:>8.1f}{:>12}{:>14}{:>10}{:>20}\n", sample.time_s,
                   sample.resident_kb, sample.descriptors, sample.threads, sample.force_thread_faults);
  }
}

void addClientRows(fmt::memory_buffer& text, const std::vector<ClientTally>& clients) {
  fmt::format_to(std::back_inserter(text), "\n  {:<20}{:>10}{:>10}{:>13}{:>10}\n", "client", "answers",
                 "refused", "unanswered", "left out");
  for (const ClientTally& tally : clients) {
    fmt::format_to(std::back_inserter(text), "  {:<20}{:>10}{:>10}{:>13}{:>10}  {}\n", tally.name,
                   tally.calls, tally.refused, tally.unanswered, tally.left_out,
                   printable(tally.first_problem));
  }
}

std::string numberText(const std::optional<double>& number) {
  return number ? fmt::format("{:.0f}", *number) : "-";
}

}  // namespace

std::vector<SoakFinding> findingsOf(const SoakResult& result, const SoakLimits& limits) {
  const bool locked = flagAt(result.status, "loop.memoryLocked");
  const bool ended_well = result.ending && result.ending->good();
  std::vector<SoakFinding> findings;
  addCounters(findings, result, limits, locked);
  addProcess(findings, result, limits, locked);
  addClients(findings, result, limits);
  findings.push_back({"ends before SIGTERM", result.early_ending ? 1.0 : 0.0, 0});
  findings.push_back({"bad ends after SIGTERM", ended_well || result.early_ending ? 0.0 : 1.0, 0});
  return findings;
}

std::string soakTable(const SoakResult& result, const std::vector<SoakFinding>& findings) {
  fmt::memory_buffer text;
  addProfile(text, result.samples);
  addClientRows(text, result.clients);
  fmt::format_to(std::back_inserter(text),
                 "\n  {} ticks, {} frames, {} reloads, {} replugs\n\n  {:<56}{:>12}{:>10}\n",
                 countAt(result.status, "loop.counters.ticks"), countAt(result.status, "camera.frames"),
                 result.reloads, result.replugs, "what was lost, failed or grew", "", "at most");
  for (const SoakFinding& finding : findings) {
    fmt::format_to(std::back_inserter(text), "  {:<56}{:>12}{:>10}{}\n", finding.what,
                   numberText(finding.value), numberText(finding.limit), finding.broken() ? "  BROKEN" : "");
  }
  if (!result.status_error.empty()) {
    fmt::format_to(std::back_inserter(text), "\nno status at the end: {}\n", printable(result.status_error));
  }
  if (result.early_ending) {
    fmt::format_to(std::back_inserter(text), "\nhapticd ended by itself: {}\n", result.early_ending->text());
  }
  if (!result.last_words.empty()) {
    fmt::format_to(std::back_inserter(text), "last output of hapticd:\n{}\n", result.last_words);
  }
  return fmt::to_string(text);
}

std::string soakJson(const SoakResult& result, const std::vector<SoakFinding>& findings) {
  const auto numberOrNull = [](const std::optional<double>& number) {
    return number ? Json(*number) : Json();
  };
  Json document = {{"interrupted", result.interrupted}, {"reloads", result.reloads},
                   {"replugs", result.replugs},         {"findings", Json::array()},
                   {"samples", Json::array()},          {"status", result.status}};
  for (const SoakFinding& finding : findings) {
    document["findings"].push_back({{"what", finding.what},
                                    {"value", numberOrNull(finding.value)},
                                    {"limit", numberOrNull(finding.limit)},
                                    {"broken", finding.broken()}});
  }
  for (const ProcessSample& sample : result.samples) {
    document["samples"].push_back({{"time_s", sample.time_s},
                                   {"resident_kb", sample.resident_kb},
                                   {"descriptors", sample.descriptors},
                                   {"threads", sample.threads},
                                   {"force_thread_faults", sample.force_thread_faults}});
  }
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace hapticd::tools
