// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>

#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

constexpr const char* kDoctorFooter =
    "Each line has 'ok', 'warn' or 'fail', what was examined, what was found, and\n"
    "what to do about it.\n"
    "Exit status: 0 done, nothing fails, 1 something fails, 2 wrong usage.\n";

struct DoctorOptions {
  /// The folder that stands for "/"; with another one the service manager is not queried, and the daemon only
  /// if its socket is named.
  std::string root = "/";
  std::string named;  ///< a device file; empty: examine everything
};

DaemonView silentDaemon(const ClientError& error) {
  DaemonView view;
  view.problem = error.what;
  return view;
}

DaemonView viewOf(const Json& status) {
  DaemonView view;
  view.answers = true;
  const Json* cpu = fieldAt(status, "loop.cpu");
  if (cpu && cpu->is_number_integer()) view.cpu = cpu->get<int>();
  view.memory_locked = flagAt(status, "loop.memoryLocked");
  view.warnings = warningsOf(status);
  return view;
}

DaemonView askDaemon(const CommandOptions& options) {
  auto client = connectTo(options, false);
  if (!client) return silentDaemon(client.error());
  const auto reply = client->call("io.hapticd.Status.GetStatus");
  if (!reply) return silentDaemon(reply.error());
  const Json* status = fieldAt(*reply, "status");
  return viewOf(status ? *status : Json());
}

/// Whether a call would start a stopped service, through its socket units.
bool wouldStartTheService(const std::optional<UnitProperties>& unit) {
  if (!isInstalled(unit)) return false;
  const auto state = unit->find("ActiveState");
  return state != unit->end() && (state->second == "inactive" || state->second == "failed");
}

/// What the daemon reports of itself, unless asking would start it or reach another machine.
DaemonView daemonView(const CommandOptions& options, const Examination& box, bool this_machine) {
  DaemonView silent;
  if (options.socket.empty() && !this_machine) {
    silent.problem = "not asked, because of --root";
  } else if (options.socket.empty() && wouldStartTheService(box.unit)) {
    silent.problem = "the service does not run";
  } else {
    return askDaemon(options);
  }
  return silent;
}

/// Returns 0 if the configuration names a device, else 1.
int answerNamed(const DoctorOptions& doctor) {
  Examination box{Machine(doctor.root), {}, std::nullopt, {}, readConfiguration(doctor.root)};
  if (doctor.root == "/") box.gpio_label = gpioLabelOf;
  return isNamedDevice(box, doctor.named) ? 0 : 1;
}

/// Prints what is right and wrong with this machine; returns 0, or 1 when something fails.
int runDoctor(const CommandOptions& options, const DoctorOptions& doctor) {
  if (!doctor.named.empty()) return answerNamed(doctor);
  const bool this_machine = doctor.root == "/";
  Examination box{Machine(doctor.root), thisCaller(), std::nullopt, {}, readConfiguration(doctor.root)};
  if (this_machine) {
    box.unit = askServiceManager();
    box.depth_probe = depthFormatOf;
    box.gpio_label = gpioLabelOf;
    box.architecture = machineArchitecture();
  }
  box.daemon = daemonView(options, box, this_machine);
  const Findings findings = examine(box);
  fmt::print("{}", options.json ? jsonOf(findings) : textOf(findings));
  return exitStatus(findings);
}

}  // namespace

void addDoctorCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto doctor = std::make_shared<DoctorOptions>();
  CLI::App& command =
      line.add("doctor", "Check kernel, CPUs, rights, devices, traces and service; needs no daemon",
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
