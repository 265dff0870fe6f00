// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/settings/settings.h"
#include "tools/hapticctl/doctor/examination.h"

namespace hapticd::tools {

/// ok: as it should be, or irrelevant. warn: hapticd works, but with more latency, less safely or with fewer
/// features than it could, or the check could not find out. fail: in this state hapticd cannot work.
enum class Verdict { ok, warn, fail };

/// The result of a check.
struct Finding {
  Verdict verdict = Verdict::ok;
  std::string name;    ///< empty: that of the check
  std::string fact;    ///< what was found
  std::string remedy;  ///< what to do about it: a command or a line for a file; empty: nothing
};

/// The results of a check.
class Findings : public std::vector<Finding> {
 public:
  using vector::vector;
  Findings() = default;
  Findings(Finding finding) { push_back(std::move(finding)); }
  /// "PATH cannot be read: REASON".
  Findings(const Unread& unread);

  void add(const Findings& more) { insert(end(), more.begin(), more.end()); }
  /// These, or where there is none the other one.
  Findings orElse(Finding other) const { return empty() ? Findings(std::move(other)) : *this; }
};

/// The findings, those without a name with this one.
Findings named(const std::string& name, Findings findings);

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
/// do; nothing if none responds.
Findings findingsOfInUse(const DeviceInUse& device);

Finding good(std::string fact);
Finding warning(std::string fact, std::string remedy);
Finding failure(std::string fact, std::string remedy);

/// The verdict on something that keeps the service from working: a failure, but only a warning on a machine
/// without the service.
Finding failureOfTheService(const Examination& box, std::string fact, std::string remedy);

/// The first entries of a list: "a, b, c and 4 more".
std::string someOf(const std::vector<std::string>& words, std::size_t most = 6);

/// The daemon's user, and the group of its devices.
inline constexpr const char* kDeviceGroup = "hapticd";
inline constexpr const char* kControlGroup = "haptic";
/// Of the devices that haptic-bridge drives.
inline constexpr const char* kVendorGroup = "hapticd-vendor";

/// Returns the problems with the permissions of a device file that the daemon must open; empty if they are
/// right: group hapticd, readable and writable by the group, not by everyone.
Findings accessFindings(const Examination& box, const std::string& device, const std::string& path);

// Each check examines one thing and returns at least one finding, whatever it can or cannot read.

Findings checkKernel(const Examination& box);
Findings checkClock(const Examination& box);
Findings checkThrottling(const Examination& box);
Findings checkIsolation(const Examination& box);
Findings checkCpuKind(const Examination& box);
Findings checkInterrupts(const Examination& box);
Findings checkSibling(const Examination& box);
Findings checkGovernor(const Examination& box);
Findings checkIdleStates(const Examination& box);
Findings checkCpuQuota(const Examination& box);
Findings checkMemory(const Examination& box);
Findings checkLimits(const Examination& box);
Findings checkAccounts(const Examination& box);
Findings checkCaller(const Examination& box);
Findings checkConfiguration(const Examination& box);
Findings checkUdevRules(const Examination& box);
Findings checkOtherRules(const Examination& box);
Findings checkKinect(const Examination& box);
Findings checkCameras(const Examination& box);
Findings checkHid(const Examination& box);
Findings checkGpio(const Examination& box);
Findings checkHandle(const Examination& box);
Findings checkVendorHandles(const Examination& box);
Findings checkTraces(const Examination& box);
Findings checkStorage(const Examination& box);
Findings checkGnuplot(const Examination& box);
Findings checkService(const Examination& box);
Findings checkDaemon(const Examination& box);

/// The findings of all checks, in the order in which they are shown.
Findings examine(const Examination& box);

/// The memory that hapticd takes, and locks where that is permitted, by what it depends on; in bytes. Sizes
/// of structures and buffers times what the configuration says, and for what lies between them figures that
/// were measured on the running daemon; daemon_memory_test compares the sum with the daemon for several
/// configurations.
struct MemoryNeed {
  std::uint64_t program = 0;  ///< code, libraries, heap, drivers; rings of ticks
  std::uint64_t stacks = 0;   ///< of the threads: locked as a whole
  std::uint64_t points = 0;   ///< grid.point_capacity
  std::uint64_t frames = 0;   ///< depth frames and what is kept of each pixel
  std::uint64_t ticks = 0;    ///< trace.flight_recorder_s
  std::uint64_t depth = 0;    ///< frames that wait for their compression and for the disk, with trace.depth

  std::uint64_t total() const { return program + stacks + points + frames + ticks + depth; }
};

MemoryNeed memoryNeed(const config::Settings& settings);

}  // namespace hapticd::tools
