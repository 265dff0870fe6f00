// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/configuration.h"

#include "config/yaml_loader.h"

namespace hapticd::tools {

Configuration readConfiguration(const std::filesystem::path& root) {
  const std::filesystem::path file = root / "etc/hapticd/hapticd.yaml";
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return {};
  auto settings = config::loadSettings(file);
  if (!settings) return {{}, settings.error().front().text()};
  return {std::move(*settings), {}};
}

}  // namespace hapticd::tools
