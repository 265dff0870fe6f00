// SPDX-License-Identifier: Apache-2.0
#include "daemon/reload.h"

#include "config/parameter_table.h"

namespace hapticd::daemon {

std::expected<Reload, std::vector<config::Error>> reloaded(const config::Settings& running,
                                                           const config::Settings& loaded) {
  Reload reload{running, {}, {}};
  for (const config::Parameter& parameter : config::parameterTable()) {
    const config::Value old_value = parameter.get(running);
    const config::Value new_value = parameter.get(loaded);
    if (old_value == new_value) continue;
    if (parameter.effect == config::Effect::restart) {
      reload.waiting.push_back(parameter.name);
      continue;
    }
    parameter.set(reload.settings, new_value);
    reload.changes.push_back({parameter.name, config::toText(old_value), config::toText(new_value)});
  }
  reload.settings.additions = loaded.additions;
  if (auto errors = config::checkTogether(reload.settings); !errors.empty())
    return std::unexpected(std::move(errors));
  return reload;
}

}  // namespace hapticd::daemon
