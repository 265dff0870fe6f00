// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/recorded/timeline.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "rt/clock.h"
#include "rt/words.h"

namespace hapticd::tools::view {
namespace {

constexpr std::size_t kMostMarks = 1000;
/// A contact that is lost for less than this goes on, in a display of minutes.
constexpr std::int64_t kLeastPause_ns = rt::kNsPerSecond / 20;

struct Period {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

Json markOf(const RecordedSession& session, const Period& period, const char* kind, const std::string& text) {
  return {{"s", session.seconds(period.begin_ns)},
          {"endS", session.seconds(period.end_ns)},
          {"kind", kind},
          {"text", text}};
}

/// The periods in which mode and cause stay the same; each reaches to the next one.
void addModes(const RecordedSession& session, Json& marks) {
  const std::span<const rt::Tick> ticks = session.ticks();
  const auto add = [&](const rt::Tick& tick, std::int64_t end_ns) {
    const std::string text =
        std::string(rt::wordOf(tick.mode)) + " (" + std::string(rt::wordOf(tick.cause)) + ")";
    marks.push_back(
        markOf(session, {tick.planned_ns, end_ns}, tick.mode == rt::Mode::faulted ? "fault" : "mode", text));
  };
  const rt::Tick* begin = &ticks.front();
  for (const rt::Tick& tick : ticks) {
    if (tick.mode == begin->mode && tick.cause == begin->cause) continue;
    add(*begin, tick.planned_ns);
    begin = &tick;
  }
  add(*begin, session.end_ns());
}

std::vector<Period> contactsOf(const RecordedSession& session) {
  std::vector<Period> contacts;
  for (const rt::Tick& tick : session.ticks()) {
    if (!rt::inContact(tick)) continue;
    const std::int64_t now_ns = tick.planned_ns;
    const bool goes_on = !contacts.empty() && now_ns - contacts.back().end_ns <= kLeastPause_ns;
    if (!goes_on) contacts.push_back({now_ns, now_ns});
    contacts.back().end_ns = now_ns;
  }
  return contacts;
}

/// Joins periods with the shortest pauses between them until there are at most `most`.
void joinUntil(std::vector<Period>& periods, std::size_t most) {
  for (std::int64_t pause_ns = 2 * kLeastPause_ns; periods.size() > most; pause_ns *= 2) {
    std::vector<Period> joined;
    for (const Period& period : periods) {
      if (!joined.empty() && period.begin_ns - joined.back().end_ns <= pause_ns) {
        joined.back().end_ns = period.end_ns;
      } else {
        joined.push_back(period);
      }
    }
    periods = std::move(joined);
  }
}

void addEvents(const RecordedSession& session, Json& marks) {
  const std::span<const drivers::EventRecord> events = session.events();
  for (const drivers::EventRecord& event : events.first(std::min(events.size(), kMostMarks))) {
    marks.push_back({{"s", session.seconds(event.time_ns)},
                     {"endS", nullptr},
                     {"kind", event.kind == "mark" ? "mark" : "event"},
                     {"text", event.text}});
  }
}

}  // namespace

Json timelineOf(const RecordedSession& session) {
  Json marks = Json::array();
  addModes(session, marks);
  std::vector<Period> contacts = contactsOf(session);
  joinUntil(contacts, kMostMarks);
  for (const Period& contact : contacts) marks.push_back(markOf(session, contact, "contact", "in contact"));
  addEvents(session, marks);

  const auto force_n = [](const rt::Tick& tick) { return rt::norm(tick.command_force_n_in_world); };
  const rt::Tick& largest = *std::ranges::max_element(session.ticks(), {}, force_n);
  return {{"type", "timeline"},
          {"durationS", session.duration_s()},
          {"largestForceS", session.seconds(largest.planned_ns)},
          {"largestForceN", force_n(largest)},
          {"marks", marks}};
}

}  // namespace hapticd::tools::view
