// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <expected>
#include <optional>
#include <string>
#include <vector>

#include "rt/base/vec3.h"
#include "tools/hapticctl/base/calls.h"

/// Points and strokes that a person touches with the handle. All functions prompt on stderr, read stdin, and
/// report their errors themselves; instead of a result they then return the exit code.
namespace hapticd::tools {

/// Who asks, and over which connection.
struct Toucher {
  VarlinkClient& client;
  const char* command;  ///< for messages: "register"
  bool json = false;    ///< how errors are reported
};

/// Asks the person to touch `what` and to hold still for a second, again until the hand was at rest. Returns
/// the position of the HIP in the world, or nothing where the person leaves it out, which `may_skip` allows.
std::expected<std::optional<rt::Vec3>, int> touch(const Toucher& toucher, const std::string& what,
                                                  bool may_skip);

/// Asks the person to stroke along a path. Records the position of the HIP in the world for `duration`, or
/// while a button of the handle is held if it is zero.
std::expected<std::vector<rt::Vec3>, int> stroke(const Toucher& toucher,
                                                 std::chrono::duration<double> duration);

}  // namespace hapticd::tools
