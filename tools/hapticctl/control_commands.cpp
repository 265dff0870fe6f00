// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/command_line.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <memory>

#include "config/base/counted.h"
#include "config/base/value_text.h"
#include "config/settings/parameter_table.h"
#include "tools/hapticctl/base/number_with_unit.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/list_text.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

using Assignments = std::vector<std::pair<std::string, std::string>>;

int usageError(const CommandOptions& options, const std::string& text) {
  return reportUsage("hapticctl set", text, options.json);
}

std::expected<Assignments, std::string> split(const std::vector<std::string>& texts) {
  Assignments assignments;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos) {
      return std::unexpected(
          fmt::format("{} is not of the form NAME=VALUE, such as force.radius_m=0.03", base::inQuotes(text)));
    }
    const std::string name = text.substr(0, equals);
    for (const auto& [other, value] : assignments) {
      if (other == name) return std::unexpected(fmt::format("{} is set twice", base::inQuotes(name)));
    }
    assignments.emplace_back(name, text.substr(equals + 1));
  }
  return assignments;
}

/// `text` as a JSON value of the type that the parameter has, in its unit where `text` has another one. A
/// text that cannot be read as that type is sent as it is: the daemon refuses it and lists what is allowed.
/// Errors: a unit that the parameter cannot have.
std::expected<Json, std::string> typedValue(const std::string& name, const std::string& written) {
  const config::Parameter* parameter = config::findParameter(name);
  std::string text = written;
  if (parameter && (parameter->kind == config::Kind::integer || parameter->kind == config::Kind::number)) {
    auto number = inUnit(written, parameter->unit);
    if (!number)
      return std::unexpected(fmt::format("{}: {}: {}", name, base::inQuotes(written), number.error()));
    text = *std::move(number);
  }
  // A newer daemon has parameters that this program does not know; the form of the text decides their type.
  const auto mayBe = [&](config::Kind kind) { return !parameter || parameter->kind == kind; };
  if (mayBe(config::Kind::boolean) && (text == "true" || text == "false")) return text == "true";
  if (mayBe(config::Kind::integer) || mayBe(config::Kind::number)) {
    if (const auto integer = base::numberFrom<std::int64_t>(text)) return *integer;
    const auto number = base::numberFrom<double>(text);
    if (number && std::isfinite(*number)) return *number;  // JSON has no other numbers
  }
  return text;
}

/// The changes of a reply in the order of the assignments.
Json inOrder(const Assignments& assignments, const Json& changes) {
  Json ordered = Json::array();
  for (const auto& [name, text] : assignments) {
    for (const Json& change : changes) {
      if (textAt(change, "name") == name) ordered.push_back(change);
    }
  }
  return ordered;
}

int runSet(const CommandOptions& options, const std::vector<std::string>& texts) {
  const auto assignments = split(texts);
  if (!assignments) return usageError(options, assignments.error());
  Json values = Json::object();
  for (const auto& [name, text] : *assignments) {
    auto value = typedValue(name, text);
    if (!value) return usageError(options, value.error());
    values[name] = *std::move(value);
  }
  auto reply = callOnce(options, {"io.hapticd.Control.SetParameters", {{"parameters", values}}, true});
  if (!reply) return report(reply.error(), options.json);
  Json& changes = (*reply)["changes"];
  changes = inOrder(*assignments, changes);
  if (options.json) {
    printJson(*reply);
    return kOk;
  }
  for (const Json& change : changes) {
    fmt::print("{}: {} -> {}\n", textAt(change, "name"), valueText(change.value("before", Json())),
               withUnit(valueText(change.value("after", Json())), change));
  }
  return kOk;
}

std::string parameterLines(const Json& parameters) {
  std::string lines;
  for (const Json& parameter : parameters) lines += parameterLine(parameter) + "\n";
  return lines;
}

/// The rows of the parameters that the words name, by their names or by their groups. The daemon is asked
/// about words that name nothing in its list: it also knows parameters that the list leaves out, and its
/// refusal has the names that are near.
ClientResult<Json> rowsNamed(const CommandOptions& options, const std::vector<std::string>& words) {
  auto client = connectTo(options, false);
  if (!client) return std::unexpected(client.error());
  auto all = client->call("io.hapticd.Status.GetParameters");
  if (!all) return all;
  Json rows = listAt(*all, "parameters");
  auto named = parametersNamed(words, rows);
  if (named) return std::move(*named);
  const auto others = client->call("io.hapticd.Status.GetParameters", {{"names", Json(named.error())}});
  if (!others) return std::unexpected(others.error());
  for (const Json& row : listAt(*others, "parameters")) rows.push_back(row);
  return parametersNamed(words, rows).value_or(Json::array());
}

/// The same, or where the words name nothing, the rows whose name or meaning has all of them.
ClientResult<Json> rowsFound(const CommandOptions& options, const std::vector<std::string>& words) {
  auto named = rowsNamed(options, words);
  if (named) return named;
  const auto all = callOnce(options, {"io.hapticd.Status.GetParameters"});
  if (!all) return named;
  Json found = parametersWith(words, listAt(*all, "parameters"));
  if (found.empty()) return named;
  return found;
}

int showParameters(const CommandOptions& options, const ClientResult<Json>& parameters,
                   const std::function<std::string(const Json& parameters)>& text) {
  if (!parameters) return report(parameters.error(), options.json);
  if (options.json) {
    printJson({{"parameters", *parameters}});
  } else {
    fmt::print("{}", text(*parameters));
  }
  return kOk;
}

/// Adds the argument that names parameters.
void addParameterWords(CLI::App& command, std::vector<std::string>& words) {
  command.add_option("NAME", words, "Names of parameters, or of groups of them such as force; none: all")
      ->type_name("PARAMETER");
}

std::string modeLine(const Json& reply) {
  return modeText(reply) + "\n";
}

/// Whether force follows without further action of a person; otherwise engaging did not succeed.
bool bringsForce(const Json& reply) {
  const std::string mode = textAt(reply, "mode");
  return mode == "engaged" || mode == "holding";
}

int runEngage(const CommandOptions& options, bool inside) {
  const Json parameters = inside ? Json{{"insideSurface", true}} : Json::object();
  const auto reply = callOnce(options, {"io.hapticd.Control.Engage", parameters, true});
  if (!reply) return report(reply.error(), options.json);
  if (!options.json && !bringsForce(*reply)) {
    return report(base::Error{"", "not engaged: " + modeText(*reply), "hapticctl status shows what to do"},
                  false);
  }
  if (options.json) {
    printJson(*reply);
  } else {
    fmt::print("{}{}", modeLine(*reply),
               flagAt(*reply, "already") ? "already engaged; nothing changed\n" : "");
  }
  return bringsForce(*reply) ? kOk : kFailed;
}

std::string linesOf(const Json& texts) {
  std::string lines;
  for (const Json& text : texts) lines += "  " + valueText(text) + "\n";
  return lines;
}

std::string heldLines(const Json& pending) {
  std::string lines;
  for (const Json& held : listAt(pending, "held")) lines += "  " + textAt(held, "text") + "\n";
  return lines;
}

std::string reloadText(const Json& reply) {
  const Json& changes = listAt(reply, "changes");
  std::string text = changes.empty() ? "nothing changed\n"
                                     : base::counted(changes.size(), "change(s)") + "\n" + linesOf(changes);
  if (const Json& waiting = listAt(reply, "waiting"); !waiting.empty())
    text += "at the next start only (systemctl restart hapticd):\n" + linesOf(waiting);
  if (const Json& hidden = listAt(reply, "hidden"); !hidden.empty())
    text +=
        "not in use, because a client or a profile has given the name to another one:\n" + linesOf(hidden);
  const Json* const pending = fieldAt(reply, "pending");
  if (pending && pending->is_object()) {
    text += "held back, because the box is engaged:\n" + heldLines(*pending) +
            "'hapticctl reload --confirm' applies this, and so does 'hapticctl disengage'\n";
  }
  return text;
}

/// Without success where something was held back.
int showReload(const CommandOptions& options, const Json& reply) {
  if (options.json) {
    printJson(reply);
  } else {
    fmt::print("{}", reloadText(reply));
  }
  const Json* const pending = fieldAt(reply, "pending");
  return pending && pending->is_object() ? kFailed : kOk;
}

/// Confirms what is pending now, after showing it: what somebody else has loaded since is refused.
int confirmReload(const CommandOptions& options) {
  auto client = connectTo(options, true);
  if (!client) return report(client.error(), options.json);
  const auto status = client->call("io.hapticd.Status.GetStatus");
  if (!status) return report(status.error(), options.json);
  const Json* const pending = fieldAt(*status, "status.pendingReload");
  const Json* const number = pending && pending->is_object() ? fieldAt(*pending, "number") : nullptr;
  if (!options.json && number) fmt::print("confirmed:\n{}", heldLines(*pending));
  const auto reply = client->call("io.hapticd.Control.Reload", {{"confirm", number ? *number : Json(0)}});
  if (!reply) return report(reply.error(), options.json);
  return showReload(options, *reply);
}

/// A disk that does not answer is given up by the daemon after 10 s.
constexpr std::chrono::seconds kReloadLimit{15};

void addReload(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto confirm = std::make_shared<bool>(false);
  line.add("reload", "Read the configuration again, and show what that changes",
           [=, &options] {
             if (*confirm) return confirmReload(options);
             const auto reply =
                 callOnce(options, {"io.hapticd.Control.Reload", Json::object(), true, kReloadLimit});
             return reply ? showReload(options, *reply) : report(reply.error(), options.json);
           })
      .add_flag("--confirm", *confirm,
                "Apply what the last one has held back, because it loosens a limit or takes a fixture away "
                "while the box is engaged");
}

std::string undoText(const Json& reply, bool preview) {
  return (preview ? "undo would make these changes:\n" : "undone by these changes:\n") +
         linesOf(listAt(reply, "changes"));
}

void addUndo(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto preview = std::make_shared<bool>(false);
  const auto loosen = std::make_shared<bool>(false);
  CLI::App& command = line.add(
      "undo", "Undo the last change of parameters, fixtures or regions, then the one before", [=, &options] {
        const Json parameters = {{"preview", *preview}, {"loosen", *loosen}};
        return callAndPrint(options, {"io.hapticd.Control.Undo", parameters, true},
                            [=](const Json& reply) { return undoText(reply, *preview); });
      });
  command.add_flag("--preview", *preview, "Only show what would change");
  command.add_flag("--loosen", *loosen,
                   "Undo it although the box is engaged and it loosens a limit or takes a fixture away");
}

}  // namespace

void addControlCommands(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto to_get = std::make_shared<std::vector<std::string>>();
  addParameterWords(line.add("get", "Show the values of parameters",
                             [=, &options] {
                               return showParameters(options, rowsNamed(options, *to_get), parameterLines);
                             }),
                    *to_get);

  const auto assignments = std::make_shared<std::vector<std::string>>();
  line.add("set", "Change live parameters: all that are named, or none if one is refused",
           [=, &options] { return runSet(options, *assignments); })
      .add_option("ASSIGNMENT", *assignments,
                  "New values, NAME=VALUE each; a unit may follow a number, as in 5mm or 0.8N/mm")
      ->required()
      ->type_name("PARAMETER=VALUE");

  const auto inside = std::make_shared<bool>(false);
  line.add("engage", "Request force on the handle", [=, &options] { return runEngage(options, *inside); })
      .add_flag("--inside", *inside, "Engage although the handle is in contact already");
  line.add("disengage", "Release the handle: end all force, and clear a fault", [&] {
    return callAndPrint(options, {"io.hapticd.Control.Disengage", Json::object(), true}, modeLine);
  });
  line.add("clear-fault", "Clear a fault; refused if there is none", [&] {
    return callAndPrint(options, {"io.hapticd.Control.ClearFault", Json::object(), true}, modeLine);
  });
  addUndo(line);
  addReload(line);
  const auto to_show = std::make_shared<std::vector<std::string>>();
  const auto table = [](const Json& rows) { return parameterTableText(rows, terminalSize().columns); };
  addParameterWords(
      line.add("params", "Show what parameters mean and allow, or search them for words",
               [=, &options] { return showParameters(options, rowsFound(options, *to_show), table); }),
      *to_show);
}

}  // namespace hapticd::tools
