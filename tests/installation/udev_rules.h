// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

namespace hapticd::test {

/// One `KEY=="value"` of a rule.
struct UdevToken {
  std::string key;  ///< "GROUP", "ATTR{idVendor}"
  std::string operation;
  std::string value;
};

struct UdevRules {
  std::vector<std::vector<UdevToken>> rules;
  std::vector<std::string> mistakes;  ///< lines that udev would not understand
};

/// Reads the subset of udev(7) that hapticd's rules use; anything else is a mistake.
UdevRules parseUdevRules(const std::string& text);

/// A device by the keys that rules match: "SUBSYSTEM", "ATTR{idVendor}". Of "KERNELS" there is one, of
/// "PROGRAM" the one command that succeeds, and of "TEST" the one file that exists.
using UdevDevice = std::map<std::string, std::string>;
/// What rules assign: "GROUP", "MODE", "ATTR{power/control}", and the last "RUN".
using UdevResult = std::map<std::string, std::string>;

UdevResult applyUdevRules(const UdevRules& rules, const UdevDevice& device);

}  // namespace hapticd::test
