// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/uevent.h"

#include <sstream>

namespace hapticd::tools {

std::string variableOf(const std::string& uevent, const std::string& name) {
  std::istringstream lines(uevent);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(name + "=")) return line.substr(name.size() + 1);
  }
  return {};
}

std::optional<config::HidId> hidIdIn(const std::string& uevent) {
  const std::string id = variableOf(uevent, "HID_ID");
  constexpr std::size_t kLength = 22;  // bus, vendor and product: 4, 8 and 8 digits
  if (id.size() != kLength) return std::nullopt;
  const auto parsed = config::hidIdFrom(id.substr(9, 4) + ":" + id.substr(18, 4));
  return parsed ? std::optional(*parsed) : std::nullopt;
}

}  // namespace hapticd::tools
