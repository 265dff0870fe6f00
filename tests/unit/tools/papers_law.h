// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/settings.h"

namespace hapticd::tools {

/// Defaults, but for the law whose force is known: by brute force over all points.
inline config::Settings papersLaw() {
  config::Settings settings;
  settings.force.law = rt::ForceLaw::nearest_springs;
  return settings;
}

}  // namespace hapticd::tools
