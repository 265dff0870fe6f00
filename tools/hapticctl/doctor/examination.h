// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <expected>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/settings/settings.h"
#include "tools/hapticctl/doctor/cameras.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

/// The configuration of hapticd, as far as it can be read.
struct Configuration {
  config::Settings settings;  ///< the defaults if there is no file, or one that cannot be used
  std::string problem;        ///< why an existing file cannot be used; empty: nothing is wrong
  std::string source = {};    ///< "/etc/hapticd/hapticd.yaml", "as the running hapticd uses it (SOCKET)", ...
};

/// What to do about a configuration that cannot be used.
inline constexpr const char* kCheckConfiguration =
    "/usr/libexec/hapticd/hapticd --config /etc/hapticd/hapticd.yaml --check lists every problem";

/// Reads etc/hapticd/hapticd.yaml below the folder `root`.
Configuration readConfiguration(const std::filesystem::path& root);

/// Returns the label of the GPIO chip with a device file, or errno.
using GpioLabel = std::function<std::expected<std::string, int>(const std::string& path)>;

/// Asks the kernel for the label of a chip of this machine.
std::expected<std::string, int> gpioLabelOf(const std::string& path);

inline constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

/// The user who runs the examination.
struct Caller {
  std::string name;  ///< or the number, if the user has no name
  uid_t user = 0;
  std::vector<gid_t> groups;        ///< all groups of the user
  std::uint64_t rtprio = 0;         ///< the highest real-time priority the user may set
  std::uint64_t memlock_bytes = 0;  ///< how much memory the user may lock
};

/// The properties of hapticd.service and their values, as `systemctl show` prints them.
using UnitProperties = std::map<std::string, std::string>;

/// A device as the running daemon sees it.
struct DeviceInUse {
  std::string identity;     ///< driver and serial number or folder
  std::string state;        ///< "streaming", "present", "absent", ...; empty: not reported
  std::string detail;       ///< why it cannot be used, and what to do; may be empty
  std::string node = {};    ///< of a camera of the driver v4l2, "/dev/video2"; empty: none is open
  std::string format = {};  ///< of its depth, "Z16"
  bool works = false;       ///< it delivers
};

/// What a running daemon reports of itself.
struct DaemonView {
  bool answers = false;
  std::string problem;     ///< why it does not answer
  std::optional<int> cpu;  ///< the CPU to which its force thread is pinned
  bool memory_locked = false;
  std::vector<std::string> warnings;  ///< what it reports as wrong
  std::string remedy = {};            ///< where it does not answer; empty: start the service
  std::string socket = {};            ///< where it was asked
  pid_t socket_process = 0;  ///< that made this socket: the daemon, or the service manager; 0: not known
  DeviceInUse camera = {};
  DeviceInUse handle = {};
  /// Its parameters, as far as it reports them; nothing: it does not answer, or is of another version.
  std::optional<config::Settings> settings = {};
};

/// The configuration to examine a machine with: what the running daemon uses, else the one in the file.
Configuration configurationInUse(const DaemonView& daemon, const std::filesystem::path& root);

/// Everything that the checks examine.
struct Examination {
  Machine machine;
  Caller caller;
  std::optional<UnitProperties> unit;  ///< nothing: the service manager cannot be queried
  DaemonView daemon;
  Configuration configuration = {};
  DepthProbe depth_probe = {};    ///< none if the files are not those of this machine
  GpioLabel gpio_label = {};      ///< none if the files are not those of this machine
  std::string architecture = {};  ///< "x86_64", "aarch64", as uname prints it; empty: not known
};

/// The user of this process.
Caller thisCaller();

/// The architecture of this machine, as uname prints it.
std::string machineArchitecture();

/// Parses the output of `systemctl show`, which has lines "Name=value".
UnitProperties parseProperties(const std::string& shown);

/// Queries the service manager for at most 5 seconds; nothing if there is none or it does not answer.
std::optional<UnitProperties> askServiceManager();

/// The architecture of the examined machine: kernels since 6.1 state it in a file. Empty: not known.
std::string architectureOf(const Examination& box);

/// Whether the daemon that responds is not the service: then it runs as the user who started it.
bool runsByHand(const Examination& box);

/// Whether the service manager knows hapticd.service.
bool isInstalled(const std::optional<UnitProperties>& unit);

}  // namespace hapticd::tools
