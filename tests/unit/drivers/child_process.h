// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hapticd::test {

/// True in the process that runInChild() has started.
bool isChild();

/// Runs the current test once more in a process of its own, with these "NAME=value" added to its environment.
/// For libraries that are chosen at the start of a process, keep state in it, or end it. Returns the exit
/// status, or -1 when the child was killed; it is after 120 s.
int runInChild(const std::vector<std::string>& environment);

/// The folder of libfreenect's player `fakenect`, next to libfreenect itself.
std::string fakenectFolder();

}  // namespace hapticd::test
