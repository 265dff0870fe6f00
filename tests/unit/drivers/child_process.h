// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/rerun.h"

namespace hapticd::test {

/// Returns true in a process started by runInChild().
inline bool isChild() {
  return !rerunPart().empty();
}

/// Runs the current test again in a process of its own with these "NAME=value" in its environment, for
/// libraries that are chosen at the start of a process, keep state in it, or end it. Returns the exit status.
inline int runInChild(const std::vector<std::string>& environment) {
  const Finished child = rerunThisTest("child", environment);
  if (child.ending != exitedWith(0)) ADD_FAILURE() << child.output << child.errors;
  return child.ending.code;
}

}  // namespace hapticd::test
