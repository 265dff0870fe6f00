// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "rt/realtime_safe.h"

// Wrong on purpose and part of no program: what clang must refuse to compile.
void growsInTheForceThread(std::vector<int>& numbers) HAPTICD_RT {
  numbers.push_back(1);
}
