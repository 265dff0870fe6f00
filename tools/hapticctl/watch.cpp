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

void show(const Json& reply, bool json, bool terminal) {
  if (json) {
    fmt::print("{}\n", reply.dump(-1, ' ', false, Json::error_handler_t::replace));
  } else if (terminal) {
    redraw(tableText(reply));
  } else {
    fmt::print("{}\n", monitorLine(reply));
  }
  std::fflush(stdout);
}

}  // namespace

int runWatch(const CommandOptions& options, int interval_ms, int count) {
  auto client = connectTo(options, false);
  if (!client) return report(client.error(), options.json);
  client->interruptBy(endSignals());
  const auto subscribed = client->subscribe("io.hapticd.Status.Monitor", {{"intervalMs", interval_ms}});
  if (!subscribed) return report(subscribed.error(), options.json);

  const bool terminal = !options.json && ::isatty(STDOUT_FILENO) == 1;
  if (terminal) fmt::print("\033[2J");
  const auto limit = VarlinkClient::kTimeLimit + std::chrono::milliseconds(interval_ms);
  for (int shown = 0; count == 0 || shown < count; ++shown) {
    const auto reply = client->next(limit);
    if (!reply && reply.error().kind == ClientError::Kind::interrupted) break;
    if (!reply) return report(reply.error(), options.json);
    show(*reply, options.json, terminal);
  }
  return kOk;
}

}  // namespace hapticd::tools
