#include "tools/hapticctl/doctor_command.h"

#include <fmt/format.h>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/reply_reader.h"
#include "tools/hapticctl/status_text.h"

namespace hapticd::tools {
namespace {

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
  view.complaints = complaints(status);
  if (textAt(status, "mode") == "faulted")
    view.complaints.push_back(modeText(status) + "; hapticctl disengage clears it");
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

/// A call would start a stopped service, by its sockets.
bool wouldStartTheService(const std::optional<UnitProperties>& unit) {
  if (!isInstalled(unit)) return false;
  const auto state = unit->find("ActiveState");
  return state != unit->end() && (state->second == "inactive" || state->second == "failed");
}

/// The daemon's own view of itself, unless asking would change something or mean another machine.
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

}  // namespace

int runDoctor(const CommandOptions& options, const DoctorOptions& doctor) {
  const bool this_machine = doctor.root == "/";
  Examination box{Machine(doctor.root), thisCaller(), std::nullopt, {}};
  if (this_machine) box.unit = askServiceManager();
  box.daemon = daemonView(options, box, this_machine);
  const Findings findings = examine(box);
  fmt::print("{}", options.json ? jsonOf(findings) : textOf(findings));
  return exitStatus(findings);
}

}  // namespace hapticd::tools
