// SPDX-License-Identifier: Apache-2.0
#include "daemon/reload.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "config/addition_fields.h"
#include "config/parameter_table.h"

namespace hapticd::daemon {
namespace {

using config::Origin;

template <typename T>
bool isOfConfiguration(const T& item) {
  return item.origin.value == Origin::configuration;
}

template <typename T>
auto named(const std::vector<T>& items, const std::string& name) {
  return std::ranges::find(items, name, &T::name);
}

/// The list after a reload. What stays keeps its place, because the last of several regions at a place
/// counts; the configuration's own follow each other as in the file.
template <typename T>
std::vector<T> merged(const std::vector<T>& running, const std::vector<T>& loaded,
                      std::vector<std::string>& hidden) {
  std::vector<T> own;  // of the configuration, in the order of the file
  for (const T& item : loaded) {
    const auto now = named(running, item.name);
    const bool absent = now == running.end();
    if (absent ? isOfConfiguration(item) : isOfConfiguration(*now)) {
      own.push_back(item);
    } else if (!absent && isOfConfiguration(item) && *now != item) {
      hidden.push_back(std::string(nounOf(item)) + " " + item.name);
    }
  }
  const auto isPlace = [&](const T& item) {
    return isOfConfiguration(item) && named(own, item.name) != own.end();
  };
  auto places = std::ranges::count_if(running, isPlace);
  std::vector<T> result;
  auto next = own.begin();
  const auto takeAll = [&] { result.insert(result.end(), std::exchange(next, own.end()), own.end()); };
  if (places == 0) takeAll();
  for (const T& item : running) {
    if (!isOfConfiguration(item)) {
      result.push_back(item);
    } else if (isPlace(item)) {
      --places == 0 ? takeAll() : result.push_back(*next++);
    }
  }
  return result;
}

void mergeAdditions(config::SceneAdditions& running, const config::SceneAdditions& loaded,
                    std::vector<std::string>& hidden) {
  running.fixtures = merged(running.fixtures, loaded.fixtures, hidden);
  running.regions = merged(running.regions, loaded.regions, hidden);
  const bool own = running.label_image_origin.value == Origin::configuration || running.label_image.empty();
  if (own) {
    running.label_image = loaded.label_image;
    running.label_image_origin = loaded.label_image_origin;
  } else if (!loaded.label_image.empty() && loaded.label_image != running.label_image) {
    hidden.emplace_back("label_image");
  }
}

}  // namespace

std::expected<Reload, std::vector<config::Error>> reloaded(const config::Settings& running,
                                                           const config::Settings& loaded) {
  Reload reload{running, {}, {}};
  for (const config::Parameter& parameter : config::allParameters()) {
    const config::Value new_value = parameter.get(loaded);
    if (parameter.get(running) == new_value) continue;
    if (parameter.effect == config::Effect::restart) {
      reload.waiting.push_back(parameter.name);
    } else {
      parameter.set(reload.settings, new_value);
    }
  }
  mergeAdditions(reload.settings.additions, loaded.additions, reload.hidden);
  std::vector<config::Error> errors = config::checkTogether(reload.settings);
  for (const config::AdditionError& error : config::checkTogether(reload.settings.additions))
    errors.push_back(error.error);
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return reload;
}

}  // namespace hapticd::daemon
