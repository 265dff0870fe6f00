// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/streams/tick_streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <concepts>
#include <expected>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/value_text.h"
#include "daemon/control/base/method_context.h"
#include "daemon/trace/format/records.h"
#include "rt/base/words.h"

namespace hapticd::daemon {
namespace {

constexpr std::int64_t kMinIntervalMs = 5;
constexpr std::int64_t kMaxIntervalMs = 1000;
constexpr std::int64_t kDefaultIntervalMs = 50;
constexpr std::int64_t kMaxRateHz = 1000;

/// The names of a tick's fields, as traces have them.
const std::vector<std::string_view>& tickFields() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> all;
    const rt::Tick tick;
    trace::visitFields(tick, [&all](std::string_view name, const auto&) { all.push_back(name); });
    return all;
  }();
  return names;
}

OrderedJson valueJson(std::integral auto value) {
  return value;
}
OrderedJson valueJson(double value) {
  return value;
}
OrderedJson valueJson(const rt::Vec3& vector) {
  return OrderedJson::array({vector.x, vector.y, vector.z});
}
template <rt::Worded Enumeration>
OrderedJson valueJson(Enumeration value) {
  return rt::wordOf(value);
}

Reply outOfRange(const char* parameter, const std::string& allowed) {
  return {"io.hapticd.Status.OutOfRange", {{"parameter", parameter}, {"allowed", allowed}}};
}

Reply unknownField(const std::string& name) {
  const std::string guess = base::didYouMean(name, tickFields());
  return {"io.hapticd.Status.UnknownField",
          {{"field", name},
           {"reason", guess.empty()
                          ? fmt::format("a tick has no such field, but {}", fmt::join(tickFields(), ", "))
                          : fmt::format("a tick has no such field ({})", guess)}}};
}

std::expected<std::chrono::milliseconds, Reply> intervalOf(const Call& call) {
  const Json* const interval = field(call, "intervalMs");
  if (!interval) return std::chrono::milliseconds(kDefaultIntervalMs);
  if (!interval->is_number_integer()) return std::unexpected(invalidParameter("intervalMs"));
  const auto milliseconds = interval->get<std::int64_t>();
  if (milliseconds < kMinIntervalMs || milliseconds > kMaxIntervalMs) {
    return std::unexpected(
        outOfRange("intervalMs", fmt::format("{}..{} ms", kMinIntervalMs, kMaxIntervalMs)));
  }
  return std::chrono::milliseconds(milliseconds);
}

/// The rate; 0: none is asked for.
std::expected<int, Reply> rateOf(const Call& call) {
  const Json* const rate = field(call, "rateHz");
  if (!rate) return 0;
  if (!rate->is_number_integer()) return std::unexpected(invalidParameter("rateHz"));
  const auto rate_hz = rate->get<std::int64_t>();
  if (rate_hz < 1 || rate_hz > kMaxRateHz)
    return std::unexpected(outOfRange("rateHz", fmt::format("1..{}", kMaxRateHz)));
  return static_cast<int>(rate_hz);
}

/// The places of fields in tickFields(), each once.
std::expected<std::vector<std::size_t>, Reply> placesOf(const std::vector<std::string>& names) {
  std::vector<std::size_t> places;
  for (const std::string& name : names) {
    const auto known = std::ranges::find(tickFields(), name);
    if (known == tickFields().end()) return std::unexpected(unknownField(name));
    const auto place = static_cast<std::size_t>(known - tickFields().begin());
    if (std::ranges::find(places, place) == places.end()) places.push_back(place);
  }
  return places;
}

std::expected<std::vector<std::size_t>, Reply> fieldsOf(const Call& call) {
  const auto names = textsField(call, "fields", std::numeric_limits<std::size_t>::max());
  if (!names) return std::unexpected(names.error());
  if (!*names) return std::unexpected(invalidParameter("fields"));
  if ((*names)->empty() || (*names)->size() > TickStreams::kMaxFields)
    return std::unexpected(outOfRange("fields", fmt::format("1..{} names", TickStreams::kMaxFields)));
  return placesOf(**names);
}

std::expected<std::vector<std::size_t>, Reply> changesOf(const Call& call) {
  const auto names = textsField(call, "orChanged", std::numeric_limits<std::size_t>::max());
  if (!names) return std::unexpected(names.error());
  if (!*names) return {};
  if ((*names)->size() > TickStreams::kMaxChanges)
    return std::unexpected(
        outOfRange("orChanged", fmt::format("at most {} names", TickStreams::kMaxChanges)));
  return placesOf(**names);
}

/// Calls take(index in `places`, value) for the fields of a tick at those places.
void visitPlaces(const rt::Tick& tick, const std::vector<std::size_t>& places, const auto& take) {
  std::size_t place = 0;
  trace::visitFields(tick, [&](std::string_view, const auto& value) {
    const auto chosen = std::ranges::find(places, place++);
    if (chosen != places.end()) take(static_cast<std::size_t>(chosen - places.begin()), value);
  });
}

}  // namespace

std::vector<Method> TickStreams::methods() {
  return {{.name = "io.hapticd.Status.Ticks",
           .streams = true,
           .parameters = {{"fields"}, {"intervalMs"}, {"rateHz"}, {"orChanged"}},
           .stream = std::bind_front(&TickStreams::ticks, this)}};
}

void TickStreams::ticks(const Call& call, const Caller& caller, Replies& replies) {
  const auto interval = intervalOf(call);
  if (!interval) return replies.finish(caller.connection, interval.error());
  const auto rate_hz = rateOf(call);
  if (!rate_hz) return replies.finish(caller.connection, rate_hz.error());
  auto changes = changesOf(call);
  if (!changes) return replies.finish(caller.connection, changes.error());
  auto fields = fieldsOf(call);
  if (!fields) return replies.finish(caller.connection, fields.error());
  if (streams_.size() == kMaxStreams) {
    return replies.finish(caller.connection, {"io.hapticd.Status.TooManyStreams", {{"limit", kMaxStreams}}});
  }
  kept_.resize(kTicksKept);
  streams_.push_back({.connection = caller.connection,
                      .interval = *interval,
                      .due = Clock::now() + *interval,
                      .fields = std::move(*fields),
                      .choice = {.changes = std::move(*changes)},
                      .next = count_});
  if (*rate_hz > 0) streams_.back().choice.rate.emplace(*rate_hz);
  send(streams_.back(), replies);
}

bool TickStreams::Choice::takes(const rt::Tick& tick) {
  if (!rate) return true;
  std::string now;
  visitPlaces(tick, changes, [&now](std::size_t, const auto& value) {
    now.append(reinterpret_cast<const char*>(&value), sizeof value);
  });
  const bool changed = now != std::exchange(values, now);
  return rate->takes(tick.planned_ns) || changed;
}

void TickStreams::onTick(const rt::Tick& tick) {
  if (streams_.empty()) return;
  kept_[count_++ % kTicksKept] = tick;
}

void TickStreams::feed(Replies& replies) {
  const Clock::time_point now = Clock::now();
  for (Stream& stream : streams_) {
    if (now < stream.due) continue;
    // A reply holds no more than kMaxPerReply ticks: what is left goes in the next period.
    if (stream.next == count_ || (send(stream, replies) && stream.next == count_))
      stream.due = now + stream.interval;
  }
}

/// Offers the oldest ticks that the stream has not had; false where the client has not taken the previous
/// reply. A reply without a tick is sent, too: it shows that the box is there.
bool TickStreams::send(Stream& stream, Replies& replies) const {
  const std::uint64_t oldest = count_ - std::min<std::uint64_t>(count_, kTicksKept);
  Stream after = stream;
  after.next = std::max(stream.next, oldest);

  std::vector<OrderedJson> columns(stream.fields.size(), OrderedJson::array());
  std::uint64_t ticks = 0;
  for (; after.next < count_ && ticks < kMaxPerReply; ++after.next) {
    const rt::Tick& tick = at(after.next);
    if (after.next_number != 0 && tick.number > after.next_number)
      after.lost += tick.number - after.next_number;
    after.next_number = tick.number + 1;
    if (!after.choice.takes(tick)) continue;
    ++ticks;
    visitPlaces(tick, stream.fields, [&columns](std::size_t column, const auto& value) {
      columns[column].push_back(valueJson(value));
    });
  }
  OrderedJson named = OrderedJson::object();
  for (std::size_t column = 0; column < columns.size(); ++column)
    named[std::string(tickFields()[stream.fields[column]])] = std::move(columns[column]);
  const Reply reply{"", {{"count", ticks}, {"ticks", std::move(named)}, {"lostCount", after.lost}}, true};
  if (!replies.offer(stream.connection, reply)) return false;
  stream = after;
  return true;
}

void TickStreams::closed(ConnectionId connection) {
  std::erase_if(streams_, [=](const Stream& stream) { return stream.connection == connection; });
  if (streams_.empty()) std::vector<rt::Tick>().swap(kept_);
}

}  // namespace hapticd::daemon
