// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/settings.h"

namespace hapticd::tools {

/// What hapticd is configured to do, as far as it can be read.
struct Configuration {
  config::Settings settings;  ///< the defaults where there is no file, or one that cannot be used
  std::string problem;        ///< why a file that is there cannot be used; empty: nothing is wrong
};

/// Reads etc/hapticd/hapticd.yaml below `root`.
Configuration readConfiguration(const std::filesystem::path& root);

}  // namespace hapticd::tools
