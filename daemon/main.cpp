#include <fmt/format.h>
#include <sysexits.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "config/yaml_loader.h"
#include "daemon/control/control_service.h"
#include "daemon/control/varlink_server.h"
#include "daemon/running_box.h"

namespace hapticd::daemon {
namespace {

/// How often the control thread takes the ticks out of the ring, which holds several seconds of them.
constexpr std::chrono::milliseconds kControlPeriod{5};

// What the signal handler works on; the flag keeps a signal that comes before there is a server.
std::atomic<bool> stop_requested{false};
std::atomic<VarlinkServer*> server_to_stop{nullptr};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<VarlinkServer*>::is_always_lock_free);

void onSignal(int) {
  const int interrupted_errno = errno;
  stop_requested = true;
  if (VarlinkServer* const server = server_to_stop) server->requestStop();
  errno = interrupted_errno;
}

/// For its life, signals stop `server`; a signal that came before does so at once.
class StoppedBySignals {
 public:
  explicit StoppedBySignals(VarlinkServer& server) {
    server_to_stop = &server;
    if (stop_requested) server.requestStop();
  }
  ~StoppedBySignals() { server_to_stop = nullptr; }
  StoppedBySignals(const StoppedBySignals&) = delete;
  StoppedBySignals& operator=(const StoppedBySignals&) = delete;
};

/// Signals that end the daemon; one that is ignored at the start (a background job of a script) stays
/// ignored.
void catchSignals() {
  struct sigaction action {};
  action.sa_handler = onSignal;
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    struct sigaction current {};
    sigaction(signal, nullptr, &current);
    if (current.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
  }
  std::signal(SIGPIPE, SIG_IGN);
}

/// One line to the journal (or the terminal) with the priority that systemd reads off its beginning.
void log(const char* priority, const std::string& text) {
  const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  const std::string line = fmt::format("{}hapticd: {}\n", journal ? priority : "", text);
  std::fputs(line.c_str(), stderr);  // fmt::print throws where nobody reads, and the daemon lives on
}

int fail(const config::Error& error, int status) {
  log(SD_ERR, error.text());
  return status;
}

ServerOptions serverOptions(const config::ControlSettings& settings) {
  ServerOptions options;
  options.listeners.push_back({Access::read, settings.status_socket, 0666, "", -1});
  options.listeners.push_back({Access::control, settings.control_socket, 0660, "haptic", -1});
  return options;
}

int serve(const config::Settings& settings) {
  catchSignals();  // before there is a socket file that one could leave behind
  RunningBox box(settings);
  ControlService service(box, {.log = [](const std::string& change) { log(SD_NOTICE, change); }});
  auto server = VarlinkServer::create(serverOptions(settings.control), service);
  if (!server) return fail(server.error(), EX_UNAVAILABLE);
  const StoppedBySignals stopped_by_signals(**server);
  if (auto started = box.start(); !started) return fail(started.error(), EX_CONFIG);
  for (const std::string& warning : box.status().warnings) log(SD_WARNING, warning);

  sd_notify(0, "READY=1\nSTATUS=running");
  (*server)->run(kControlPeriod, [&] {
    box.drainTicks([&service](const rt::Tick& tick) { service.onTick(tick); });
    service.periodic(**server);
  });
  sd_notify(0, "STOPPING=1");
  box.stop();
  return EX_OK;
}

int run(int argc, char** argv) {
  CLI::App app{"hapticd: feels a depth camera's scene through a haptic handle"};
  app.footer(
      "Exit status: 0 ended by SIGTERM or SIGINT, 64 usage, 69 sockets unavailable, 78 configuration.");
  std::string file;
  std::vector<std::string> overrides;
  bool check_only = false;
  app.add_option("-c,--config", file, "configuration file (YAML)")->required()->type_name("FILE");
  app.add_option("-s,--set", overrides, "set a parameter after the file is read; may be repeated")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  app.add_flag("--check", check_only, "check the configuration and end");
  app.set_version_flag("--version", std::string("hapticd ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? EX_OK : EX_USAGE;
  }

  const auto settings = config::loadSettings(file, overrides);
  if (!settings) {
    for (const config::Error& error : settings.error()) fail(error, EX_CONFIG);
    return EX_CONFIG;
  }
  if (check_only) {
    fmt::print("{}: no problem found\n", file);
    return EX_OK;
  }
  return serve(*settings);
}

}  // namespace
}  // namespace hapticd::daemon

int main(int argc, char** argv) {
  return hapticd::daemon::run(argc, argv);
}
