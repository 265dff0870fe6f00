// SPDX-License-Identifier: Apache-2.0
#include "daemon/thread_faults.h"

#include <fmt/format.h>

#include <fstream>
#include <sstream>
#include <string>

namespace hapticd::daemon {

std::optional<std::uint64_t> pageFaultsOf(pid_t thread_id) {
  std::ifstream file(fmt::format("/proc/self/task/{}/stat", thread_id));
  std::string line;
  if (!std::getline(file, line)) return std::nullopt;
  // The second field, the thread's name, is in parentheses and may contain any character.
  std::istringstream fields(line.substr(line.rfind(')') + 1));
  std::string skipped;
  for (int field = 3; field < 10; ++field) fields >> skipped;
  std::uint64_t minor = 0;
  std::uint64_t minor_of_children = 0;
  std::uint64_t major = 0;
  if (!(fields >> minor >> minor_of_children >> major)) return std::nullopt;
  return minor + major;
}

}  // namespace hapticd::daemon
