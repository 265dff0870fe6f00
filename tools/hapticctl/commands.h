#pragma once

#include <string>
#include <vector>

#include "tools/hapticctl/varlink_client.h"

namespace hapticd::tools {

/// What holds for every command.
struct CommandOptions {
  bool json = false;
  std::string socket;  ///< empty: the environment's, else the default ones
};

/// The default control socket, and the status socket where that one will not do.
/// `may_change`: the command changes something, for which only the control socket serves.
ClientResult<VarlinkClient> connectTo(const CommandOptions& options, bool may_change);

// Each prints its result on stdout or its error on stderr and returns the exit code.
int runStatus(const CommandOptions& options);
int runParameterTable(const CommandOptions& options);
/// `names` empty: all.
int runGet(const CommandOptions& options, const std::vector<std::string>& names);
/// `assignments`: "NAME=VALUE" each.
int runSet(const CommandOptions& options, const std::vector<std::string>& assignments);
int runEngage(const CommandOptions& options, bool inside_surface);
int runDisengage(const CommandOptions& options);

}  // namespace hapticd::tools
