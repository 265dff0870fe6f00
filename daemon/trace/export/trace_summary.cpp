// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/export/trace_summary.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

#include "config/settings/event_kind.h"
#include "config/settings/fixture_settings.h"
#include "config/yaml/yaml_reader.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/reader/trace_folder.h"
#include "rt/base/clock.h"
#include "rt/base/words.h"
#include "rt/laws/law_table.h"

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

std::string_view settingsText(const TraceInfo& trace) {
  for (const TraceAttachment& attachment : trace.attachments) {
    if (attachment.name == "settings.yaml") return attachment.data;
  }
  return {};
}

std::vector<TraceSetting> settingsIn(std::string_view text) {
  std::vector<TraceSetting> settings;
  for (config::YamlEntry& entry : config::readYaml(text).entries) {
    settings.push_back({entry.group + "." + entry.name, std::move(entry.value), entry.quoted});
  }
  return settings;
}

std::optional<double> numberIn(std::string_view value) {
  if (value == "true") return 1;
  if (value == "false") return 0;
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size()) return std::nullopt;
  return number;
}

std::optional<std::int64_t> periodIn(const TraceInfo& trace) {
  for (const TraceSetting& setting : settingsIn(settingsText(trace))) {
    if (setting.name != "loop.rate_hz") continue;
    const std::optional<double> rate_hz = numberIn(setting.value);
    if (rate_hz && *rate_hz >= 1 && *rate_hz <= 1e6) {
      return std::llround(static_cast<double>(rt::kNsPerSecond) / *rate_hz);
    }
  }
  return std::nullopt;
}

void EmptyPeriodCount::add(const rt::Tick& tick) {
  if (last_) {
    const auto [time_ns, number] = *last_;
    // times from a file may be anything: their difference may overflow
    std::int64_t taken_ns = 0;
    const bool fits = !__builtin_sub_overflow(tick.planned_ns, time_ns, &taken_ns);
    if (fits && taken_ns > 0 && tick.number > number) {
      Steps& steps = steps_[{taken_ns, tick.number - number}];
      if (steps.count++ == 0) {
        steps.after_tick = number;
        steps.after_ns = time_ns;
      }
    }
  }
  last_ = {tick.planned_ns, tick.number};
}

EmptyPeriods EmptyPeriodCount::finish(std::optional<std::int64_t> period_ns) const {
  EmptyPeriods found;
  if (steps_.empty()) return found;
  found.period_ns = period_ns.value_or(std::numeric_limits<std::int64_t>::max());
  for (const auto& [step, unused] : steps_) {
    if (period_ns) break;
    found.period_ns =
        std::min(found.period_ns,
                 step.first / static_cast<std::int64_t>(std::min<std::uint64_t>(step.second, 1'000'000)));
  }
  found.period_ns = std::max<std::int64_t>(found.period_ns, 1);
  found.periods = 1;
  for (const auto& [step, steps] : steps_) {
    const auto& [taken_ns, ticks] = step;
    const bool up =
        taken_ns % found.period_ns >= (found.period_ns + 1) / 2;  // to the nearest, without overflow
    const std::uint64_t periods = static_cast<std::uint64_t>(taken_ns / found.period_ns) + (up ? 1 : 0);
    found.periods += steps.count * std::max(periods, ticks);
    if (periods <= ticks) continue;
    const std::uint64_t empty = periods - ticks;
    found.empty += steps.count * empty;
    found.stretches += steps.count;
    const bool earlier = empty == found.longest && steps.after_tick < found.after_tick;
    if (empty < found.longest || (empty == found.longest && !earlier)) continue;
    found.longest = empty;
    found.after_tick = steps.after_tick;
    found.after_ns = steps.after_ns;
  }
  return found;
}

namespace {

constexpr std::size_t kMaxGaps = 20;

/// The smallest sample that at least that share of all samples do not exceed, in microseconds.
double percentile_us(std::vector<std::int64_t>& samples_ns, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(samples_ns.size())));
  const auto at = samples_ns.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(samples_ns.begin(), at, samples_ns.end());
  return static_cast<double>(*at) / 1000;
}

TraceDurations durationsOf(std::vector<std::int64_t> samples_ns) {
  if (samples_ns.empty()) return {};
  return {percentile_us(samples_ns, 0.5), percentile_us(samples_ns, 0.99), percentile_us(samples_ns, 0.999),
          percentile_us(samples_ns, 1)};
}

class Summing {
 public:
  bool addTick(const rt::Tick& tick) {
    if (ticks_ == 0) {
      first_ = tick;
    } else if (tick.number > last_.number + 1) {
      addGap(tick);
    }
    const double force_n = norm(tick.command_force_n_in_world);
    if (ticks_ == 0 || force_n > summary_.largest_force_n) {
      summary_.largest_force_n = force_n;
      summary_.largest_force_time_s = since(tick.planned_ns);
    }
    wakeup_ns_.push_back(tick.wakeup_latency_ns);
    compute_ns_.push_back(tick.compute_ns);
    empty_periods_.add(tick);
    ++in_mode_[static_cast<std::size_t>(tick.mode)];
    ++in_law_[static_cast<std::size_t>(tick.law)];
    summary_.law_without_proxy |= !rt::hasProxy(tick.law);
    if (inContact(tick)) ++contacts_;
    addFixtures(tick);
    if (tick.after_overrun) ++summary_.overruns;
    last_ = tick;
    ++ticks_;
    return true;
  }

  TraceSummary finish(TraceInfo info) && {
    summary_.info = std::move(info);
    summary_.wakeup_latency = durationsOf(std::move(wakeup_ns_));
    summary_.compute_time = durationsOf(std::move(compute_ns_));
    if (ticks_ == 0) return std::move(summary_);
    summary_.fixture_contact_share = static_cast<double>(fixture_ticks_) / static_cast<double>(ticks_);
    summary_.duration_s = since(last_.planned_ns);
    summary_.contact_share = static_cast<double>(contacts_) / static_cast<double>(ticks_);
    const auto periods = static_cast<double>(last_.number - first_.number);
    if (summary_.duration_s > 0) summary_.rate_hz = periods / summary_.duration_s;
    const double period_s = summary_.rate_hz > 0 ? 1 / summary_.rate_hz : 0;
    summary_.modes_s = timesOf<rt::Mode>(in_mode_, period_s);
    const bool knows_law = !summary_.info.lacks(kChannelName<rt::Tick>.topic, "law");
    if (knows_law) summary_.laws_s = timesOf<rt::ForceLaw>(in_law_, period_s);
    summary_.law_without_proxy &= knows_law;
    summary_.empty_periods = empty_periods_.finish(periodIn(summary_.info));
    if (summary_.empty_periods.longest > 0)
      summary_.longest_empty_time_s = since(summary_.empty_periods.after_ns);
    return std::move(summary_);
  }

 private:
  /// The enumerators that occur, and for how long.
  template <typename Enumeration>
  static std::vector<std::pair<std::string, double>> timesOf(const auto& ticks, double period_s) {
    std::vector<std::pair<std::string, double>> times;
    for (std::size_t value = 0; value < ticks.size(); ++value) {
      if (ticks[value] == 0) continue;
      times.emplace_back(rt::kWords<Enumeration>[value], static_cast<double>(ticks[value]) * period_s);
    }
    return times;
  }

  void addFixtures(const rt::Tick& tick) {
    const std::uint32_t before = ticks_ == 0 ? 0 : last_.fixtures_in_contact;
    summary_.fixture_contacts +=
        static_cast<std::uint64_t>(std::popcount(tick.fixtures_in_contact & ~before));
    if (tick.fixtures_in_contact != 0) ++fixture_ticks_;
    const auto raise = [](double& largest, double value) {
      if (value > largest) largest = value;  // not if it is NaN, as in older traces
    };
    raise(summary_.largest_fixture_force_n, norm(tick.fixture_force_n_in_world));
    raise(summary_.largest_guidance_force_n, norm(tick.guidance_force_n_in_world));
  }

  double since(std::int64_t time_ns) const {
    return (static_cast<double>(time_ns) - static_cast<double>(first_.planned_ns)) /
           static_cast<double>(rt::kNsPerSecond);
  }

  void addGap(const rt::Tick& tick) {
    ++summary_.gaps;
    if (summary_.first_gaps.size() >= kMaxGaps) return;
    summary_.first_gaps.push_back({last_.number, tick.number - last_.number - 1, since(last_.planned_ns)});
  }

  TraceSummary summary_;
  rt::Tick first_, last_;
  std::uint64_t ticks_ = 0;
  std::uint64_t contacts_ = 0;
  std::uint64_t fixture_ticks_ = 0;
  EmptyPeriodCount empty_periods_;
  std::array<std::uint64_t, rt::kModeCount> in_mode_{};
  std::array<std::uint64_t, rt::kWords<rt::ForceLaw>.size()> in_law_{};
  std::vector<std::int64_t> wakeup_ns_, compute_ns_;
};

}  // namespace

base::Result<TraceSummary> summariseTrace(const std::filesystem::path& trace, const Progress& progress) {
  Summing summing;
  auto info = readTrace(
      trace, {.tick = [&](const rt::Tick& tick) { return summing.addTick(tick); }, .progress = progress});
  if (!info) return std::unexpected(info.error());
  TraceSummary summary = std::move(summing).finish(std::move(*info));
  summary.note = noteOf(trace);
  return summary;
}

}  // namespace hapticd::trace
