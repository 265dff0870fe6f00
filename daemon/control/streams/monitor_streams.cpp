// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/streams/monitor_streams.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

#include "config/base/value_text.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/base/status_json.h"

namespace hapticd::daemon {
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

}  // namespace hapticd::daemon
