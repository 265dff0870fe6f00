// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base/change_history.h"

#include <fmt/format.h>

#include <algorithm>

#include "config/settings/parameter_table.h"
#include "daemon/control/base/addition_change.h"

namespace hapticd::daemon {
namespace {

/// Without what estimators measure.
std::vector<config::RegionSettings> withoutStiffness(std::vector<config::RegionSettings> regions) {
  for (config::RegionSettings& region : regions) {
    region.stiffness_n_per_m = 0;
    region.damping_n_s_per_m = 0;
  }
  return regions;
}

/// The regions of `before`; those that the change to `after` has not touched as they are now, with what
/// estimators have measured since.
std::vector<config::RegionSettings> regionsBefore(const config::SceneAdditions& before,
                                                  const config::SceneAdditions& after,
                                                  const config::SceneAdditions& now) {
  const auto named = [](const config::SceneAdditions& additions, const std::string& name) {
    const auto found = std::ranges::find(additions.regions, name, &config::RegionSettings::name);
    return found == additions.regions.end() ? nullptr : &*found;
  };
  std::vector<config::RegionSettings> regions = before.regions;
  for (config::RegionSettings& region : regions) {
    const config::RegionSettings* const changed = named(after, region.name);
    const config::RegionSettings* const current = named(now, region.name);
    if (changed && current && *changed == region) region = *current;
  }
  return regions;
}

bool areAlike(const config::Settings& some, const config::Settings& others) {
  return parameterDifferences(some, others).empty() && some.additions.frames == others.additions.frames &&
         some.additions.fixtures == others.additions.fixtures &&
         withoutStiffness(some.additions.regions) == withoutStiffness(others.additions.regions) &&
         some.additions.label_image == others.additions.label_image;
}

}  // namespace

std::string ParameterDifference::text() const {
  return fmt::format("sets {} from {} to {}", name, old_value, new_value);
}

JournalFields ParameterDifference::fields() const {
  return {{"PARAMETER", name}, {"OLD", old_value}, {"NEW", new_value}};
}

std::vector<ParameterDifference> parameterDifferences(const config::Settings& before,
                                                      const config::Settings& after) {
  std::vector<ParameterDifference> differences;
  for (const config::Parameter& parameter : config::allParameters()) {
    if (parameter.effect != config::Effect::live) continue;
    const config::Value old_value = parameter.get(before);
    const config::Value new_value = parameter.get(after);
    if (old_value == new_value) continue;
    differences.push_back(
        {std::string(parameter.name), config::toText(old_value), config::toText(new_value)});
  }
  return differences;
}

std::vector<std::string> textsOfDifferences(const config::Settings& before, const config::Settings& after) {
  std::vector<std::string> texts;
  for (const ParameterDifference& difference : parameterDifferences(before, after))
    texts.push_back(difference.text());
  for (const AdditionDifference& difference : differencesOf(before.additions, after.additions))
    texts.push_back(difference.text());
  return texts;
}

void ChangeHistory::record(const config::Settings& before, const config::Settings& after) {
  if (parameterDifferences(before, after).empty() && before.additions == after.additions) return;
  if (isOutdated(before)) changes_.clear();
  if (changes_.size() == kMaxChanges) changes_.pop_front();
  changes_.push_back({before, after});
}

bool ChangeHistory::isOutdated(const config::Settings& now) const {
  return !changes_.empty() && !areAlike(changes_.back().after, now);
}

std::optional<config::Settings> ChangeHistory::undone(const config::Settings& now) const {
  if (changes_.empty() || isOutdated(now)) return std::nullopt;
  const auto& [before, after] = changes_.back();
  config::Settings settings = now;
  for (const config::Parameter& parameter : config::allParameters()) {
    if (parameter.effect == config::Effect::live) parameter.set(settings, parameter.get(before));
  }
  settings.additions.frames = before.additions.frames;
  settings.additions.fixtures = before.additions.fixtures;
  settings.additions.regions = regionsBefore(before.additions, after.additions, now.additions);
  settings.additions.label_image = before.additions.label_image;
  settings.additions.label_image_origin = before.additions.label_image_origin;
  return settings;
}

}  // namespace hapticd::daemon
