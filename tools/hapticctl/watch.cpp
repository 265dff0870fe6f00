// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/watch.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/base/program.h"
#include "tools/hapticctl/base/calls.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/printer.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

void WatchSummary::add(const Json& reply) {
  if (const Json* status = fieldAt(reply, "status")) status_ = *status;
  // fmin and fmax ignore NaN, which a window without ticks gives
  min_force_n_ = std::fmin(min_force_n_, numberAt(reply, "window.minForceN"));
  max_force_n_ = std::fmax(max_force_n_, numberAt(reply, "window.maxForceN"));
}

std::string WatchSummary::text() const {
  return filled(
             status_,
             "ticks         {loop.counters.ticks:#} in {uptimeS:.1} s, {loop.counters.overruns:#overrun(s)}, "
             "{loop.counters.skippedPeriods:#skipped period(s)}, {loop.counters.contactTicks:#} in contact\n"
             "frames        {camera.frames:#} from the camera, {scene.models:#} modelled, "
             "{scene.skippedFrames:#} skipped, the last one of ") +
         sceneContentText(status_) +
         fmt::format("\nforce         {}..{} N\n", fixed(min_force_n_, 2), fixed(max_force_n_, 2)) +
         filled(status_,
                "wake-up       {loop.wakeupLatency:latency}\ncompute       {loop.computeTime:latency}\n");
}

Json WatchSummary::json() const {
  return {{"summary", {{"minForceN", min_force_n_}, {"maxForceN", max_force_n_}, {"status", status_}}}};
}

namespace {

constexpr std::array<std::string_view, 9> kBlocks{" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr std::array<std::string_view, 4> kSigns{" ", ".", "+", "#"};
constexpr std::size_t kScaleColumns = 10;  // "  10.0 N |"

/// 1, 2 or 5 times a power of ten, not below `value`.
double roundedUp(double value) {
  double decade = 0.1;
  for (;; decade *= 10) {
    for (const double step : {1.0, 2.0, 5.0}) {
      if (value <= step * decade) return step * decade;
    }
  }
}

/// Returns how many of the `steps` of a column are filled in a row.
std::size_t fill(double share, std::size_t row_from_below, std::size_t rows, std::size_t steps) {
  const double in_row = share * static_cast<double>(rows) - static_cast<double>(row_from_below);
  return static_cast<std::size_t>(std::lround(std::clamp(in_row, 0.0, 1.0) * static_cast<double>(steps)));
}

}  // namespace

void ForceHistory::add(double max_force_n) {
  forces_n_.push_back(max_force_n);
  if (forces_n_.size() > kWindows) forces_n_.pop_front();
}

std::vector<std::string> ForceHistory::lines(std::size_t rows, std::size_t columns, bool utf8) const {
  if (columns <= kScaleColumns || rows == 0) return {};
  const std::size_t shown = std::min(columns - kScaleColumns, forces_n_.size());
  const std::vector<double> newest(forces_n_.end() - static_cast<std::ptrdiff_t>(shown), forces_n_.end());
  double largest_n = 0;
  for (const double force_n : newest) largest_n = std::fmax(largest_n, force_n);
  const double scale_n = roundedUp(largest_n);
  const std::size_t steps = (utf8 ? kBlocks.size() : kSigns.size()) - 1;

  std::vector<std::string> drawn;
  for (std::size_t row = rows; row-- > 0;) {
    const bool top = row + 1 == rows;
    std::string line = top ? fmt::format("{:>6.1f} N |", scale_n) : row == 0 ? "     0 N |" : "         |";
    for (const double force_n : newest) {
      const std::size_t filled = std::isnan(force_n) ? 0 : fill(force_n / scale_n, row, rows, steps);
      line += utf8 ? kBlocks[filled] : kSigns[filled];
    }
    drawn.push_back(std::move(line));
  }
  return drawn;
}

bool Screen::show(const std::vector<std::string>& lines) {
  std::string text = "\033[H";
  // cleared before it is written: after a line that fills the terminal the cursor is still on its last
  // column
  for (std::size_t i = 0; i < lines.size(); ++i) text += (i == 0 ? "\033[K" : "\r\n\033[K") + lines[i];
  fmt::print("{}\033[J", text);
  return base::flushOutput();
}

void Screen::stop() {
  leave();
  ::raise(SIGSTOP);
  enter();
}

void Screen::enter() {
  fmt::print("\033[?1049h\033[?25l\033[2J");
  base::flushOutput();
}

void Screen::leave() {
  fmt::print("\033[?25h\033[?1049l");
  base::flushOutput();
}

namespace {

/// The fields of the status that lines and their summary show; the table shows nearly all of them.
const std::vector<std::string> kLineFields{
    "mode",         "uptimeS",       "loop.rateHz", "loop.counters", "loop.wakeupLatency", "loop.computeTime",
    "camera.state", "camera.frames", "scene",       "tick"};
constexpr std::size_t kHistoryRows = 4;

/// The reply with a window of the newest tick if there are no ticks yet: the first reply of a stream is
/// sent at once, and would have gaps where the others have forces.
Json withTicks(Json reply) {
  if (numberAt(reply, "window.ticks") > 0 || !fieldAt(reply, "status.tick")) return reply;
  const double force_n = lengthAt(reply, "status.tick.commandForceNInWorld");
  const std::string contact = textAt(reply, "status.tick.contact");
  const bool in_contact =
      numberAt(reply, "status.tick.pointsUsed") > 0 || contact == "contact" || contact == "entrenched";
  const Json* latency = fieldAt(reply, "status.tick.wakeupLatencyNs");
  reply["window"] = {{"ticks", 1},
                     {"contactTicks", in_contact ? 1 : 0},
                     {"minForceN", force_n},
                     {"maxForceN", force_n},
                     {"maxWakeupLatencyNs", latency ? *latency : Json()}};
  return reply;
}

/// Shows states to the user.
class Display {
 public:
  virtual ~Display() = default;
  /// Returns false if nobody can see it any more.
  virtual bool show(const Json& reply) = 0;
  /// Prints a message on standard error, beside the states.
  virtual void note(const std::string& text) { fmt::print(stderr, "hapticctl: {}\n", text); }
  /// The terminal has another size.
  virtual void resize() {}
  /// The program is to stop for a while.
  virtual void stop() { ::raise(SIGSTOP); }
};

class JsonLines : public Display {
 public:
  bool show(const Json& reply) override {
    printJsonLine(reply);
    return base::flushOutput();
  }
};

class Lines : public Display {
 public:
  explicit Lines(bool short_lines) : short_lines_(short_lines) {}
  bool show(const Json& reply) override {
    const Json complete = withTicks(reply);
    fmt::print("{}\n", short_lines_ ? liveLine(complete) : monitorLine(complete));
    return base::flushOutput();
  }

 private:
  bool short_lines_;
};

/// One line of a terminal, which is overwritten.
class StandingLine : public Display {
 public:
  ~StandingLine() override { fmt::print("\n"); }
  bool show(const Json& reply) override {
    fmt::print("\r{}\033[K", cutTo(liveLine(withTicks(reply)), terminalSize().columns - 1));
    return base::flushOutput();
  }
  void note(const std::string& text) override {
    fmt::print("\n");
    base::flushOutput();
    Display::note(text);
  }
};

/// The whole terminal: the state at a glance, and the forces of the last windows.
class WholeScreen : public Display {
 public:
  explicit WholeScreen(bool colours) : colours_(colours), utf8_(showsUtf8()) {}

  bool show(const Json& reply) override {
    newest_ = withTicks(reply);
    history_.add(numberAt(newest_, "window.maxForceN"));
    note_.clear();
    return draw();
  }
  /// Shows the message on the screen, which standard error would disturb if it is the same terminal.
  void note(const std::string& text) override {
    note_ = text;
    draw();
    if (::isatty(STDERR_FILENO) != 1) Display::note(text);
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
    const std::string last_line =
        filled(newest_,
               "force {window.minForceN:.2}..{window.maxForceN:.2} N, wake-up max "
               "{window.maxWakeupLatencyNs:ns}, {droppedCount:#} states dropped   Ctrl-C ends");
    lines.push_back(painted(cutTo(note_.empty() ? last_line : "! " + note_, size.columns),
                            note_.empty() ? Colour::plain : Colour::red, colours_));
    return screen_.show(lines);
  }

  Screen screen_;
  ForceHistory history_;
  Json newest_;
  std::string note_;  ///< in place of the last line until the next state
  bool colours_;
  bool utf8_;
};

std::unique_ptr<Display> makeDisplay(const CommandOptions& options, const WatchOptions& watch) {
  if (options.json) return std::make_unique<JsonLines>();
  if (!isScreen(STDOUT_FILENO)) return std::make_unique<Lines>(watch.line);
  if (watch.line) return std::make_unique<StandingLine>();
  return std::make_unique<WholeScreen>(wantsColours(options.color));
}

/// The fields to request; none: the whole status.
std::vector<std::string> fieldsFor(const CommandOptions& options, const WatchOptions& watch) {
  if (options.json) return watch.fields;
  const bool table = isScreen(STDOUT_FILENO) && !watch.line;
  return table ? std::vector<std::string>{} : kLineFields;
}

/// A stream of states, and the first of them.
struct Stream {
  VarlinkClient client;
  ClientResult<Json> first;
};

ClientResult<Stream> open(const CommandOptions& options, const WatchOptions& watch, int signals) {
  auto client = connectTo(options, false);
  if (!client) return std::unexpected(client.error());
  client->interruptBy(signals);
  Json parameters{{"intervalMs", watch.interval_ms}};
  if (const auto fields = fieldsFor(options, watch); !fields.empty()) parameters["fields"] = fields;
  const auto subscribed = client->subscribe("io.hapticd.Status.Monitor", parameters);
  if (!subscribed) return std::unexpected(subscribed.error());
  auto first = client->next(VarlinkClient::kTimeLimit);
  return Stream{std::move(*client), std::move(first)};
}

/// Handles a signal; returns false if the program must end.
bool handleSignal(Display& display, int signals) {
  const int signal = nextSignal(signals);
  if (signal == SIGWINCH) display.resize();
  if (signal == SIGTSTP) display.stop();
  return signal == SIGWINCH || signal == SIGTSTP;
}

/// Progress of the display: the states shown, and the end.
struct Shown {
  int states = 0;
  Reconnection::Clock::time_point end = Reconnection::Clock::time_point::max();
  WatchSummary summary;
};

/// Shows the states of a stream until its end. Nothing: ended as asked for.
std::optional<ClientError> follow(Stream& stream, Display& display, const WatchOptions& watch, int signals,
                                  Shown& so_far) {
  const auto limit = VarlinkClient::kTimeLimit + std::chrono::milliseconds(watch.interval_ms);
  for (auto reply = std::move(stream.first);; reply = stream.client.next(limit)) {
    if (!reply && reply.error().kind == ClientError::Kind::interrupted) {
      if (handleSignal(display, signals)) continue;
      return std::nullopt;
    }
    if (!reply) return reply.error();
    if (!display.show(*reply)) return std::nullopt;
    so_far.summary.add(*reply);
    if (++so_far.states == watch.count) return std::nullopt;
    if (Reconnection::Clock::now() >= so_far.end) return std::nullopt;
  }
}

/// Shows states, and connects again where the connection is lost once a state was shown. Nothing: ended as
/// asked for.
std::optional<ClientError> followAcrossRestarts(const CommandOptions& options, const WatchOptions& watch,
                                                Stream first, Display& display, int signals, Shown& so_far) {
  std::optional<Stream> stream(std::move(first));
  for (;;) {
    const auto failure = follow(*stream, display, watch, signals, so_far);
    if (!failure || so_far.states == 0 || !mayPass(*failure)) return failure;
    stream.reset();
    display.note("the connection is lost, trying again until Ctrl-C (" + failure->what + ")");
    Reconnection reconnection(
        signals, [&] { return handleSignal(display, signals); }, so_far.end);
    auto again = reconnection.retry<Stream>([&]() -> ClientResult<Stream> {
      auto opened = open(options, watch, signals);
      if (opened && !opened->first) return std::unexpected(opened->first.error());
      return opened;
    });
    if (!again) return std::nullopt;
    if (!*again) return again->error();
    display.note("connected to hapticd again");
    stream.emplace(std::move(**again));
  }
}

}  // namespace

int runWatch(const CommandOptions& options, const WatchOptions& watch) {
  const int signals = takeSignals();
  auto stream = open(options, watch, signals);
  if (!stream) return report(stream.error(), options.json);
  if (!stream->first && stream->first.error().kind == ClientError::Kind::error_reply) {
    return report(stream->first.error(), options.json);
  }
  Shown so_far;
  if (watch.seconds != 0) so_far.end = Reconnection::Clock::now() + std::chrono::seconds(watch.seconds);
  auto display = makeDisplay(options, watch);
  const auto failure = followAcrossRestarts(options, watch, std::move(*stream), *display, signals, so_far);
  display.reset();  // gives the terminal back to the shell before anything else is printed
  if (watch.summary && options.json) printJsonLine(so_far.summary.json());
  if (watch.summary && !options.json) fmt::print("\n{}", so_far.summary.text());
  return failure ? report(*failure, options.json) : kOk;
}

}  // namespace hapticd::tools
