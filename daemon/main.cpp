// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/stat.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/base/program.h"
#include "config/base/value_text.h"
#include "daemon/journal.h"
#include "daemon/service.h"
#include "daemon/state/start_settings.h"
#include "drivers/driver_table.h"
#include "rt/base/realtime_thread.h"

namespace hapticd::daemon {
namespace {

// What the signal handler works on; the flag remembers a signal that arrives before the service exists.
std::atomic<bool> stop_requested{false};
std::atomic<Service*> service_to_signal{nullptr};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<Service*>::is_always_lock_free);

void onStopSignal(int) {
  const int interrupted_errno = errno;
  stop_requested = true;
  if (Service* const service = service_to_signal) service->requestStop();
  errno = interrupted_errno;
}

void onReloadSignal(int) {
  if (Service* const service = service_to_signal) service->requestReload();
}

/// While it lives, signals reach `service`; a request to stop that arrived earlier is passed on at once.
class SignalRouting {
 public:
  explicit SignalRouting(Service& service) {
    service_to_signal = &service;
    if (stop_requested) service.requestStop();
  }
  ~SignalRouting() { service_to_signal = nullptr; }
  SignalRouting(const SignalRouting&) = delete;
  SignalRouting& operator=(const SignalRouting&) = delete;
};

/// Installs a handler. A signal that is ignored at the start, as in a background job of a script, stays
/// ignored.
void handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  struct sigaction current {};
  sigaction(signal, nullptr, &current);
  if (current.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
}

/// SIGHUP reloads the configuration. Of a daemon on a terminal it means that the terminal is gone: the daemon
/// then stops, because nobody could press Ctrl-C any more. A terminal that forbids output of background jobs
/// would stop the whole daemon at its next message.
void catchSignals() {
  handle(SIGTERM, onStopSignal);
  handle(SIGINT, onStopSignal);
  handle(SIGHUP, ::isatty(STDERR_FILENO) == 1 ? onStopSignal : onReloadSignal);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGTTOU, SIG_IGN);
}

/// Nobody else may write what the daemon creates, whatever mask it inherits: traces, profiles and the
/// registration decide about forces.
void protectFiles() {
  const mode_t inherited = ::umask(S_IWGRP | S_IWOTH);
  ::umask(inherited | S_IWGRP | S_IWOTH);
}

int serve(const StartSettings& start, ConfigurationSource source, std::unique_ptr<FaultInjector> faults) {
  rt::limitThreadStacks();
  protectFiles();
  catchSignals();  // before there is a socket file that a signal could leave behind
  const auto journal = JournalThread::start();
  if (!journal) {
    writeToJournal({JournalEntry::Priority::error, journal.error().text()});
    return EX_OSERR;
  }
  Service service(start, std::move(source), std::move(faults));
  const SignalRouting routing(service);
  return service.run();
}

/// The configuration that hapticd uses if the command line names none.
constexpr const char* kStandardConfiguration = "/etc/hapticd/hapticd.yaml";

/// Creates the injector of a script; null if no script is given.
base::Result<std::unique_ptr<FaultInjector>> injectorFor(const std::string& script,
                                                         const config::Settings& settings) {
  if (script.empty()) return nullptr;
  if (!settings.control.allow_fault_injection) {
    return std::unexpected(
        base::Error{"--inject", "the configuration does not allow fault injection",
                    "set control.allow_fault_injection to true, and let no one hold the handle"});
  }
  auto faults = readFaultScript(script);
  if (!faults) return std::unexpected(faults.error());
  return std::make_unique<FaultInjector>(std::move(*faults));
}

/// What the start would refuse of the drivers, also of the files that they read: a key, a recording.
base::Result<void> checkDrivers(const config::Settings& settings) {
  if (auto usable = drivers::makeHandle(settings.handle, settings.handle)->check(); !usable) return usable;
  return drivers::makeCamera(settings.camera)->check();
}

/// Prints the result of --check for a configuration without errors.
void report(const std::string& file, const StartSettings& start) {
  const auto print = [&file](const std::string& text) {
    fmt::print("{}\n", base::printable(fmt::format("{}: {}", file, text)));
  };
  for (const std::string& notice : start.notices) print("warning: " + notice);
  if (!start.has_marks) {
    print(
        "warning: nothing would show that its end was cut off (begin it with a line `---` and end it with a "
        "line `...`)");
  }
  print("no problem found; " + start.summary.text());
}

int run(int argc, char** argv) {
  CLI::App app{"hapticd: lets a person feel the scene in front of a depth camera through a haptic handle"};
  app.footer(
      "On SIGHUP it reads the file again, as by 'hapticctl reload': live parameters are applied, the others\n"
      "are reported, and what loosens a limit waits while the box is engaged.\n"
      "Exit status: 0 ended by SIGTERM or SIGINT, 64 usage, 69 sockets unavailable or the state folder in\n"
      "use by another hapticd, 70 a part hung while it stopped, 71 a thread cannot be started,\n"
      "78 configuration.");
  std::string file = kStandardConfiguration;
  std::string script;
  std::vector<std::string> overrides;
  bool check_only = false;
  CLI::Option* const config =
      app.add_option("-c,--config", file,
                     std::string("configuration file, YAML (default: ") + kStandardConfiguration + ")")
          ->type_name("FILE");
  app.add_option("-s,--set", overrides, "set a parameter after the file was read; may be repeated")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  app.add_option("--inject", script,
                 "simulate the faults that a script lists, one a line as BEGIN_S DURATION_S FAULT; needs "
                 "control.allow_fault_injection")
      ->type_name("FILE");
  app.add_flag("--check", check_only, "check the configuration, print what it changes, and exit");
  app.set_version_flag("-V,--version", std::string("hapticd ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }

  if (config->count() == 0) {
    writeToJournal({JournalEntry::Priority::info,
                    fmt::format("takes the standard configuration {} (--config names another one)", file)});
  }
  const auto start = startSettings(file, overrides);
  if (!start) {
    for (const base::Error& error : start.error()) {
      writeToJournal({JournalEntry::Priority::error, error.text()});
    }
    return EX_CONFIG;
  }
  auto faults = injectorFor(script, start->settings);
  if (!faults) {
    writeToJournal({JournalEntry::Priority::error, faults.error().text()});
    return EX_CONFIG;
  }
  if (check_only) {
    if (const auto usable = checkDrivers(start->settings); !usable) {
      writeToJournal({JournalEntry::Priority::error, usable.error().text()});
      return EX_CONFIG;
    }
    report(file, *start);
    return EX_OK;
  }
  return serve(*start, {file, overrides}, std::move(*faults));
}

}  // namespace
}  // namespace hapticd::daemon

int main(int argc, char** argv) {
  return hapticd::base::runProgram("hapticd", [&] { return hapticd::daemon::run(argc, argv); });
}
