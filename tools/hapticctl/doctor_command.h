#pragma once

#include <string>

#include "tools/hapticctl/commands.h"

namespace hapticd::tools {

struct DoctorOptions {
  /// Folder that stands for "/"; with another the service manager is not asked, and the daemon only where the
  /// socket is named.
  std::string root = "/";
};

/// Prints what is right and wrong with this machine; returns 0, or 1 when something fails.
int runDoctor(const CommandOptions& options, const DoctorOptions& doctor);

}  // namespace hapticd::tools
