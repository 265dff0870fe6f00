// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/random_changes.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "config/parameter_table.h"

namespace hapticd::tools {
namespace {

using config::Parameter;

std::size_t below(std::mt19937_64& random, std::size_t end) {
  return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
}

std::vector<const Parameter*> liveParameters() {
  std::vector<const Parameter*> live;
  for (const Parameter& parameter : config::parameterTable()) {
    if (parameter.effect == config::Effect::live) live.push_back(&parameter);
  }
  return live;
}

Json allowedValue(const Parameter& parameter, std::mt19937_64& random) {
  switch (parameter.kind) {
    case config::Kind::boolean:
      return below(random, 2) == 0;
    case config::Kind::integer:
      return std::uniform_int_distribution<std::int64_t>(
          static_cast<std::int64_t>(parameter.minimum), static_cast<std::int64_t>(parameter.maximum))(random);
    case config::Kind::number:
      return std::uniform_real_distribution<double>(parameter.minimum, parameter.maximum)(random);
    case config::Kind::choice:
      return std::string(parameter.choices[below(random, parameter.choices.size())]);
    case config::Kind::text:
      break;
  }
  return "";
}

Json forbiddenValue(const Parameter& parameter, std::mt19937_64& random) {
  const bool is_number = parameter.kind == config::Kind::integer || parameter.kind == config::Kind::number;
  const bool out_of_range = is_number && below(random, 2) == 0;
  if (!out_of_range) return Json::array({"not a value"});
  const double beyond = 1 + std::uniform_real_distribution<double>(0, 1e6)(random);
  return below(random, 2) == 0 ? parameter.maximum + beyond : parameter.minimum - beyond;
}

}  // namespace

RandomChange randomChange(std::mt19937_64& random) {
  static const std::vector<const Parameter*> live = liveParameters();
  RandomChange change;
  for (std::size_t left = 1 + below(random, 3); left > 0; --left) {
    const Parameter& parameter = *live[below(random, live.size())];
    change.parameters[std::string(parameter.name)] = allowedValue(parameter, random);
  }
  if (below(random, 4) != 0) return change;
  change.allowed = false;
  if (below(random, 4) == 0) {
    change.parameters["force.no_such_parameter"] = 1;
  } else {
    const Parameter& parameter = *live[below(random, live.size())];
    change.parameters[std::string(parameter.name)] = forbiddenValue(parameter, random);
  }
  return change;
}

std::string randomGarbage(std::mt19937_64& random) {
  static constexpr std::array<std::string_view, 6> kWrongCalls{
      R"({"method":"io.hapticd.Status.GetStatus","parameters":)",
      R"({"method":"io.hapticd.Control.SetParameters","parameters":{"parameters":[]}})",
      R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":0},"more":true})",
      R"({"method":"no.such.Method"})",
      R"([[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]])",
      R"({"method":42})"};
  std::string bytes;
  if (below(random, 2) == 0) {
    bytes = kWrongCalls[below(random, kWrongCalls.size())];
  } else {
    bytes.resize(1 + below(random, 5000));
    for (char& byte : bytes) byte = static_cast<char>(random());
  }
  if (below(random, 3) != 0) bytes.push_back('\0');
  return bytes;
}

}  // namespace hapticd::tools
