#include "tools/hapticctl/watch.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>

#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/reply_reader.h"
#include "tools/hapticctl/status_text.h"
#include "tools/hapticctl/watch_summary.h"

namespace hapticd::tools {
namespace {

/// Readable once somebody wants the program to end.
int endSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGHUP);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  return ::signalfd(-1, &signals, SFD_CLOEXEC);
}

/// The table of `status` with what happened since the previous one.
std::string tableText(const Json& reply) {
  const Json* status = fieldAt(reply, "status");
  return statusText(status ? *status : Json()) +
         fmt::format("{:<14}{}\n\nCtrl-C ends\n", "now", monitorLine(reply));
}

/// Overwrites the terminal from its upper left corner, without the flicker of clearing it first.
void redraw(const std::string& text) {
  std::string lines;
  for (const char character : text) {
    if (character == '\n') lines += "\033[K";
    lines += character;
  }
  fmt::print("\033[H{}\033[J", lines);
}

/// Where and how states are shown.
enum class Display { json, table, line, lines };

Display displayOf(const CommandOptions& options, const WatchOptions& watch) {
  if (options.json) return Display::json;
  if (::isatty(STDOUT_FILENO) != 1) return Display::lines;
  return watch.line ? Display::line : Display::table;
}

void show(const Json& reply, Display display, bool short_lines) {
  switch (display) {
    case Display::json:
      fmt::print("{}\n", reply.dump(-1, ' ', false, Json::error_handler_t::replace));
      break;
    case Display::table:
      redraw(tableText(reply));
      break;
    case Display::line:
      fmt::print("\r{}\033[K", liveLine(reply));
      break;
    case Display::lines:
      fmt::print("{}\n", short_lines ? liveLine(reply) : monitorLine(reply));
      break;
  }
  std::fflush(stdout);
}

/// Shows what the stream brings until its end; returns the exit code.
int follow(VarlinkClient& client, const CommandOptions& options, const WatchOptions& watch,
           WatchSummary& summary) {
  const Display display = displayOf(options, watch);
  if (display == Display::table) fmt::print("\033[2J");
  const auto limit = VarlinkClient::kTimeLimit + std::chrono::milliseconds(watch.interval_ms);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(watch.seconds);
  for (int shown = 0; watch.count == 0 || shown < watch.count; ++shown) {
    const auto reply = client.next(limit);
    if (!reply && reply.error().kind == ClientError::Kind::interrupted) break;
    if (!reply) return report(reply.error(), options.json);
    show(*reply, display, watch.line);
    summary.add(*reply);
    if (watch.seconds != 0 && std::chrono::steady_clock::now() >= end) break;
  }
  if (display == Display::line) fmt::print("\n");
  return kOk;
}

}  // namespace

int runWatch(const CommandOptions& options, const WatchOptions& watch) {
  auto client = connectTo(options, false);
  if (!client) return report(client.error(), options.json);
  client->interruptBy(endSignals());
  const auto subscribed = client->subscribe("io.hapticd.Status.Monitor", {{"intervalMs", watch.interval_ms}});
  if (!subscribed) return report(subscribed.error(), options.json);
  WatchSummary summary;
  const int status = follow(*client, options, watch, summary);
  if (watch.summary && !options.json) fmt::print("\n{}", summary.text());
  return status;
}

}  // namespace hapticd::tools
