// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/streams/status_streams.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <expected>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

#include "config/base/value_text.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/base/status_json.h"
#include "rt/base/clock.h"

namespace hapticd::daemon {

void TickWindow::add(const rt::Tick& tick) {
  const double force_n = rt::norm(tick.command_force_n_in_world);
  ++summary_.ticks;
  if (rt::inContact(tick)) ++summary_.contact_ticks;
  summary_.min_force_n = std::min(summary_.min_force_n.value_or(force_n), force_n);
  summary_.max_force_n = std::max(summary_.max_force_n.value_or(force_n), force_n);
  summary_.max_wakeup_latency_ns =
      std::max(summary_.max_wakeup_latency_ns.value_or(tick.wakeup_latency_ns), tick.wakeup_latency_ns);
  times_->wakeup_latency.add(tick.wakeup_latency_ns);
  times_->compute_time.add(tick.compute_ns);
}

WindowStatus TickWindow::summary() const {
  WindowStatus summary = summary_;
  if (summary.ticks == 0) return summary;
  summary.wakeup_latency = rt::summaryOf(times_->wakeup_latency);
  summary.compute_time = rt::summaryOf(times_->compute_time);
  return summary;
}

namespace {

void addPaths(const OrderedJson& object, const std::string& above, std::vector<std::string>& paths) {
  for (auto member = object.begin(); member != object.end(); ++member) {
    paths.push_back(above + member.key());
    if (member->is_object()) addPaths(*member, paths.back() + ".", paths);
  }
}

/// All paths that a status can have, also below what is null most of the time.
const std::vector<std::string>& knownPaths() {
  static const std::vector<std::string> known = [] {
    BoxStatus status;
    status.handle.link.emplace();
    std::vector<std::string> paths;
    addPaths(statusJson(status), "", paths);
    return paths;
  }();
  return known;
}

Reply unknownField(const std::string& path) {
  const std::vector<std::string_view> names(knownPaths().begin(), knownPaths().end());
  const std::string guess = base::didYouMean(path, names);
  return {"io.hapticd.Status.UnknownField",
          {{"field", path},
           {"reason", "the status has no such field (" +
                          (guess.empty() ? "GetStatus shows those that it has" : guess) + ")"}}};
}

std::vector<std::string> partsOf(const std::string& path) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t dot = 0; dot != std::string::npos; begin = dot + 1) {
    dot = path.find('.', begin);
    parts.push_back(path.substr(begin, dot - begin));
  }
  return parts;
}

void copy(const OrderedJson& from, std::span<const std::string> path, OrderedJson& to) {
  if (path.empty() || from.is_null()) {
    to = from;
    return;
  }
  if (!to.is_object()) to = OrderedJson::object();
  copy(from.at(path.front()), path.subspan(1), to[path.front()]);
}

}  // namespace

std::expected<StatusFields, Reply> StatusFields::from(std::span<const std::string> paths) {
  StatusFields fields;
  fields.all_ = false;
  for (const std::string& path : paths) {
    if (std::ranges::find(knownPaths(), path) == knownPaths().end()) {
      return std::unexpected(unknownField(path));
    }
    fields.paths_.push_back(partsOf(path));
  }
  return fields;
}

OrderedJson StatusFields::of(const OrderedJson& status) const {
  if (all_) return status;
  OrderedJson chosen = OrderedJson::object();
  for (const Path& path : paths_) copy(status, path, chosen);
  return chosen;
}

namespace {

constexpr std::int64_t kMinIntervalMs = 20;
constexpr std::int64_t kMaxIntervalMs = 60'000;
constexpr std::int64_t kDefaultIntervalMs = 200;
constexpr std::size_t kMaxFields = 256;

/// The requested interval in milliseconds; nothing if its value is not acceptable.
std::optional<std::int64_t> intervalOf(const Call& call) {
  const Json* interval = field(call, "intervalMs");
  if (!interval) return kDefaultIntervalMs;
  if (!interval->is_number_integer()) return std::nullopt;
  const auto milliseconds = interval->get<std::int64_t>();
  if (milliseconds < kMinIntervalMs || milliseconds > kMaxIntervalMs) return std::nullopt;
  return milliseconds;
}

std::expected<StatusFields, Reply> fieldsOf(const Call& call) {
  const auto paths = textsField(call, "fields", kMaxFields);
  if (!paths) return std::unexpected(paths.error());
  if (!*paths) return StatusFields();
  return StatusFields::from(**paths);
}

}  // namespace

std::vector<Method> MonitorStreams::methods() {
  using Self = MonitorStreams;
  return {methodOf(this, "io.hapticd.Status.GetStatus", &Self::getStatus),
          {.name = "io.hapticd.Status.Monitor",
           .streams = true,
           .parameters = {{"intervalMs"}, {"fields"}},
           .stream = std::bind_front(&Self::monitor, this)}};
}

Answer MonitorStreams::getStatus(const Call&, const Caller&) {
  return Reply{"", {{"status", statusJson(box_.status())}}};
}

void MonitorStreams::monitor(const Call& call, const Caller& caller, Replies& replies) {
  const auto interval = intervalOf(call);
  if (!interval) return replies.finish(caller.connection, invalidParameter("intervalMs"));
  auto fields = fieldsOf(call);
  if (!fields) return replies.finish(caller.connection, fields.error());
  const std::chrono::milliseconds period(*interval);
  streams_.push_back({caller.connection, period, Clock::now() + period, std::move(*fields)});
  offer(streams_.back(), statusJson(box_.status()), replies);
}

void MonitorStreams::onTick(const rt::Tick& tick) {
  for (Stream& stream : streams_) stream.window.add(tick);
}

void MonitorStreams::feed(Replies& replies) {
  const Clock::time_point now = Clock::now();
  std::optional<OrderedJson> status;  // one for all streams that are due
  for (Stream& stream : streams_) {
    if (now < stream.due) continue;
    stream.due += (now - stream.due) / stream.interval * stream.interval + stream.interval;
    if (!status) status = statusJson(box_.status());
    offer(stream, *status, replies);
  }
}

void MonitorStreams::offer(Stream& stream, const OrderedJson& status, Replies& replies) {
  const Reply reply{"",
                    {{"status", stream.fields.of(status)},
                     {"window", windowJson(stream.window.summary())},
                     {"droppedCount", stream.dropped}},
                    true};
  if (replies.offer(stream.connection, reply)) {
    stream.window.clear();
  } else {
    ++stream.dropped;  // the window goes on until somebody has read it
  }
}

void MonitorStreams::closed(ConnectionId connection) {
  std::erase_if(streams_, [=](const Stream& stream) { return stream.connection == connection; });
}

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
