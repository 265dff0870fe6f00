// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/examination.h"

#include <fcntl.h>
#include <poll.h>
#include <pwd.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <sstream>

extern char** environ;

namespace hapticd::tools {
namespace {

using Clock = std::chrono::steady_clock;

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

/// Reads `pipe` to its end; nothing if that takes longer than allowed.
std::optional<std::string> readUntilEnd(int pipe, Clock::time_point deadline) {
  std::string text;
  std::array<char, 4096> part{};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd waiting{pipe, POLLIN, 0};
    if (left <= 0 || ::poll(&waiting, 1, static_cast<int>(left)) == 0) return std::nullopt;
    const ssize_t count = ::read(pipe, part.data(), part.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    text.append(part.data(), static_cast<std::size_t>(count));
  }
}

/// Starts a process with its stdout in `pipe` and its stderr discarded; -1 if it does not start.
pid_t spawn(const std::vector<std::string>& command, int pipe) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&files, pipe, STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t process = -1;
  const int error = ::posix_spawnp(&process, arguments[0], &files, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  return error == 0 ? process : -1;
}

/// The output of a command; nothing if it fails or takes longer than 5 seconds.
std::optional<std::string> outputOf(const std::vector<std::string>& command) {
  const auto deadline = Clock::now() + std::chrono::seconds(5);
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
  const pid_t process = spawn(command, ends[1]);
  ::close(ends[1]);
  std::optional<std::string> output;
  if (process > 0) output = readUntilEnd(ends[0], deadline);
  ::close(ends[0]);
  if (process <= 0) return std::nullopt;
  if (!output) ::kill(process, SIGKILL);
  int status = 0;
  ::waitpid(process, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? output : std::nullopt;
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
                               "LimitRTPRIO,LimitMEMLOCK,User"});
  if (!shown) return std::nullopt;
  return parseProperties(*shown);
}

std::string architectureOf(const Examination& box) {
  return box.machine.read("proc/sys/kernel/arch").value_or(box.architecture);
}

bool isInstalled(const std::optional<UnitProperties>& unit) {
  if (!unit) return false;
  const auto state = unit->find("LoadState");
  return state != unit->end() && state->second == "loaded";
}

}  // namespace hapticd::tools
