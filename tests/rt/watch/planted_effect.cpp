// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "rt/base/realtime_safe.h"

// Deliberately wrong and part of no program: clang must refuse to compile this.
void growsInTheForceThread(std::vector<int>& numbers) HAPTICD_RT {
  numbers.push_back(1);
}
