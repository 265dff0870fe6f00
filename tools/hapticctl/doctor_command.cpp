// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>

#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/running_daemon.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr const char* kDoctorFooter =
    "Each line has 'ok', 'warn' or 'fail', what was examined, what was found, and\n"
    "what to do about it. A running hapticd is asked which configuration, camera,\n"
    "handle and CPU it uses; without one the configuration file is read.\n"
    "Exit status: 0 done, nothing fails, 1 something fails, 2 wrong usage.\n";

struct DoctorOptions {
  /// The folder that stands for "/"; with another one the service manager is not queried, and the daemon only
  /// if its socket is named.
  std::string root = "/";
  std::string named;  ///< a device file; empty: examine everything
};

/// Returns 0 if the configuration names a device, else 1.
int answerNamed(const CommandOptions& options, const DoctorOptions& doctor) {
  Examination box{Machine(doctor.root), {}, std::nullopt, {}, readConfiguration(doctor.root)};
  if (doctor.root == "/") box.gpio_label = gpioLabelOf;
  const bool is_named = isNamedDevice(box, doctor.named);
  if (options.json) printJson({{"device", doctor.named}, {"named", is_named}});
  return is_named ? 0 : 1;
}

/// Prints what is right and wrong with this machine; returns 0, or 1 when something fails.
int runDoctor(const CommandOptions& options, const DoctorOptions& doctor) {
  if (!doctor.named.empty()) return answerNamed(options, doctor);
  const bool this_machine = doctor.root == "/";
  Examination box{Machine(doctor.root), thisCaller(), std::nullopt, {}, {}};
  if (this_machine) {
    box.unit = askServiceManager();
    box.depth_probe = depthFormatOf;
    box.gpio_label = gpioLabelOf;
    box.architecture = machineArchitecture();
  }
  box.daemon = daemonView(options, box.unit, this_machine);
  // another machine's files are examined with its own configuration, whatever daemon was named
  box.configuration =
      this_machine ? configurationInUse(box.daemon, doctor.root) : readConfiguration(doctor.root);
  const Findings findings = examine(box);
  fmt::print("{}", options.json ? jsonOf(findings) : fitted(textOf(findings), terminalSize().columns));
  return exitStatus(findings);
}

}  // namespace

void addDoctorCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto doctor = std::make_shared<DoctorOptions>();
  CLI::App& command = line.add("doctor", "Check kernel, CPUs, rights, devices, traces and service",
                               [&options, doctor] { return runDoctor(options, *doctor); });
  command.footer(kDoctorFooter);
  command.add_option("--root", doctor->root, "Check the files below this folder instead of this machine's")
      ->type_name("FOLDER")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""));
  command
      .add_option("--names", doctor->named,
                  "Examine nothing, and exit with 0 if the configuration names this device, else with 1")
      ->type_name("DEVICE");
}

}  // namespace hapticd::tools
