// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/methods/methods.h"

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "config/additions/addition_json.h"
#include "config/settings/parameter_table.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/base/status_json.h"
#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {
namespace {

using Unawaited = PendingAnswers::Unawaited;

/// The most problems that a reply lists: with more it would be too long, and they would hardly be of use.
constexpr std::size_t kMaxProblems = 100;

OrderedJson toJson(const config::Value& value) {
  if (const double* const number = std::get_if<double>(&value)) return *number;
  return config::jsonOf<OrderedJson>(value);
}

/// A JSON value as a parameter's value; nothing for null, objects and arrays.
std::optional<config::Value> fromJson(const Json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_string()) return json.get<std::string>();
  if (json.is_number_float()) return json.get<double>();
  if (json.is_number_unsigned() &&
      json.get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
    return json.get<double>();  // out of every range, and refused for that
  }
  if (json.is_number_integer()) return json.get<std::int64_t>();
  return std::nullopt;
}

/// The text of an error without the name of its parameter, which has a field of its own.
std::string reasonOf(const base::Error& error) {
  return error.remedy.empty() ? error.what : error.what + " (" + error.remedy + ")";
}

OrderedJson problem(const std::string& name, const Json& value, const base::Error& error,
                    const config::Parameter* parameter) {
  return {{"parameter", name},
          {"value", OrderedJson(value)},
          {"reason", reasonOf(error)},
          {"allowed", parameter ? OrderedJson(parameter->range()) : OrderedJson()}};
}

/// The value for `parameter`, or the reason why it is refused.
base::Result<config::Value> checked(const config::Parameter& parameter, const Json& json) {
  const auto value = fromJson(json);
  if (!value)
    return std::unexpected(base::Error{"", "is neither a JSON boolean, nor a number, nor a string", ""});
  return parameter.check(*value);
}

/// One call of SetParameters while it is checked.
class Change {
 public:
  explicit Change(const config::Settings& settings) : settings_(settings) {}

  void set(const std::string& name, const Json& json) {
    const config::Parameter* parameter = config::findParameter(name);
    if (!parameter) {
      problems_.push_back(problem(name, json, config::unknownParameter(name), nullptr));
      return;
    }
    auto value = checked(*parameter, json);
    if (!value) {
      problems_.push_back(problem(name, json, value.error(), parameter));
    } else if (parameter->effect == config::Effect::restart) {
      restart_.push_back(name);
    } else {
      parameter->set(settings_, *value);
    }
  }

  bool full() const { return problems_.size() >= kMaxProblems; }

  std::expected<config::Settings, Reply> finish() {
    if (problems_.empty()) checkTogether();
    if (!problems_.empty()) {
      addRestartProblems();
      return std::unexpected(Reply{"io.hapticd.Control.InvalidValue", {{"problems", std::move(problems_)}}});
    }
    if (!restart_.empty()) {
      return std::unexpected(Reply{"io.hapticd.Control.RestartRequired", {{"parameters", restart_}}});
    }
    return settings_;
  }

 private:
  void checkTogether() {
    for (const base::Error& error : config::checkTogether(settings_)) {
      problems_.push_back(problem(error.where, nullptr, error, nullptr));
    }
  }

  void addRestartProblems() {
    for (const std::string& name : restart_) {
      const base::Error error{"", "takes effect at the next start of the daemon only",
                              "set it in the configuration file"};
      problems_.push_back(problem(name, nullptr, error, nullptr));
    }
  }

  config::Settings settings_;
  OrderedJson problems_ = OrderedJson::array();
  std::vector<std::string> restart_;
};

/// A parameter as the type `Parameter` of io.hapticd.Status, with its value in `settings`.
OrderedJson parameterJson(const config::Parameter& parameter, const config::Settings& settings) {
  const bool numeric = parameter.kind == config::Kind::integer || parameter.kind == config::Kind::number;
  OrderedJson choices;
  if (!parameter.choices.empty()) {
    choices = OrderedJson::array();
    for (const std::string_view choice : parameter.choices) choices.push_back(std::string(choice));
  }
  return {{"name", parameter.name},
          {"value", toJson(parameter.get(settings))},
          {"kind", rt::wordOf(parameter.kind)},
          {"unit", parameter.unit},
          {"minimum", numeric ? OrderedJson(parameter.minimum) : OrderedJson()},
          {"maximum", numeric ? OrderedJson(parameter.maximum) : OrderedJson()},
          {"choices", std::move(choices)},
          {"default", toJson(parameter.defaultValue())},
          {"effect", parameter.effect == config::Effect::live ? "live" : "restart"},
          {"symbol", parameter.symbol},
          {"help", parameter.help}};
}

/// The parameters that a call set, as the type `Change` of io.hapticd.Control. `names`: an object with their
/// names, all of which exist.
OrderedJson changesJson(const Json& names, const config::Settings& before, const config::Settings& after) {
  OrderedJson changes = OrderedJson::array();
  for (auto field = names.begin(); field != names.end(); ++field) {
    const config::Parameter& parameter = *config::findParameter(field.key());
    changes.push_back({{"name", parameter.name},
                       {"before", toJson(parameter.get(before))},
                       {"after", toJson(parameter.get(after))},
                       {"unit", parameter.unit}});
  }
  return changes;
}

/// Returns `settings` with `changes` (an object of names and values of live parameters) applied.
/// Errors: a reply io.hapticd.Control.InvalidValue with all problems, or RestartRequired if the only problem
/// is that parameters are not live.
std::expected<config::Settings, Reply> changedSettings(const config::Settings& settings,
                                                       const Json& changes) {
  Change change(settings);
  for (auto field = changes.begin(); field != changes.end() && !change.full(); ++field) {
    change.set(field.key(), field.value());
  }
  return change.finish();
}

}  // namespace

std::vector<Method> ParameterMethods::methods() {
  using Self = ParameterMethods;
  return {methodOf(this, "io.hapticd.Status.GetParameters", &Self::getParameters, {{"names"}}),
          methodOf(this, "io.hapticd.Control.SetParameters", &Self::setParameters,
                   {{"parameters", isObject, MethodParameter::required}}),
          methodOf(this, "io.hapticd.Control.Engage", &Self::engage, {{"insideSurface", isFlag}}),
          methodOf(this, "io.hapticd.Control.Disengage", &Self::disengage),
          methodOf(this, "io.hapticd.Control.ClearFault", &Self::clearFault)};
}

Answer ParameterMethods::getParameters(const Call& call, const Caller&) {
  // More names than there are parameters must be repetitions, which would make the reply arbitrarily long.
  const auto names = textsField(call, "names", config::parameterTable().size());
  if (!names) return names.error();
  OrderedJson rows = OrderedJson::array();
  if (!*names) {
    for (const config::Parameter& row : config::parameterTable())
      rows.push_back(parameterJson(row, context_.box.settings()));
    return Reply{"", {{"parameters", std::move(rows)}}};
  }
  OrderedJson problems = OrderedJson::array();
  for (const std::string& name : **names) {
    if (const config::Parameter* row = config::findParameter(name)) {
      rows.push_back(parameterJson(*row, context_.box.settings()));
    } else {
      problems.push_back({{"parameter", name}, {"reason", reasonOf(config::unknownParameter(name))}});
    }
  }
  if (problems.empty()) return Reply{"", {{"parameters", std::move(rows)}}};
  return Reply{"io.hapticd.Status.UnknownParameter", {{"problems", std::move(problems)}}};
}

Answer ParameterMethods::setParameters(const Call& call, const Caller& caller) {
  const Json& changes = *field(call, "parameters");
  const auto settings = changedSettings(context_.box.settings(), changes);
  if (!settings) return settings.error();
  logParameters(context_, caller, "", context_.box.settings(), *settings);
  context_.history.record(context_.box.settings(), *settings);
  OrderedJson done = changesJson(changes, context_.box.settings(), *settings);
  const std::uint64_t generation = context_.box.apply(*settings);
  return Later{Unawaited::forget,
               whenApplied(context_, generation, [generation, done = std::move(done)]() mutable {
                 return Reply{"", {{"generation", generation}, {"changes", std::move(done)}}};
               })};
}

Answer ParameterMethods::engage(const Call& call, const Caller& caller) {
  const bool anywhere = optionalFlag(call, "insideSurface").value_or(false);
  const auto& fixtures = context_.box.additions().fixtures;
  if (std::string problem = context_.box.solidProblem(fixtures); !problem.empty())
    return failed(kFixtureMissing, std::move(problem));
  const rt::Mode before = context_.box.status().loop.state.tick.mode;
  const bool already = before == rt::Mode::engaged || before == rt::Mode::holding;
  logChange(context_, caller, anywhere ? "engages, inside a surface too" : "engages",
            config::EventKind::engage, {});
  return Later{Unawaited::forget, whenApplied(context_, context_.box.engage(true, anywhere), [this, already] {
                 Reply reply = modeReply(true);
                 if (reply.error.empty()) reply.parameters["already"] = already;
                 return reply;
               })};
}

Answer ParameterMethods::disengage(const Call&, const Caller& caller) {
  logChange(context_, caller, "disengages", config::EventKind::disengage, {});
  return disengaged();
}

Answer ParameterMethods::clearFault(const Call&, const Caller& caller) {
  const rt::Tick tick = context_.box.status().loop.state.tick;
  if (tick.mode != rt::Mode::faulted) {
    return Reply{"io.hapticd.Control.NotFaulted"};
  }
  logChange(context_, caller, std::string("clears the fault ") + nameOf(tick.cause),
            config::EventKind::clear_fault, {{"CAUSE", nameOf(tick.cause)}});
  return disengaged();
}

Answer ParameterMethods::disengaged() {
  return Later{Unawaited::forget,
               whenApplied(context_, context_.box.engage(false, false), [this] { return modeReply(false); })};
}

Reply ParameterMethods::modeReply(bool engaged) {
  const rt::Tick tick = context_.box.status().loop.state.tick;
  if (engaged && tick.mode == rt::Mode::idle) {
    return {"io.hapticd.Control.Refused", {{"cause", nameOf(tick.cause)}}};
  }
  return {"", {{"mode", nameOf(tick.mode)}, {"cause", nameOf(tick.cause)}}};
}

}  // namespace hapticd::daemon
