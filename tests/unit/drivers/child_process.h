// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hapticd::test {

/// Returns true in a process started by runInChild().
bool isChild();

/// Runs the current test again in a process of its own with these "NAME=value" added to its environment, for
/// libraries that are chosen at the start of a process, keep state in it, or end it. Returns the exit status,
/// or -1 if the child was killed, which happens after 120 s.
int runInChild(const std::vector<std::string>& environment);

/// Returns the folder of libfreenect's player `fakenect`, next to libfreenect itself.
std::string fakenectFolder();

}  // namespace hapticd::test
