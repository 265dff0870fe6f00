// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/running_daemon.h"

#include <cstdint>
#include <cstdlib>
#include <string>

#include "config/settings/parameter_table.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

std::optional<config::Value> valueOf(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number_integer()) return value.get<std::int64_t>();
  if (value.is_number()) return value.get<double>();
  if (value.is_string()) return value.get<std::string>();
  return std::nullopt;
}

/// Takes over the rows of a reply of GetParameters that this program knows, and whose values it allows.
void apply(const Json& reply, config::Settings& settings) {
  for (const Json& row : listAt(reply, "parameters")) {
    const Json* const name = fieldAt(row, "name");
    const Json* const value = fieldAt(row, "value");
    if (!name || !name->is_string() || !value) continue;
    const config::Parameter* const parameter = config::findParameter(name->get<std::string>());
    const auto read = valueOf(*value);
    if (!parameter || !read) continue;
    if (const auto checked = parameter->check(*read)) parameter->set(settings, *checked);
  }
}

/// The parameters of a daemon as settings; nothing if it does not report them.
std::optional<config::Settings> settingsOf(VarlinkClient& client) {
  const auto reply = client.call("io.hapticd.Status.GetParameters");
  if (!reply || listAt(*reply, "parameters").empty()) return std::nullopt;
  config::Settings settings;
  apply(*reply, settings);
  // the list leaves out what stands in for a device, which a daemon of another version may not know
  Json names = Json::array();
  for (const config::Parameter& parameter : config::standInParameters()) names.push_back(parameter.name);
  if (const auto others = client.call("io.hapticd.Status.GetParameters", {{"names", names}}))
    apply(*others, settings);
  return settings;
}

/// A field of the status; empty where it is missing.
std::string reported(const Json& status, const char* path) {
  const Json* const field = fieldAt(status, path);
  return field && field->is_string() ? textAt(status, path) : "";
}

DaemonView viewOf(const Json& status) {
  DaemonView view;
  view.answers = true;
  const Json* cpu = fieldAt(status, "loop.cpu");
  if (cpu && cpu->is_number_integer()) view.cpu = cpu->get<int>();
  view.memory_locked = flagAt(status, "loop.memoryLocked");
  view.warnings = warningsOf(status);
  view.camera = {.identity = reported(status, "camera.identity"),
                 .state = reported(status, "camera.state"),
                 .detail = reported(status, "camera.detail"),
                 .node = reported(status, "camera.details.node"),
                 .format = reported(status, "camera.details.format")};
  view.camera.works = view.camera.state == "streaming";
  if (!view.camera.works) view.camera.node.clear();
  view.handle = {.identity = reported(status, "handle.identity"),
                 .state = reported(status, "handle.state"),
                 .detail = reported(status, "handle.detail"),
                 .works = flagAt(status, "handle.present")};
  return view;
}

/// The socket that connectTo() takes; empty: one of the default ones.
std::string namedSocket(const CommandOptions& options) {
  if (!options.socket.empty()) return options.socket;
  const char* const environment = std::getenv("HAPTICD_SOCKET");
  return environment ? environment : "";
}

DaemonView silent(const std::string& problem) {
  DaemonView view;
  view.problem = problem;
  return view;
}

DaemonView ask(const CommandOptions& options) {
  const std::string named = namedSocket(options);
  DaemonView view;
  auto client = connectTo(options, false);
  const auto reply = client ? client->call("io.hapticd.Status.GetStatus")
                            : ClientResult<Json>(std::unexpected(client.error()));
  if (reply) {
    const Json* status = fieldAt(*reply, "status");
    view = viewOf(status ? *status : Json());
    view.settings = settingsOf(*client);
    view.socket_process = client->serviceProcess();
  } else {
    view = silent(reply.error().what);
    if (!named.empty()) {
      view.remedy =
          "start the hapticd that has this socket, or omit --socket and HAPTICD_SOCKET for the service";
    }
  }
  view.socket = named.empty() ? "its default socket" : printable(named);
  return view;
}

/// Whether a call would start a stopped service, through its socket units.
bool wouldStartTheService(const std::optional<UnitProperties>& unit) {
  if (!isInstalled(unit)) return false;
  const auto state = unit->find("ActiveState");
  return state != unit->end() && (state->second == "inactive" || state->second == "failed");
}

}  // namespace

DaemonView daemonView(const CommandOptions& options, const std::optional<UnitProperties>& unit,
                      bool this_machine) {
  if (options.socket.empty() && !this_machine) return silent("not asked, because of --root");
  if (namedSocket(options).empty() && wouldStartTheService(unit)) return silent("the service does not run");
  return ask(options);
}

}  // namespace hapticd::tools
