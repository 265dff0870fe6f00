// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/hapticctl/doctor/examination.h"

namespace hapticd::tools {

/// ok: as it should be, or irrelevant. warn: hapticd works, but with more latency, less safely or with fewer
/// features than it could, or the check could not find out. fail: in this state hapticd cannot work.
enum class Verdict { ok, warn, fail };

/// The result of a check.
struct Finding {
  Verdict verdict = Verdict::ok;
  std::string name;    ///< name of the check
  std::string fact;    ///< what was found
  std::string remedy;  ///< what to do about it: a command or a line for a file; empty: nothing
};

using Findings = std::vector<Finding>;

/// "ok", "warn" or "fail".
std::string_view verdictText(Verdict verdict);

/// The exit status for these findings: 0, or 1 if one fails.
int exitStatus(const Findings& findings);

/// The findings for people, a line each: "warn  clock: hpet (what to do)".
std::string textOf(const Findings& findings);

/// The findings for programs: an array of {name, verdict, fact, remedy}.
std::string jsonOf(const Findings& findings);

// Wording that several checks share.

/// What a running daemon reports of a device: "hapticd uses v4l2 D435: streaming", or a warning with what to
/// do; nothing if none responds. name: of the check.
Findings findingsOfInUse(const std::string& name, const DeviceInUse& device);

Finding good(std::string name, std::string fact);
Finding warning(std::string name, std::string fact, std::string remedy);
Finding failure(std::string name, std::string fact, std::string remedy);

/// The verdict on something that keeps the service from working: a failure, but only a warning on a machine
/// without the service.
Finding failureOfTheService(const Examination& box, std::string name, std::string fact, std::string remedy);

/// "PATH cannot be read: REASON".
Finding unreadable(std::string name, const std::string& path, Unread why);

/// The first entries of a list: "a, b, c and 4 more".
std::string someOf(const std::vector<std::string>& words, std::size_t most = 6);

/// The daemon's user, and the group of its devices.
inline constexpr const char* kDeviceGroup = "hapticd";
inline constexpr const char* kControlGroup = "haptic";
/// Of the devices that haptic-bridge drives.
inline constexpr const char* kVendorGroup = "hapticd-vendor";

/// Returns the problems with the permissions of a device file that the daemon must open; empty if they are
/// right: group hapticd, readable and writable by the group, not by everyone.
Findings accessFindings(const Examination& box, const std::string& name, const std::string& device,
                        const std::string& path);

}  // namespace hapticd::tools
