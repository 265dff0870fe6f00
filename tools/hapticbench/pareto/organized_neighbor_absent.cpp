// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/organized_neighbor.h"

namespace hapticd::tools {

std::unique_ptr<Contender> organizedNeighbor(const rt::DepthModelParameters&) {
  return nullptr;
}

}  // namespace hapticd::tools
