// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/recorded/timeline.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <string>
#include <tuple>
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

/// Of more than `most` items those with the largest `size(item)`; of equal ones the first. Their order stays.
template <typename Item, typename Size>
void keepLargest(std::vector<Item>& items, std::size_t most, Size size) {
  if (items.size() <= most) return;
  std::vector<decltype(size(items.front()))> sizes;
  for (const Item& item : items) sizes.push_back(size(item));
  std::ranges::nth_element(sizes, sizes.begin() + static_cast<std::ptrdiff_t>(most), std::greater<>());
  const auto bound = sizes[most];
  std::size_t equal_left = most - static_cast<std::size_t>(std::ranges::count_if(
                                      sizes, [&bound](const auto& one) { return one > bound; }));
  std::erase_if(items, [&](const Item& item) {
    const auto own = size(item);
    if (own == bound && equal_left > 0) return --equal_left, false;
    return !(own > bound);
  });
}

/// A period in which mode and cause stay the same.
struct ModePeriod {
  Period period;
  const rt::Tick* first = nullptr;

  bool isFault() const { return first->mode == rt::Mode::faulted; }
};

/// The periods of modes; each reaches to the next one. Of very many, short ones belong to the one before, and
/// no fault goes before other modes have gone.
void addModes(const RecordedSession& session, Json& marks) {
  std::vector<ModePeriod> periods;
  for (const rt::Tick& tick : session.ticks()) {
    const bool goes_on = !periods.empty() && tick.mode == periods.back().first->mode &&
                         tick.cause == periods.back().first->cause;
    if (!goes_on) periods.push_back({{tick.planned_ns, tick.planned_ns}, &tick});
    periods.back().period.end_ns = tick.planned_ns;
  }
  keepLargest(periods, kMostMarks, [&](const ModePeriod& one) {
    const bool is_begin = one.first == &session.ticks().front();
    return std::tuple(is_begin, one.isFault(), one.period.end_ns - one.period.begin_ns);
  });
  for (std::size_t i = 0; i < periods.size(); ++i) {
    const rt::Tick& tick = *periods[i].first;
    const std::int64_t end_ns = i + 1 < periods.size() ? periods[i + 1].period.begin_ns : session.end_ns();
    const std::string text =
        std::string(rt::wordOf(tick.mode)) + " (" + std::string(rt::wordOf(tick.cause)) + ")";
    marks.push_back(
        markOf(session, {tick.planned_ns, end_ns}, periods[i].isFault() ? "fault" : "mode", text));
  }
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
  if (periods.size() <= most) return;
  std::vector<std::size_t> begins;  // of the periods behind the pauses that stay
  for (std::size_t i = 1; i < periods.size(); ++i) begins.push_back(i);
  keepLargest(begins, most - 1, [&](std::size_t i) { return periods[i].begin_ns - periods[i - 1].end_ns; });
  std::vector<Period> joined{periods.front()};
  for (const std::size_t i : begins) {
    joined.back().end_ns = periods[i - 1].end_ns;
    joined.push_back(periods[i]);
  }
  joined.back().end_ns = periods.back().end_ns;
  periods = std::move(joined);
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
