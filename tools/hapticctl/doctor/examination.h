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
#include "tools/hapticctl/doctor/camera_list.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

/// The configuration of hapticd, as far as it can be read.
struct Configuration {
  config::Settings settings;  ///< the defaults if there is no file, or one that cannot be used
  std::string problem;        ///< why an existing file cannot be used; empty: nothing is wrong
};

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

/// What a running daemon reports of itself.
struct DaemonView {
  bool answers = false;
  std::string problem;     ///< why it does not answer
  std::optional<int> cpu;  ///< the CPU to which its force thread is pinned
  bool memory_locked = false;
  std::vector<std::string> warnings;  ///< what it reports as wrong
};

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

/// Whether the service manager knows hapticd.service.
bool isInstalled(const std::optional<UnitProperties>& unit);

}  // namespace hapticd::tools
