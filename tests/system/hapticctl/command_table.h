// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {

using Command = std::vector<std::string>;

enum class Does { read, change };

/// A command that calls the daemon.
struct Call {
  Command command;
  Does does = Does::change;
};

/// In an order in which all of them work. PAIRS stands for a file with point pairs, SCENE for one with a
/// fixture and a region, TOUCHED for one with points of a plane, TRACE for the trace that was begun last.
extern const std::vector<Call> kCalls;

/// The words, with blanks between them.
std::string textOf(const Command& command);

/// Writes the files that PAIRS, SCENE and TOUCHED stand for.
void writeCommandFiles(const DaemonHome& home);

/// The command with what its words stand for.
Command completedCommand(const DaemonHome& home, Command command);

}  // namespace hapticd::test
