// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/examination.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/gpio.h>
#include <pwd.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <sstream>

#include "config/base/descriptor.h"
#include "config/yaml_loader.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::tools {

Configuration readConfiguration(const std::filesystem::path& root) {
  const std::filesystem::path file = root / "etc/hapticd/hapticd.yaml";
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored))
    return {{}, {}, fmt::format("the defaults: there is no {}", file.string())};
  auto settings = config::loadSettings(file);
  if (!settings) return {{}, settings.error().front().text(), file.string()};
  return {std::move(*settings), {}, file.string()};
}

Configuration configurationInUse(const DaemonView& daemon, const std::filesystem::path& root) {
  if (!daemon.settings) return readConfiguration(root);
  return {*daemon.settings, {}, fmt::format("as the running hapticd uses it ({})", daemon.socket)};
}

std::expected<std::string, int> gpioLabelOf(const std::string& path) {
  const int chip = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (chip < 0) return std::unexpected(errno);
  gpiochip_info info{};
  const int error = ::ioctl(chip, GPIO_GET_CHIPINFO_IOCTL, &info) == 0 ? 0 : errno;
  ::close(chip);
  if (error != 0) return std::unexpected(error);
  return std::string(info.label, ::strnlen(info.label, sizeof info.label));
}

namespace {

std::uint64_t limitOf(decltype(RLIMIT_RTPRIO) resource) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) return 0;
  return limit.rlim_cur == RLIM_INFINITY ? kNoLimit : limit.rlim_cur;
}

std::vector<gid_t> ownGroups() {
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(::getgroups(0, nullptr), 0)));
  const int count = ::getgroups(static_cast<int>(groups.size()), groups.data());
  groups.resize(static_cast<std::size_t>(std::max(count, 0)));
  groups.push_back(::getegid());
  return groups;
}

/// All that is in a file.
std::string contentOf(int file) {
  std::string text;
  std::array<char, 4096> part{};
  ::lseek(file, 0, SEEK_SET);
  for (ssize_t count = 0; (count = ::read(file, part.data(), part.size())) > 0;)
    text.append(part.data(), static_cast<std::size_t>(count));
  return text;
}

/// The output of a command; nothing if it fails or takes longer than 5 seconds.
std::optional<std::string> outputOf(const std::vector<std::string>& command) {
  const base::Descriptor output(::memfd_create("output", MFD_CLOEXEC));
  const base::Descriptor nowhere(::open("/dev/null", O_WRONLY | O_CLOEXEC));
  auto process = ChildProcess::start(command, {.output = output.get(), .errors = nowhere.get()}, "");
  if (!process) return std::nullopt;
  const auto ending = process->waitFor(std::chrono::seconds(5));
  return ending && ending->good() ? std::optional(contentOf(output.get())) : std::nullopt;
}

}  // namespace

Caller thisCaller() {
  const passwd* entry = ::getpwuid(::geteuid());
  return {entry ? entry->pw_name : std::to_string(::geteuid()), ::geteuid(), ownGroups(),
          limitOf(RLIMIT_RTPRIO), limitOf(RLIMIT_MEMLOCK)};
}

std::string machineArchitecture() {
  utsname names{};
  return ::uname(&names) == 0 ? names.machine : "";
}

UnitProperties parseProperties(const std::string& shown) {
  UnitProperties properties;
  std::istringstream lines(shown);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t equals = line.find('=');
    if (equals != std::string::npos) properties[line.substr(0, equals)] = line.substr(equals + 1);
  }
  return properties;
}

std::optional<UnitProperties> askServiceManager() {
  const auto shown = outputOf({"systemctl", "show", "hapticd.service",
                               "--property=LoadState,ActiveState,SubState,UnitFileState,NRestarts,"
                               "LimitRTPRIO,LimitMEMLOCK,MainPID,User"});
  if (!shown) return std::nullopt;
  return parseProperties(*shown);
}

std::string architectureOf(const Examination& box) {
  return box.machine.read("proc/sys/kernel/arch").value_or(box.architecture);
}

bool runsByHand(const Examination& box) {
  if (!box.daemon.answers || !box.daemon.settings) return false;
  if (!isInstalled(box.unit)) return true;
  const auto state = box.unit->find("ActiveState");
  return state != box.unit->end() && state->second != "active" && state->second != "reloading";
}

bool isInstalled(const std::optional<UnitProperties>& unit) {
  if (!unit) return false;
  const auto state = unit->find("LoadState");
  return state != unit->end() && state->second == "loaded";
}

}  // namespace hapticd::tools
