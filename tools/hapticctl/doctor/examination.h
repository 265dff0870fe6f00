// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/hapticctl/doctor/configuration.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

inline constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

/// The user who asks.
struct Caller {
  std::string name;  ///< or the number, where it has no name
  uid_t user = 0;
  std::vector<gid_t> groups;        ///< all it is in
  std::uint64_t rtprio = 0;         ///< highest real-time priority it may take
  std::uint64_t memlock_bytes = 0;  ///< most memory it may lock
};

/// What `systemctl show` says about hapticd.service: property and value.
using UnitProperties = std::map<std::string, std::string>;

/// What is to be told of a running daemon.
struct DaemonView {
  bool answers = false;
  std::string problem;     ///< why it does not answer
  std::optional<int> cpu;  ///< that its force thread is pinned to
  bool memory_locked = false;
  std::vector<std::string> complaints;  ///< what it says is wrong
};

/// All that the checks look at.
struct Examination {
  Machine machine;
  Caller caller;
  std::optional<UnitProperties> unit;  ///< nothing: the service manager cannot be asked
  DaemonView daemon;
  Configuration configuration = {};
};

/// The process's own user.
Caller thisCaller();

/// Takes the output of `systemctl show` apart, "Name=value" a line.
UnitProperties parseProperties(const std::string& shown);

/// Asks the service manager, for at most 5 seconds; nothing if there is none or it does not answer.
std::optional<UnitProperties> askServiceManager();

/// Whether the service manager knows hapticd.service.
bool isInstalled(const std::optional<UnitProperties>& unit);

}  // namespace hapticd::tools
