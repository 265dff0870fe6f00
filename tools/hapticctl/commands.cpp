#include "tools/hapticctl/commands.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "config/parameter_table.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/reply_reader.h"
#include "tools/hapticctl/status_text.h"

namespace hapticd::tools {
namespace {

using Assignments = std::vector<std::pair<std::string, std::string>>;

void printJson(const Json& document) {
  fmt::print("{}\n", document.dump(2, ' ', false, Json::error_handler_t::replace));
}

ClientResult<Json> callOnce(const CommandOptions& options, bool may_change, const std::string& method,
                            const Json& parameters = Json::object()) {
  auto client = connectTo(options, may_change);
  if (!client) return std::unexpected(client.error());
  return client->call(method, parameters);
}

/// Calls Engage or Disengage and prints the mode that follows.
int showMode(const CommandOptions& options, const std::string& method, const Json& parameters) {
  const auto reply = callOnce(options, true, method, parameters);
  if (!reply) return report(reply.error(), options.json);
  if (options.json) {
    printJson(*reply);
  } else {
    fmt::print("{}\n", modeText(*reply));
  }
  return kOk;
}

int usageError(const std::string& text) {
  fmt::print(stderr, "hapticctl: {}\nRun 'hapticctl set --help' for more.\n", text);
  return kUsage;
}

std::expected<Assignments, std::string> split(const std::vector<std::string>& texts) {
  Assignments assignments;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos) {
      return std::unexpected(fmt::format("'{}' is not of the form NAME=VALUE", text));
    }
    const std::string name = text.substr(0, equals);
    for (const auto& [other, value] : assignments) {
      if (other == name) return std::unexpected(fmt::format("'{}' is set twice", name));
    }
    assignments.emplace_back(name, text.substr(equals + 1));
  }
  return assignments;
}

template <typename T>
bool reads(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// `text` as the JSON type that the parameter takes. What does not read as that goes as text: the daemon
/// refuses it and says what is allowed.
Json typedValue(const std::string& name, const std::string& text) {
  const config::Parameter* parameter = config::findParameter(name);
  // The daemon may know parameters that this program does not; for those the form of the text decides.
  const auto mayBe = [&](config::Kind kind) { return !parameter || parameter->kind == kind; };
  std::int64_t integer = 0;
  double number = 0;
  if (mayBe(config::Kind::boolean) && (text == "true" || text == "false")) return text == "true";
  if (mayBe(config::Kind::integer) || mayBe(config::Kind::number)) {
    if (reads(text, integer)) return integer;
    if (reads(text, number) && std::isfinite(number)) return number;  // JSON has no other numbers
  }
  return text;
}

ClientResult<Json> getRows(VarlinkClient& client, const Assignments& assignments) {
  Json names = Json::array();
  for (const auto& [name, value] : assignments) names.push_back(name);
  auto reply = client.call("io.hapticd.Status.GetParameters", {{"names", names}});
  if (!reply) return reply;
  const Json rows = listAt(*reply, "parameters");
  if (rows.size() == assignments.size()) return rows;
  return std::unexpected(ClientError{ClientError::Kind::no_connection,
                                     "the answer does not fit the question",
                                     "is hapticd of another version than hapticctl? See --version",
                                     {},
                                     0});
}

bool isUnknownParameter(const ClientError& error) {
  return error.kind == ClientError::Kind::error_reply && error.what == "io.hapticd.Status.UnknownParameter";
}

void printChanges(const Json& before, const Json& after, const Json& generation, bool json) {
  Json changes = Json::array();
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Json* old_value = fieldAt(before[i], "value");
    const Json* new_value = fieldAt(after[i], "value");
    const Json none;
    const Json& from = old_value ? *old_value : none;
    const Json& to = new_value ? *new_value : none;
    changes.push_back({{"name", textAt(after[i], "name")},
                       {"before", from},
                       {"after", to},
                       {"unit", textAt(after[i], "unit")}});
    if (!json) {
      fmt::print("{}: {} -> {}\n", textAt(after[i], "name"), valueText(from),
                 withUnit(valueText(to), after[i]));
    }
  }
  if (json) printJson({{"generation", generation}, {"changes", changes}});
}

}  // namespace

ClientResult<VarlinkClient> connectTo(const CommandOptions& options, bool may_change) {
  if (!options.socket.empty()) return VarlinkClient::connect(options.socket);
  const char* environment = std::getenv("HAPTICD_SOCKET");
  if (environment && *environment) return VarlinkClient::connect(environment);

  const config::ControlSettings defaults;
  auto client = VarlinkClient::connect(defaults.control_socket);
  if (client || may_change) return client;
  auto status_client = VarlinkClient::connect(defaults.status_socket);
  const bool control_is_missing = client.error().system_error == ENOENT;
  const bool both_are_missing =
      control_is_missing && !status_client && status_client.error().system_error == ENOENT;
  return status_client || (control_is_missing && !both_are_missing) ? std::move(status_client)
                                                                    : std::move(client);
}

int runStatus(const CommandOptions& options) {
  const auto reply = callOnce(options, false, "io.hapticd.Status.GetStatus");
  if (!reply) return report(reply.error(), options.json);
  if (options.json) {
    printJson(*reply);
  } else {
    const Json* status = fieldAt(*reply, "status");
    fmt::print("{}", statusText(status ? *status : Json()));
  }
  return kOk;
}

int runParameterTable(const CommandOptions& options) {
  const auto reply = callOnce(options, false, "io.hapticd.Status.GetParameters");
  if (!reply) return report(reply.error(), options.json);
  if (options.json) {
    printJson(*reply);
  } else {
    fmt::print("{}", parameterTableText(listAt(*reply, "parameters")));
  }
  return kOk;
}

int runGet(const CommandOptions& options, const std::vector<std::string>& names) {
  const Json parameters = names.empty() ? Json::object() : Json{{"names", Json(names)}};
  const auto reply = callOnce(options, false, "io.hapticd.Status.GetParameters", parameters);
  if (!reply) return report(reply.error(), options.json);
  if (options.json) {
    printJson(*reply);
  } else {
    for (const Json& parameter : listAt(*reply, "parameters")) fmt::print("{}\n", parameterLine(parameter));
  }
  return kOk;
}

int runSet(const CommandOptions& options, const std::vector<std::string>& texts) {
  const auto assignments = split(texts);
  if (!assignments) return usageError(assignments.error());
  auto client = connectTo(options, true);
  if (!client) return report(client.error(), options.json);
  const auto before = getRows(*client, *assignments);
  if (!before && !isUnknownParameter(before.error())) return report(before.error(), options.json);

  // Unknown names are sent too: the refusal then lists all that is wrong, not the names alone.
  Json values = Json::object();
  for (const auto& [name, text] : *assignments) values[name] = typedValue(name, text);
  const auto reply = client->call("io.hapticd.Control.SetParameters", {{"parameters", values}});
  if (!reply) return report(reply.error(), options.json);
  if (!before) return report(before.error(), options.json);
  const auto after = getRows(*client, *assignments);
  if (!after) return report(after.error(), options.json);
  const Json* generation = fieldAt(*reply, "generation");
  printChanges(*before, *after, generation ? *generation : Json(), options.json);
  return kOk;
}

int runEngage(const CommandOptions& options, bool inside_surface) {
  return showMode(options, "io.hapticd.Control.Engage", {{"insideSurface", inside_surface}});
}

int runDisengage(const CommandOptions& options) {
  return showMode(options, "io.hapticd.Control.Disengage", Json::object());
}

}  // namespace hapticd::tools
