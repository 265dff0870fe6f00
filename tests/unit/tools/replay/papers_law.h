// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/settings/settings.h"

namespace hapticd::tools {

/// Returns the default settings with the paper's law, whose force brute force over all points verifies.
inline config::Settings papersLaw() {
  config::Settings settings;
  settings.live.force.law = rt::ForceLaw::nearest_springs;
  return settings;
}

}  // namespace hapticd::tools
