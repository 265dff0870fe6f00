// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/watch.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "config/program.h"
#include "tools/client/reply_reader.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/force_history.h"
#include "tools/hapticctl/glance_text.h"
#include "tools/hapticctl/screen.h"
#include "tools/hapticctl/signals.h"
#include "tools/hapticctl/status_text.h"
#include "tools/hapticctl/watch_summary.h"

namespace hapticd::tools {
namespace {

/// What lines and their summary show of the status; the table shows nearly all of it.
const std::vector<std::string> kLineFields{
    "mode",         "uptimeS",       "loop.rateHz", "loop.counters", "loop.wakeupLatency", "loop.computeTime",
    "camera.state", "camera.frames", "scene"};
constexpr std::size_t kHistoryRows = 4;

/// How states are shown.
class Display {
 public:
  virtual ~Display() = default;
  /// False when nobody can see it any more.
  virtual bool show(const Json& reply) = 0;
  /// The terminal has another size.
  virtual void resize() {}
  /// The program is to stop for a while.
  virtual void stop() { ::raise(SIGSTOP); }
};

class JsonLines : public Display {
 public:
  bool show(const Json& reply) override {
    printJsonLine(reply);
    return config::flushOutput();
  }
};

class Lines : public Display {
 public:
  explicit Lines(bool short_lines) : short_lines_(short_lines) {}
  bool show(const Json& reply) override {
    fmt::print("{}\n", short_lines_ ? liveLine(reply) : monitorLine(reply));
    return config::flushOutput();
  }

 private:
  bool short_lines_;
};

/// One line of a terminal, written over.
class StandingLine : public Display {
 public:
  ~StandingLine() override { fmt::print("\n"); }
  bool show(const Json& reply) override {
    fmt::print("\r{}\033[K", cutTo(liveLine(reply), terminalSize().columns - 1));
    return config::flushOutput();
  }
};

/// The whole terminal: the state at a glance, and the forces of the last windows.
class Table : public Display {
 public:
  explicit Table(bool colours) : colours_(colours), utf8_(showsUtf8()) {}

  bool show(const Json& reply) override {
    history_.add(numberAt(reply, "window.maxForceN"));
    newest_ = reply;
    return draw();
  }
  void resize() override { draw(); }
  void stop() override {
    screen_.stop();
    draw();
  }

 private:
  bool draw() {
    const TerminalSize size = terminalSize();
    const std::size_t below = kHistoryRows + 1;
    const bool has_room = size.rows > 2 * below;
    const Json* status = fieldAt(newest_, "status");
    std::vector<std::string> lines = glanceLines(
        status ? *status : Json(), {{size.columns, has_room ? size.rows - below : size.rows}, colours_});
    if (has_room) {
      for (std::string& line : history_.lines(kHistoryRows, size.columns, utf8_)) lines.push_back(line);
    }
    lines.push_back(cutTo(fmt::format("force {}..{} N, wake-up max {}, {} states dropped   Ctrl-C ends",
                                      fixed(numberAt(newest_, "window.minForceN"), 2),
                                      fixed(numberAt(newest_, "window.maxForceN"), 2),
                                      duration(numberAt(newest_, "window.maxWakeupLatencyNs")),
                                      countAt(newest_, "droppedCount")),
                          size.columns));
    return screen_.show(lines);
  }

  Screen screen_;
  ForceHistory history_;
  Json newest_;
  bool colours_;
  bool utf8_;
};

std::unique_ptr<Display> makeDisplay(const CommandOptions& options, const WatchOptions& watch) {
  if (options.json) return std::make_unique<JsonLines>();
  if (::isatty(STDOUT_FILENO) != 1) return std::make_unique<Lines>(watch.line);
  if (watch.line) return std::make_unique<StandingLine>();
  return std::make_unique<Table>(wantsColours(options.color));
}

/// The fields to ask for; none: the whole status.
std::vector<std::string> fieldsFor(const CommandOptions& options, const WatchOptions& watch) {
  if (options.json) return watch.fields;
  const bool table = ::isatty(STDOUT_FILENO) == 1 && !watch.line;
  return table ? std::vector<std::string>{} : kLineFields;
}

/// Whether a daemon refuses to send single fields because it is too old for that.
bool knowsNoFields(const ClientError& error) {
  return error.kind == ClientError::Kind::error_reply &&
         error.what == "org.varlink.service.InvalidParameter" &&
         textAt(error.parameters, "parameter") == "fields";
}

/// A stream of states, and the first of them.
struct Stream {
  VarlinkClient client;
  ClientResult<Json> first;
};

ClientResult<Stream> open(const CommandOptions& options, const WatchOptions& watch,
                          const std::vector<std::string>& fields, int signals) {
  auto client = connectTo(options, false);
  if (!client) return std::unexpected(client.error());
  client->interruptBy(signals);
  Json parameters{{"intervalMs", watch.interval_ms}};
  if (!fields.empty()) parameters["fields"] = fields;
  const auto subscribed = client->subscribe("io.hapticd.Status.Monitor", parameters);
  if (!subscribed) return std::unexpected(subscribed.error());
  auto first = client->next(VarlinkClient::kTimeLimit);
  if (!first && !fields.empty() && watch.fields.empty() && knowsNoFields(first.error())) {
    return open(options, watch, {}, signals);
  }
  return Stream{std::move(*client), std::move(first)};
}

/// Does what a signal asks for; false when the program is to end.
bool handleSignal(Display& display, int signals) {
  const int signal = nextSignal(signals);
  if (signal == SIGWINCH) display.resize();
  if (signal == SIGTSTP) display.stop();
  return signal == SIGWINCH || signal == SIGTSTP;
}

/// Shows what the stream brings until its end. Nothing: ended as asked for.
std::optional<ClientError> follow(Stream& stream, Display& display, const WatchOptions& watch, int signals,
                                  WatchSummary& summary) {
  const auto limit = VarlinkClient::kTimeLimit + std::chrono::milliseconds(watch.interval_ms);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(watch.seconds);
  auto reply = std::move(stream.first);
  for (int shown = 0;; reply = stream.client.next(limit)) {
    if (!reply && reply.error().kind == ClientError::Kind::interrupted) {
      if (handleSignal(display, signals)) continue;
      return std::nullopt;
    }
    if (!reply) return reply.error();
    if (!display.show(*reply)) return std::nullopt;
    summary.add(*reply);
    if (++shown == watch.count) return std::nullopt;
    if (watch.seconds != 0 && std::chrono::steady_clock::now() >= end) return std::nullopt;
  }
}

}  // namespace

int runWatch(const CommandOptions& options, const WatchOptions& watch) {
  const int signals = takeSignals();
  auto stream = open(options, watch, fieldsFor(options, watch), signals);
  if (!stream) return report(stream.error(), options.json);
  if (!stream->first && stream->first.error().kind == ClientError::Kind::error_reply) {
    return report(stream->first.error(), options.json);
  }
  WatchSummary summary;
  auto display = makeDisplay(options, watch);
  const auto failure = follow(*stream, *display, watch, signals, summary);
  display.reset();  // the terminal is the shell's again before anything else is said
  if (watch.summary && !options.json) fmt::print("\n{}", summary.text());
  return failure ? report(*failure, options.json) : kOk;
}

}  // namespace hapticd::tools
