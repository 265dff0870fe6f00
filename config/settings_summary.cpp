// SPDX-License-Identifier: Apache-2.0
#include "config/settings_summary.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <span>

#include "config/base/counted.h"
#include "config/base/value_text.h"
#include "config/settings/driver_rows.h"

namespace hapticd::config {
namespace {

// More do not fit into a readable line.
constexpr std::size_t kMaxShown = 16;

std::string shown(const Parameter& parameter, const Value& value) {
  return parameter.kind == Kind::text ? base::inQuotes(std::get<std::string>(value)) : toText(value);
}

}  // namespace

std::string SettingsSummary::differencesText() const {
  const std::span first(differences.data(), std::min(differences.size(), kMaxShown));
  std::string text = fmt::format("{}", fmt::join(first, ", "));
  if (first.size() < differences.size()) {
    text += fmt::format(", and {} more", differences.size() - first.size());
  }
  return text;
}

std::string SettingsSummary::text() const {
  std::string count = base::counted(set, "parameter(s) set");
  if (fixtures > 0) count += ", " + base::counted(fixtures, "fixture(s)");
  if (regions > 0) count += ", " + base::counted(regions, "tissue region(s)");
  if (differences.empty()) return count + ", none differs from the defaults";
  return fmt::format("{}, {} {} from the defaults: {}", count, differences.size(),
                     differences.size() == 1 ? "differs" : "differ", differencesText());
}

SettingsSummary summaryOf(const Configuration& configuration) {
  const SceneAdditions& additions = configuration.settings.additions;
  SettingsSummary summary{
      configuration.parameters_set, additions.fixtures.size(), additions.regions.size(), {}};
  for (const Parameter& parameter : allParameters()) {
    const Value value = parameter.get(configuration.settings);
    const Value usual = parameter.defaultValue();
    if (value == usual) continue;
    summary.differences.push_back(fmt::format("{} = {} (default {})", parameter.name, shown(parameter, value),
                                              shown(parameter, usual)));
  }
  return summary;
}

std::vector<base::Error> warningsOf(const Settings& settings) {
  std::vector<base::Error> warnings;
  if (auto warning = driverOf(settings.handle).warning(settings.handle))
    warnings.push_back(std::move(*warning));
  return warnings;
}

}  // namespace hapticd::config
