// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/process_sample.h"

#include <fstream>
#include <iterator>
#include <sstream>

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kForceThread = "hapticd-force";

std::string firstLineOf(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

/// The number behind `key` in /proc/PID/status.
std::optional<std::uint64_t> numberIn(const fs::path& status, const std::string& key) {
  std::ifstream stream(status);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(key)) continue;
    std::istringstream rest(line.substr(key.size()));
    std::uint64_t number = 0;
    if (rest >> number) return number;
  }
  return std::nullopt;
}

std::uint64_t entriesIn(const fs::path& folder) {
  std::error_code gone;
  const fs::directory_iterator begin(folder, gone);
  return gone ? 0 : static_cast<std::uint64_t>(std::distance(begin, fs::directory_iterator()));
}

std::uint64_t forceThreadFaults(const fs::path& tasks) {
  std::error_code gone;
  for (const auto& task : fs::directory_iterator(tasks, gone)) {
    if (firstLineOf(task.path() / "comm") != kForceThread) continue;
    return faultsIn(firstLineOf(task.path() / "stat")).value_or(0);
  }
  return 0;
}

}  // namespace

std::optional<std::uint64_t> faultsIn(const std::string& stat_line) {
  const std::size_t end_of_name = stat_line.rfind(')');  // the name may hold anything
  if (end_of_name == std::string::npos) return std::nullopt;
  std::istringstream fields(stat_line.substr(end_of_name + 1));
  std::string skipped;
  for (int field = 3; field < 10; ++field) fields >> skipped;
  std::uint64_t minor = 0, minor_of_children = 0, major = 0;
  if (!(fields >> minor >> minor_of_children >> major)) return std::nullopt;
  return minor + major;
}

std::optional<ProcessSample> sampleProcess(pid_t pid, const fs::path& proc) {
  const fs::path process = proc / std::to_string(pid);
  const auto resident_kb = numberIn(process / "status", "VmRSS:");
  const auto threads = numberIn(process / "status", "Threads:");
  if (!resident_kb || !threads) return std::nullopt;
  return ProcessSample{0, *resident_kb, entriesIn(process / "fd"), *threads,
                       forceThreadFaults(process / "task")};
}

}  // namespace hapticd::tools
