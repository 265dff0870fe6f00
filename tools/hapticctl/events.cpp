// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/events.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <optional>

#include "config/program.h"
#include "tools/client/reply_reader.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/signals.h"
#include "tools/hapticctl/terminal_text.h"

namespace hapticd::tools {
namespace {

/// The past comes at once and has no end mark: it is over when nothing comes for that long.
constexpr std::chrono::milliseconds kPastIsOver{300};
constexpr std::chrono::hours kForEver{24};
/// The daemon sends no more of them.
constexpr std::size_t kMostPastEvents = 64;

Colour colourOf(const std::string& priority) {
  if (priority == "error") return Colour::red;
  return priority == "warning" ? Colour::yellow : Colour::plain;
}

class EventPrinter {
 public:
  explicit EventPrinter(const CommandOptions& options)
      : json_(options.json), colours_(wantsColours(options.color)) {}

  /// False when nobody reads any more.
  bool print(const Json& reply) {
    if (json_) {
      printJsonLine(reply);
    } else {
      noteLosses(reply);
      const std::string priority = textAt(reply, "event.priority");
      fmt::print("{}\n",
                 painted(fmt::format("{}  {:<7}  {:<10}  {}", localTime(numberAt(reply, "event.timeNs")),
                                     priority, textAt(reply, "event.kind"), textAt(reply, "event.text")),
                         colourOf(priority), colours_));
    }
    return config::flushOutput();
  }

 private:
  void noteLosses(const Json& reply) {
    const double dropped = numberAt(reply, "droppedCount");
    if (dropped > dropped_)
      fmt::print(stderr, "hapticctl: {:.0f} events were lost here\n", dropped - dropped_);
    dropped_ = std::fmax(dropped_, dropped);
  }

  bool json_;
  bool colours_;
  double dropped_ = 0;
};

/// The next event, past signals that do not end the program; null at the end that a person asked for.
ClientResult<Json> nextEvent(VarlinkClient& client, int signals, std::chrono::milliseconds limit) {
  for (;;) {
    auto reply = client.next(limit);
    if (reply || reply.error().kind != ClientError::Kind::interrupted) return reply;
    const int signal = nextSignal(signals);
    if (signal == SIGTSTP) ::raise(SIGSTOP);
    if (signal != SIGTSTP && signal != SIGWINCH) return Json();
  }
}

bool isSilence(const ClientResult<Json>& reply) {
  return !reply && reply.error().kind == ClientError::Kind::no_answer;
}

/// Prints the newest of what has happened; returns the exit code when that is all, nothing when it may go on.
std::optional<int> printPast(VarlinkClient& client, int signals, std::size_t count, EventPrinter& printer,
                             bool json) {
  std::deque<Json> past;
  for (std::size_t taken = 0; taken < kMostPastEvents; ++taken) {
    auto reply = nextEvent(client, signals, kPastIsOver);
    if (isSilence(reply)) break;
    if (!reply) return report(reply.error(), json);
    if (reply->is_null()) return kOk;
    past.push_back(std::move(*reply));
    if (past.size() > count) past.pop_front();
  }
  for (const Json& event : past) {
    if (!printer.print(event)) return kFailed;
  }
  return std::nullopt;
}

int printNew(VarlinkClient& client, int signals, EventPrinter& printer, bool json) {
  for (;;) {
    const auto reply = nextEvent(client, signals, kForEver);
    if (isSilence(reply)) continue;
    if (!reply) return report(reply.error(), json);
    if (reply->is_null()) return kOk;
    if (!printer.print(*reply)) return kFailed;
  }
}

}  // namespace

std::string localTime(double realtime_ns) {
  if (std::isnan(realtime_ns)) return "-";
  const auto milliseconds = static_cast<std::int64_t>(realtime_ns / 1e6);
  const auto seconds = static_cast<std::time_t>(milliseconds / 1000);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03}", fmt::localtime(seconds), milliseconds % 1000);
}

std::string utcTime(double realtime_ns) {
  if (std::isnan(realtime_ns)) return "-";
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(static_cast<std::time_t>(realtime_ns / 1e9)));
}

int runEvents(const CommandOptions& options, const EventOptions& events) {
  auto client = connectTo(options, false);
  if (!client) return report(client.error(), options.json);
  const int signals = takeSignals();
  client->interruptBy(signals);
  const Json parameters = events.kinds.empty() ? Json::object() : Json{{"kinds", Json(events.kinds)}};
  const auto subscribed = client->subscribe("io.hapticd.Status.Events", parameters);
  if (!subscribed) return report(subscribed.error(), options.json);
  // A daemon to which nothing has happened says as little as one that does not answer; and once it has
  // answered this it has taken the call above.
  const auto info = callOnce(options, {"org.varlink.service.GetInfo"});
  if (!info) return report(info.error(), options.json);

  EventPrinter printer(options);
  const auto ended =
      printPast(*client, signals, static_cast<std::size_t>(events.count), printer, options.json);
  if (ended) return *ended;
  return events.follow ? printNew(*client, signals, printer, options.json) : kOk;
}

}  // namespace hapticd::tools
