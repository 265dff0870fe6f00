// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/settings.h"

namespace hapticd::tools {

/// The configuration of hapticd, as far as it can be read.
struct Configuration {
  config::Settings settings;  ///< the defaults if there is no file, or one that cannot be used
  std::string problem;        ///< why an existing file cannot be used; empty: nothing is wrong
};

/// Reads etc/hapticd/hapticd.yaml below the folder `root`.
Configuration readConfiguration(const std::filesystem::path& root);

}  // namespace hapticd::tools
