// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/export/breach_report.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

#include "config/settings/event_kind.h"
#include "config/settings/fixture_settings.h"
#include "daemon/trace/format/messages.h"
#include "rt/base/words.h"

namespace hapticd::trace {
namespace {

std::string_view fieldOf(const EventRecord& event, std::string_view name) {
  const auto found = std::ranges::find(event.fields, name, &std::pair<std::string, std::string>::first);
  return found == event.fields.end() ? std::string_view() : std::string_view(found->second);
}

/// Takes a number from the beginning of a text. Not a number: there is none.
double takeNumber(std::string_view& text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || !std::isfinite(number)) return BreachEntry::kNotKnown;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

double numberOf(const EventRecord& event, std::string_view name) {
  std::string_view text = fieldOf(event, name);
  return takeNumber(text);
}

/// `first_ns`: of the trace, in the clock of the events.
BreachEntry entryOf(const EventRecord& event, std::int64_t first_ns) {
  std::string_view place = fieldOf(event, "ENTERED_M");
  BreachEntry entry{
      .fixture = std::string(fieldOf(event, "FIXTURE")),
      .time_s = static_cast<double>(event.time_ns - first_ns) * 1e-9 - numberOf(event, "ENTERED_AGE_S"),
      .duration_s = numberOf(event, "DURATION_S"),
      .depth_m = numberOf(event, "DEPTH_M"),
      .entry_m_per_s = numberOf(event, "ENTRY_SPEED_M_PER_S"),
      .speed_m_per_s = numberOf(event, "SPEED_M_PER_S"),
      .force_n = numberOf(event, "FORCE_N")};
  entry.entered_m_in_world.x = takeNumber(place);
  entry.entered_m_in_world.y = takeNumber(place);
  entry.entered_m_in_world.z = takeNumber(place);
  return entry;
}

FixtureBreaches& sumOf(const std::string& fixture, std::vector<FixtureBreaches>& sums) {
  const auto found = std::ranges::find(sums, fixture, &FixtureBreaches::fixture);
  if (found != sums.end()) return *found;
  sums.push_back({.fixture = fixture});
  return sums.back();
}

/// std::fmax: what is not known leaves the other one.
void add(const BreachEntry& entry, FixtureBreaches& sum) {
  ++sum.count;
  sum.total_s += std::isfinite(entry.duration_s) ? entry.duration_s : 0;
  sum.longest_s = std::fmax(sum.longest_s, entry.duration_s);
  sum.deepest_m = std::fmax(sum.deepest_m, entry.depth_m);
  sum.fastest_entry_m_per_s = std::fmax(sum.fastest_entry_m_per_s, entry.entry_m_per_s);
  sum.largest_force_n = std::fmax(sum.largest_force_n, entry.force_n);
}

/// Names the forbidden regions of a record. One that this version cannot read names none: its breaches do.
void addNames(const AdditionsRecord& record, const std::string& file, std::vector<FixtureBreaches>& sums) {
  const auto additions = config::additionsFromText(record.text, file);
  if (!additions) return;
  for (const config::FixtureSettings& fixture : additions->fixtures) {
    if (!rt::isGuidance(fixture.kind) && fixture.effect == rt::FixtureEffect::hold) sumOf(fixture.name, sums);
  }
}

}  // namespace

base::Result<BreachReport> breachesIn(const std::filesystem::path& trace, const Progress& progress) {
  BreachReport report;
  std::vector<EventRecord> events;
  const std::string_view breach = rt::wordOf(config::EventKind::breach);
  auto info = readTrace(trace, {.additions =
                                    [&](const AdditionsRecord& record) {
                                      addNames(record, trace.string(), report.fixtures);
                                      return true;
                                    },
                                .event =
                                    [&](const EventRecord& event) {
                                      if (event.kind == breach) events.push_back(event);
                                      return true;
                                    },
                                .progress = progress});
  if (!info) return std::unexpected(info.error());
  if (auto has = info->require(trace, kChannelName<EventRecord>.topic); !has)
    return std::unexpected(has.error());
  report.info = std::move(*info);
  const std::int64_t first_ns = report.info.first_ns - report.info.realtime_offset_ns;
  for (const EventRecord& event : events) {
    BreachEntry& entry = report.breaches.emplace_back(entryOf(event, first_ns));
    add(entry, sumOf(entry.fixture, report.fixtures));
    report.lacks_speeds |= std::isnan(entry.entry_m_per_s);
  }
  // Times that are not known are last.
  std::ranges::stable_sort(report.breaches, {}, [](const BreachEntry& entry) {
    return std::isnan(entry.time_s) ? std::numeric_limits<double>::infinity() : entry.time_s;
  });
  return report;
}

}  // namespace hapticd::trace
