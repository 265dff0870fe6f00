// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/parameter_json.h"

#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "daemon/control/status_json.h"

namespace hapticd::daemon {
namespace {

/// The most problems that a reply lists: with more it would be too long, and they would hardly be of use.
constexpr std::size_t kMostProblems = 100;

const char* kindName(config::Kind kind) {
  switch (kind) {
    case config::Kind::boolean:
      return "boolean";
    case config::Kind::integer:
      return "integer";
    case config::Kind::number:
      return "number";
    case config::Kind::choice:
      return "choice";
    case config::Kind::text:
      return "text";
  }
  return "text";
}

OrderedJson toJson(const config::Value& value) {
  return std::visit([](const auto& held) { return OrderedJson(held); }, value);
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

OrderedJson problem(const std::string& name, const Json& value, const config::Error& error,
                    const config::Parameter* parameter) {
  return {{"parameter", name},
          {"value", OrderedJson(value)},
          {"reason", reasonOf(error)},
          {"allowed", parameter ? OrderedJson(parameter->range()) : OrderedJson()}};
}

/// The value for `parameter`, or the reason why it is refused.
config::Result<config::Value> checked(const config::Parameter& parameter, const Json& json) {
  const auto value = fromJson(json);
  if (!value)
    return std::unexpected(config::Error{"", "is neither a JSON boolean, nor a number, nor a string", ""});
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

  bool full() const { return problems_.size() >= kMostProblems; }

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
    for (const config::Error& error : config::checkTogether(settings_)) {
      problems_.push_back(problem(error.where, nullptr, error, nullptr));
    }
  }

  void addRestartProblems() {
    for (const std::string& name : restart_) {
      const config::Error error{"", "takes effect at the next start of the daemon only",
                                "set it in the configuration file"};
      problems_.push_back(problem(name, nullptr, error, nullptr));
    }
  }

  config::Settings settings_;
  OrderedJson problems_ = OrderedJson::array();
  std::vector<std::string> restart_;
};

}  // namespace

std::string reasonOf(const config::Error& error) {
  return error.remedy.empty() ? error.what : error.what + " (" + error.remedy + ")";
}

OrderedJson parameterJson(const config::Parameter& parameter, const config::Settings& settings) {
  const bool numeric = parameter.kind == config::Kind::integer || parameter.kind == config::Kind::number;
  OrderedJson choices;
  if (!parameter.choices.empty()) {
    choices = OrderedJson::array();
    for (const std::string_view choice : parameter.choices) choices.push_back(std::string(choice));
  }
  return {{"name", parameter.name},
          {"value", toJson(parameter.get(settings))},
          {"kind", kindName(parameter.kind)},
          {"unit", parameter.unit},
          {"minimum", numeric ? OrderedJson(parameter.minimum) : OrderedJson()},
          {"maximum", numeric ? OrderedJson(parameter.maximum) : OrderedJson()},
          {"choices", std::move(choices)},
          {"default", toJson(parameter.defaultValue())},
          {"effect", parameter.effect == config::Effect::live ? "live" : "restart"},
          {"symbol", parameter.symbol},
          {"help", parameter.help}};
}

std::expected<config::Settings, Reply> changedSettings(const config::Settings& settings,
                                                       const Json& changes) {
  Change change(settings);
  for (auto field = changes.begin(); field != changes.end() && !change.full(); ++field) {
    change.set(field.key(), field.value());
  }
  return change.finish();
}

}  // namespace hapticd::daemon
