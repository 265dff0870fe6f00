// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "tools/hapticbench/pareto/contender.h"

namespace hapticd::tools {

/// The paper's law on PCL's OrganizedNeighbor; nothing where PCL was not there to be built with.
std::unique_ptr<Contender> organizedNeighbor(const rt::DepthModelParameters& camera);

}  // namespace hapticd::tools
