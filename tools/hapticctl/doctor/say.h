// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticctl/doctor/examination.h"
#include "tools/hapticctl/doctor/finding.h"

namespace hapticd::tools {

// How checks say what they found.

Finding good(std::string name, std::string fact);
Finding doubtful(std::string name, std::string fact, std::string remedy);
Finding bad(std::string name, std::string fact, std::string remedy);

/// What keeps the service from working matters less where there is no service: then it is a doubt only.
Finding badForTheService(const Examination& box, std::string name, std::string fact, std::string remedy);

/// A file that could not be read, and why.
Finding unreadable(std::string name, const std::string& path, Unread why);

/// "3 CPUs", "1 CPU".
std::string counted(std::size_t count, const std::string& noun);

/// The first few of a list: "a, b, c and 4 more".
std::string someOf(const std::vector<std::string>& words, std::size_t most = 6);

/// The daemon's user and the group of its devices.
inline constexpr const char* kDeviceGroup = "hapticd";
inline constexpr const char* kSteeringGroup = "haptic";

/// What may be said of the file of a device that the daemon has to open, and nothing when its mode is right:
/// group hapticd, readable and writable by it, not by everyone.
Findings accessFindings(const Examination& box, const std::string& name, const std::string& device,
                        const std::string& path);

}  // namespace hapticd::tools
