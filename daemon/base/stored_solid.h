// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/solids/solid_file.h"

namespace hapticd::daemon {

/// A solid that the store holds on the disk (daemon/state/solid_store.h).
struct StoredSolid {
  std::shared_ptr<const config::Solid> solid;
  std::vector<std::string> removed = {};  ///< SHA-256 of those that made room for it
};

}  // namespace hapticd::daemon
