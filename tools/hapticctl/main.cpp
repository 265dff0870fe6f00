#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tools/hapticctl/commands.h"
#include "tools/hapticctl/completion.h"
#include "tools/hapticctl/doctor_command.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/watch.h"

namespace {

using namespace hapticd::tools;

constexpr const char* kFooter =
    "Exit status: 0 done, 1 the daemon refused or doctor found a failure, 2 wrong usage,\n"
    "3 no connection to the daemon.\n"
    "Socket: --socket, else HAPTICD_SOCKET, else /run/hapticd/io.hapticd.Control, for commands that only "
    "read\n"
    "also /run/hapticd/io.hapticd.Status.\n";

constexpr const char* kDoctorFooter =
    "Each line is 'ok', 'warn' or 'fail', what was looked at, what was found, and what to do about it.\n"
    "Exit status: 0 done, nothing fails, 1 something fails, 2 wrong usage.\n";

struct Arguments {
  CommandOptions options;
  std::vector<std::string> names;
  std::vector<std::string> assignments;
  WatchOptions watch;
  DoctorOptions doctor;
  std::string shell;
  bool inside = false;
};

/// Where each subcommand leaves what is to be done.
using Run = std::function<int()>;

void describe(CLI::App& app, Arguments& arguments, Run& run) {
  app.set_version_flag("--version", "hapticctl " HAPTICD_VERSION);
  app.add_flag("--json", arguments.options.json, "Print what the daemon answered, as JSON");
  app.add_option("--socket", arguments.options.socket, "Socket of the daemon")->type_name("PATH");
  app.require_subcommand(1);
  app.fallthrough();
  app.footer(kFooter);

  const auto add = [&](const char* name, const char* help, Run action) {
    CLI::App* command = app.add_subcommand(name, help);
    command->footer(kFooter);
    command->callback([&run, action = std::move(action)] { run = action; });
    return command;
  };
  add("status", "Show the whole state, what is wrong first", [&] { return runStatus(arguments.options); });

  CLI::App* watch = add("watch", "Show the state again and again, until Ctrl-C",
                        [&] { return runWatch(arguments.options, arguments.watch); });
  watch
      ->add_option("--interval", arguments.watch.interval_ms,
                   "Time between two states, 20 to 60000 ms (default 200)")
      ->type_name("MS")
      ->check(CLI::Range(20, 60000));
  watch->add_option("--count", arguments.watch.count, "End after that many states")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000'000));
  watch->add_option("--seconds", arguments.watch.seconds, "End after that time")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000));
  watch->add_flag("--line", arguments.watch.line, "One short line instead of the table");
  watch->add_flag("--summary", arguments.watch.summary, "Close with a summary, also after Ctrl-C");

  add("get", "Show values of parameters", [&] {
    return runGet(arguments.options, arguments.names);
  })->add_option("NAME", arguments.names, "Names of parameters; none: all");
  add("set", "Change parameters that are live: all of them, or none if one is refused",
      [&] { return runSet(arguments.options, arguments.assignments); })
      ->add_option("ASSIGNMENT", arguments.assignments, "New values, NAME=VALUE each")
      ->required();
  add("engage", "Ask for force", [&] {
    return runEngage(arguments.options, arguments.inside);
  })->add_flag("--inside", arguments.inside, "Also where something is felt at once");
  add("disengage", "End all force, clear a fault", [&] { return runDisengage(arguments.options); });
  add("params", "Show the table of parameters", [&] { return runParameterTable(arguments.options); });

  CLI::App* doctor =
      add("doctor", "Look at kernel, CPUs, rights, devices and service, and say what to do; needs no daemon",
          [&] { return runDoctor(arguments.options, arguments.doctor); });
  doctor->footer(kDoctorFooter);
  doctor
      ->add_option("--root", arguments.doctor.root,
                   "Look at the files below this folder, not at this machine's")
      ->type_name("FOLDER")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""));

  add("completion", "Print the completion script of a shell: source <(hapticctl completion bash)",
      [&] {
        fmt::print("{}", completionScript(arguments.shell));
        return static_cast<int>(kOk);
      })
      ->add_option("SHELL", arguments.shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Queries and tunes a running hapticd", "hapticctl");
  Arguments arguments;
  Run run;
  describe(app, arguments, run);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  return run();
}
