// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/utsname.h>

#include <memory>

#include "config/settings/event_kind.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/commands.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/hapticctl/watch.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

int runStatus(const CommandOptions& options, bool all) {
  return callAndPrint(options, {"io.hapticd.Status.GetStatus"}, [&](const Json& reply) {
    const Json* field = fieldAt(reply, "status");
    const Json status = field ? *field : Json();
    if (all) return statusText(status);
    std::string text;
    const GlanceStyle style{terminalSize(), wantsColours(options.color)};
    for (const std::string& line : glanceLines(status, style)) text += line + "\n";
    return text;
  });
}

void showVersions(const Json& versions, bool json) {
  if (json) return printJson(versions);
  const std::string daemon = textAt(versions, "hapticd");
  fmt::print("hapticctl  {}\nhapticd    {}\nkernel     {}\n", HAPTICD_VERSION, daemon,
             textAt(versions, "kernel"));
  if (daemon != "-" && daemon != HAPTICD_VERSION) {
    fmt::print(
        "! hapticd is of another version than hapticctl (install the same, then systemctl restart "
        "hapticd)\n");
  }
}

int runVersion(const CommandOptions& options) {
  const auto daemon = callOnce(options, {"io.hapticd.Status.GetStatus"});
  Json versions{{"hapticctl", HAPTICD_VERSION}, {"hapticd", Json()}, {"kernel", Json()}};
  if (daemon)
    versions.update(
        {{"hapticd", textAt(*daemon, "status.version")}, {"kernel", textAt(*daemon, "status.kernel")}});
  utsname system{};
  if (versions["kernel"].is_null() && ::uname(&system) == 0) versions["kernel"] = system.release;
  showVersions(versions, options.json);
  return daemon ? kOk : report(daemon.error(), options.json);
}

void addWatch(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto watch = std::make_shared<WatchOptions>();
  CLI::App& command =
      line.add("watch", "Show the state continuously, until Ctrl-C, also across restarts of hapticd",
               [&options, watch] { return runWatch(options, *watch); });
  command
      .add_option("--interval", watch->interval_ms, "Time between two states, 20 to 60000 ms (default 200)")
      ->type_name("MS")
      ->check(within(20, 60000));
  command.add_option("--count", watch->count, "End after this many states")
      ->type_name("N")
      ->check(within(1, 1'000'000'000));
  command.add_option("--seconds", watch->seconds, "End after this many seconds")
      ->type_name("N")
      ->check(within(1, 1'000'000));
  command
      .add_option("--fields", watch->fields,
                  "With --json: only these fields of the status, such as loop.rateHz")
      ->type_name("FIELD")
      ->delimiter(',');
  command.add_flag("--line", watch->line, "Print one short line instead of the table");
  command.add_flag("--summary", watch->summary, "Print a summary at the end, also after Ctrl-C");
}

void addEvents(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto events = std::make_shared<EventOptions>();
  CLI::App& command = line.add("events", "Show events: changes of the mode, the devices, the parameters, ...",
                               [&options, events] { return runEvents(options, *events); });
  command.add_flag("-f,--follow", events->follow,
                   "Go on with new events until Ctrl-C, also across restarts of hapticd");
  command.add_option("-n,--number", events->count, "Past events to show, 0 to 64 (default 20)")
      ->type_name("N")
      ->check(within(0, 64));
  constexpr auto& kinds = rt::kWords<config::EventKind>;
  command.add_option("--kind", events->kinds, "Only events of these kinds")
      ->type_name("KIND")
      ->delimiter(',')
      ->check(CLI::IsMember(std::vector<std::string>(kinds.begin(), kinds.end())));
}

}  // namespace

void addStateCommands(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto all = std::make_shared<bool>(false);
  line.add("status", "Show the state on one screen, with what is wrong first",
           [&options, all] { return runStatus(options, *all); })
      .add_flag("--all", *all, "Show every counter, on more than one screen");
  addWatch(line);
  addEvents(line);
  const auto http = std::make_shared<bool>(false);
  const auto prometheus = std::make_shared<bool>(false);
  CLI::App& metrics = line.add(
      "metrics", "Print the state as OpenMetrics text, for Prometheus and others",
      [&options, http, prometheus] {
        if (*http) return runMetricsOverHttp(options);
        return runMetrics(options, *prometheus ? MetricsFormat::prometheus : MetricsFormat::open_metrics);
      });
  auto* over_http =
      metrics.add_flag("--http", *http, "Answer one HTTP request on stdin and stdout, for a socket unit");
  metrics
      .add_flag("--prometheus", *prometheus,
                "Prometheus' older text format, which promtool check metrics reads")
      ->excludes(over_http);
  line.add("version", "Show the versions of hapticctl, of the daemon and of the kernel",
           [&options] { return runVersion(options); });
}

namespace {

struct ProfileOptions {
  std::string remove;
  std::string boot;
  bool no_boot = false;
  bool names_only = false;
};

std::string profilesText(const Json& reply) {
  Table table({{"NAME"}, {"SAVED"}, {"NOTE"}});
  for (const Json& profile : listAt(reply, "profiles")) {
    table.add({textAt(profile, "name"), utcTime(numberAt(profile, "timeNs")),
               flagAt(profile, "boot") ? "loaded at each start" : ""});
  }
  if (listAt(reply, "profiles").empty()) return "there are no profiles; 'hapticctl save NAME' makes one\n";
  return table.text(terminalSize().columns);
}

std::string loadedText(const Json& reply) {
  const Json& changed = listAt(reply, "changed");
  if (changed.empty()) return "loaded; no parameter has changed\n";
  std::string text = "loaded; changed:\n";
  for (const Json& name : changed) text += "  " + valueText(name) + "\n";
  return text;
}

int runProfiles(const CommandOptions& options, const ProfileOptions& requested) {
  const auto change = [&](const char* method, const char* done, const Json& name, const std::string& text) {
    return callAndPrint(options, {method, {{"name", name}}, true}, [&](const Json&) { return text + "\n"; },
                        {{done, name}});
  };
  if (!requested.remove.empty()) {
    return change("io.hapticd.Control.DeleteProfile", "deleted", requested.remove,
                  "deleted " + printable(requested.remove));
  }
  if (!requested.boot.empty()) {
    return change("io.hapticd.Control.SetBootProfile", "boot", requested.boot,
                  printable(requested.boot) + " is loaded at each start");
  }
  if (requested.no_boot)
    return change("io.hapticd.Control.SetBootProfile", "boot", Json(), "no profile is loaded at the start");
  if (requested.names_only) return printNames(options, {"io.hapticd.Status.ListProfiles"}, "profiles");
  return callAndPrint(options, {"io.hapticd.Status.ListProfiles"}, profilesText);
}

}  // namespace

void addProfileCommands(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto name = std::make_shared<std::string>();
  const auto if_exists = std::make_shared<base::IfExists>(base::IfExists::refuse);
  const auto addName = [&name](CLI::App& command) {
    command.add_option("NAME", *name, "Name of the profile")->type_name("PROFILE")->required();
  };
  CLI::App& save =
      line.add("save", "Save all live parameters as they are now, as a profile", [&options, name, if_exists] {
        const Json parameters{{"name", *name}, {"replace", *if_exists == base::IfExists::replace}};
        return callAndPrint(options, {"io.hapticd.Control.SaveProfile", parameters, true},
                            [](const Json& reply) { return "saved " + textAt(reply, "name") + "\n"; });
      });
  addName(save);
  addForce(save, *if_exists, "Replace a profile of that name");
  addName(line.add("load", "Apply a saved profile to the live parameters", [&options, name] {
    return callAndPrint(options, {"io.hapticd.Control.LoadProfile", {{"name", *name}}, true}, loadedText);
  }));

  const auto requested = std::make_shared<ProfileOptions>();
  CLI::App& profiles =
      line.add("profiles", "List the profiles, delete one, or choose the one that each start loads",
               [&options, requested] { return runProfiles(options, *requested); });
  auto* remove =
      profiles.add_option("--delete", requested->remove, "Delete this profile")->type_name("PROFILE");
  auto* boot =
      profiles.add_option("--boot", requested->boot, "Load this profile at each start")->type_name("PROFILE");
  auto* no_boot = profiles.add_flag("--no-boot", requested->no_boot, "Load no profile at the start");
  remove->excludes(boot)->excludes(no_boot);
  boot->excludes(no_boot);
  addNames(profiles, requested->names_only)->excludes(remove)->excludes(boot)->excludes(no_boot);
}

}  // namespace hapticd::tools
