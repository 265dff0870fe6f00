// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/streams/event_streams.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <expected>
#include <functional>
#include <utility>

#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "rt/base/clock.h"

namespace hapticd::daemon {
namespace {

constexpr std::size_t kKept = 256;
constexpr std::size_t kShownAtTheStart = 64;
constexpr std::size_t kMaxKinds = 32;
/// Keeps an event far below the size of the largest reply.
constexpr std::size_t kMaxTextLength = 4096;

const char* priorityName(JournalEntry::Priority priority) {
  switch (priority) {
    case JournalEntry::Priority::error:
      return "error";
    case JournalEntry::Priority::warning:
      return "warning";
    case JournalEntry::Priority::notice:
      return "notice";
    case JournalEntry::Priority::info:
      return "info";
  }
  return "info";
}

std::string inLowerCase(std::string_view name) {
  std::string lower(name);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

OrderedJson eventJson(std::uint64_t number, config::EventKind kind, const JournalEntry& entry) {
  OrderedJson fields = OrderedJson::object();
  for (const auto& [name, value] : entry.fields) fields[inLowerCase(name)] = value.substr(0, kMaxTextLength);
  return {{"number", number},
          {"timeNs", rt::realtimeNow_ns()},
          {"kind", nameOf(kind)},
          {"text", entry.text.substr(0, kMaxTextLength)},
          {"priority", priorityName(entry.priority)},
          {"fields", std::move(fields)}};
}

/// The kinds that a call of Events names; empty: all.
std::expected<std::vector<config::EventKind>, Reply> kindsOf(const Call& call) {
  const auto words = textsField(call, "kinds", kMaxKinds);
  if (!words) return std::unexpected(words.error());
  if (*words && (*words)->empty()) return std::unexpected(invalidParameter("kinds"));
  std::vector<config::EventKind> kinds;
  for (const std::string& word : words->value_or(std::vector<std::string>())) {
    const auto kind = rt::withWord<config::EventKind>(word);
    if (!kind) {
      const std::string allowed = fmt::format("any of {}", fmt::join(rt::kWords<config::EventKind>, ", "));
      return std::unexpected(
          Reply{"io.hapticd.Status.OutOfRange", {{"parameter", "kinds"}, {"allowed", allowed}}});
    }
    kinds.push_back(*kind);
  }
  return kinds;
}

}  // namespace

bool EventStreams::Stream::wants(const Event& event) const {
  return kinds.empty() || std::ranges::find(kinds, event.kind) != kinds.end();
}

std::vector<Method> EventStreams::methods() {
  return {{.name = "io.hapticd.Status.Events",
           .streams = true,
           .parameters = {{"kinds"}},
           .stream = std::bind_front(&EventStreams::events, this)}};
}

void EventStreams::events(const Call& call, const Caller& caller, Replies& replies) {
  auto kinds = kindsOf(call);
  if (!kinds) return replies.finish(caller.connection, kinds.error());
  Stream stream{caller.connection, std::move(*kinds)};
  stream.next_number = firstFor(stream);
  streams_.push_back(std::move(stream));
  feed(streams_.back(), replies);
}

/// The number of the oldest event that a new stream begins with.
std::uint64_t EventStreams::firstFor(const Stream& stream) const {
  std::uint64_t first = count_ + 1;
  std::size_t shown = 0;
  for (auto event = events_.rbegin(); event != events_.rend() && shown < kShownAtTheStart; ++event) {
    if (!stream.wants(*event)) continue;
    first = event->number;
    ++shown;
  }
  return first;
}

void EventStreams::add(const JournalEntry& entry) {
  if (!entry.event) return;
  if (events_.size() == kKept) dropOldest();
  ++count_;
  events_.push_back({count_, *entry.event, eventJson(count_, *entry.event, entry)});
}

void EventStreams::dropOldest() {
  const Event& oldest = events_.front();
  for (Stream& stream : streams_) {
    if (stream.next_number > oldest.number) continue;
    stream.next_number = oldest.number + 1;
    if (stream.wants(oldest)) ++stream.dropped;
  }
  events_.pop_front();
}

void EventStreams::feed(Replies& replies) {
  for (Stream& stream : streams_) feed(stream, replies);
}

void EventStreams::feed(Stream& stream, Replies& replies) const {
  const auto waiting = std::ranges::lower_bound(events_, stream.next_number, {}, &Event::number);
  for (auto event = waiting; event != events_.end(); ++event) {
    const bool sent = !stream.wants(*event) ||
                      replies.offer(stream.connection,
                                    {"", {{"event", event->json}, {"droppedCount", stream.dropped}}, true});
    if (!sent) return;
    stream.next_number = event->number + 1;
  }
}

void EventStreams::closed(ConnectionId connection) {
  std::erase_if(streams_, [=](const Stream& stream) { return stream.connection == connection; });
}

}  // namespace hapticd::daemon
