// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/commands.h"

#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <optional>

#include "config/base/program.h"
#include "tools/hapticctl/base/calls.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

/// Past events arrive at once, but nothing marks the last one: the past is over when no event has arrived for
/// this long.
constexpr std::chrono::milliseconds kPastIsOver{300};
constexpr std::chrono::hours kForEver{24};
/// The daemon sends at most this many.
constexpr std::size_t kMaxPastEvents = 64;

Colour colourOf(const std::string& priority) {
  if (priority == "error") return Colour::red;
  return priority == "warning" ? Colour::yellow : Colour::plain;
}

class EventPrinter {
 public:
  explicit EventPrinter(const CommandOptions& options)
      : json_(options.json), colours_(wantsColours(options.color)) {}

  /// Returns false if nobody reads the output any more.
  bool print(const Json& reply) {
    if (wasPrinted(reply)) return true;
    if (json_) {
      printJsonLine(reply);
    } else {
      noteLosses(reply);
      const std::string priority = textAt(reply, "event.priority");
      const std::string line =
          fmt::format("{}  {:<7}  {:<10}  {}", utcTimeWithMilliseconds(numberAt(reply, "event.timeNs")),
                      priority, textAt(reply, "event.kind"), textAt(reply, "event.text"));
      fmt::print("{}\n", painted(fitted(line, terminalSize().columns), colourOf(priority), colours_));
    }
    return base::flushOutput();
  }

  /// To be called after the daemon was reached again: its stream begins with events that may be printed
  /// already.
  void beginAgain() {
    dropped_ = 0;
    last_number_before_ = last_number_;
    last_time_before_ns_ = last_time_ns_;
  }

 private:
  /// A daemon that was restarted counts its events from 1 again, so that one with a low number may be new.
  bool wasPrinted(const Json& reply) {
    const double number = numberAt(reply, "event.number");
    const double time_ns = numberAt(reply, "event.timeNs");
    if (number <= last_number_before_ && time_ns <= last_time_before_ns_) return true;
    last_number_ = number;
    last_time_ns_ = time_ns;
    return false;
  }

  void noteLosses(const Json& reply) {
    const double dropped = numberAt(reply, "droppedCount");
    if (dropped > dropped_)
      fmt::print(stderr, "hapticctl: {:.0f} events were lost here\n", dropped - dropped_);
    dropped_ = std::fmax(dropped_, dropped);
  }

  bool json_;
  bool colours_;
  double dropped_ = 0;
  // NaN: none was printed, or none before the connection was lost; no comparison holds then
  double last_number_ = std::nan(""), last_time_ns_ = std::nan("");
  double last_number_before_ = std::nan(""), last_time_before_ns_ = std::nan("");
};

/// Takes a signal; false when the program is to end.
bool goesOnAfterSignal(int signals) {
  const int signal = nextSignal(signals);
  if (signal == SIGTSTP) ::raise(SIGSTOP);
  return signal == SIGTSTP || signal == SIGWINCH;
}

/// Returns the next event and handles signals meanwhile; null if a signal ends the program.
ClientResult<Json> nextEvent(VarlinkClient& client, int signals, std::chrono::milliseconds limit) {
  for (;;) {
    auto reply = client.next(limit);
    if (reply || reply.error().kind != ClientError::Kind::interrupted) return reply;
    if (!goesOnAfterSignal(signals)) return Json();
  }
}

bool isSilence(const ClientResult<Json>& reply) {
  return !reply && reply.error().kind == ClientError::Kind::no_answer;
}

/// Prints the newest past events; returns the exit code when that is the end, nothing when new ones may
/// follow.
std::optional<int> printPast(VarlinkClient& client, int signals, std::size_t count, EventPrinter& printer,
                             bool json) {
  std::deque<Json> past;
  for (std::size_t taken = 0; taken < kMaxPastEvents; ++taken) {
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

/// Prints new events until the stream ends. Returns nothing if it ended on request.
std::optional<ClientError> printNew(VarlinkClient& client, int signals, EventPrinter& printer) {
  for (;;) {
    const auto reply = nextEvent(client, signals, kForEver);
    if (isSilence(reply)) continue;
    if (!reply) return reply.error();
    if (reply->is_null() || !printer.print(*reply)) return std::nullopt;
  }
}

ClientResult<VarlinkClient> openStream(const CommandOptions& options, const EventOptions& events,
                                       int signals) {
  auto client = connectTo(options, false);
  if (!client) return client;
  client->interruptBy(signals);
  const Json parameters = events.kinds.empty() ? Json::object() : Json{{"kinds", Json(events.kinds)}};
  const auto subscribed = client->subscribe("io.hapticd.Status.Events", parameters);
  if (!subscribed) return std::unexpected(subscribed.error());
  // A daemon without events is as silent as one that does not respond. Therefore another call is made on a
  // second connection: once that has been answered, the daemon has received the call above as well.
  const auto info = callOnce(options, {"org.varlink.service.GetInfo"});
  if (!info) return std::unexpected(info.error());
  return client;
}

/// Prints new events until Ctrl-C, and connects again where the connection is lost.
int follow(const CommandOptions& options, const EventOptions& events, VarlinkClient client, int signals,
           EventPrinter& printer) {
  std::optional<VarlinkClient> stream(std::move(client));
  for (;;) {
    const auto failure = printNew(*stream, signals, printer);
    if (!failure) return kOk;
    if (!mayPass(*failure)) return report(*failure, options.json);
    stream.reset();
    fmt::print(stderr, "hapticctl: the connection is lost, trying again until Ctrl-C ({})\n", failure->what);
    Reconnection reconnection(
        signals, [signals] { return goesOnAfterSignal(signals); }, Reconnection::Clock::time_point::max());
    auto again = reconnection.retry<VarlinkClient>([&] { return openStream(options, events, signals); });
    if (!again) return kOk;
    if (!*again) return report(again->error(), options.json);
    fmt::print(stderr, "hapticctl: connected to hapticd again\n");
    printer.beginAgain();
    stream.emplace(std::move(**again));
  }
}

}  // namespace

int runEvents(const CommandOptions& options, const EventOptions& events) {
  const int signals = takeSignals();
  auto client = openStream(options, events, signals);
  if (!client) return report(client.error(), options.json);
  EventPrinter printer(options);
  const auto ended =
      printPast(*client, signals, static_cast<std::size_t>(events.count), printer, options.json);
  if (ended) return *ended;
  return events.follow ? follow(options, events, std::move(*client), signals, printer) : kOk;
}

}  // namespace hapticd::tools
