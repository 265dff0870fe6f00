// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "config/solids/solid_file.h"

namespace hapticd::daemon {

/// A solid that the store holds on the disk (daemon/state/solid_store.h).
struct StoredSolid {
  std::shared_ptr<const config::Solid> solid;
  std::size_t too_many = 0;                   ///< files that there are more than may be kept
  std::vector<std::string> replaceable = {};  ///< SHA-256 of those that may make room, the oldest first
};

}  // namespace hapticd::daemon
