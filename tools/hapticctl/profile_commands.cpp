// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>

#include "tools/hapticctl/command_line.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/table.h"
#include "tools/hapticctl/terminal_text.h"
#include "tools/hapticctl/time_text.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
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
  const auto change = [&](const char* method, const Json& name, const std::string& said) {
    return callAndPrint(options, {method, {{"name", name}}, true}, [&](const Json&) { return said + "\n"; });
  };
  if (!requested.remove.empty()) {
    return change("io.hapticd.Control.DeleteProfile", requested.remove,
                  "deleted " + printable(requested.remove));
  }
  if (!requested.boot.empty()) {
    return change("io.hapticd.Control.SetBootProfile", requested.boot,
                  printable(requested.boot) + " is loaded at each start");
  }
  if (requested.no_boot)
    return change("io.hapticd.Control.SetBootProfile", Json(), "no profile is loaded at the start");
  return callAndPrint(options, {"io.hapticd.Status.ListProfiles"}, [&](const Json& reply) {
    return requested.names_only ? namesText(reply, "profiles") : profilesText(reply);
  });
}

/// Adds a command that takes the name of a profile.
void addNamed(CommandLine& line, const char* command, const char* help, const char* method,
              std::function<std::string(const Json&)> text) {
  const CommandOptions& options = line.options();
  const auto name = std::make_shared<std::string>();
  line.add(command, help,
           [&options, name, method, text = std::move(text)] {
             return callAndPrint(options, {method, {{"name", *name}}, true}, text);
           })
      .add_option("NAME", *name, "Name of the profile")
      ->type_name("PROFILE")
      ->required();
}

}  // namespace

void addProfileCommands(CommandLine& line) {
  addNamed(line, "save", "Save all live parameters as they are now, as a profile",
           "io.hapticd.Control.SaveProfile",
           [](const Json& reply) { return "saved " + textAt(reply, "name") + "\n"; });
  addNamed(line, "load", "Set all live parameters as a profile has them", "io.hapticd.Control.LoadProfile",
           loadedText);

  const CommandOptions& options = line.options();
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
