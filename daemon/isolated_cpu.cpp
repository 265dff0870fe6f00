// SPDX-License-Identifier: Apache-2.0
#include "daemon/isolated_cpu.h"

#include <charconv>
#include <fstream>
#include <string>

namespace hapticd::daemon {

int lastIsolatedCpu(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string list;
  if (!std::getline(stream, list)) return -1;
  // The list is in ascending order, so its last number is the last CPU.
  const std::size_t separator = list.find_last_of(",-");
  const char* const begin = list.data() + (separator == std::string::npos ? 0 : separator + 1);
  int cpu = -1;
  const auto [end, error] = std::from_chars(begin, list.data() + list.size(), cpu);
  return error == std::errc() && end == list.data() + list.size() ? cpu : -1;
}

bool isIsolated(int cpu, const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string stretch;
  while (std::getline(stream, stretch, ',')) {
    int first = -1;
    const char* const end = stretch.data() + stretch.size();
    const auto [dash, error] = std::from_chars(stretch.data(), end, first);
    int last = first;
    if (error != std::errc()) continue;
    if (dash != end && *dash == '-') std::from_chars(dash + 1, end, last);
    if (first <= cpu && cpu <= last) return true;
  }
  return false;
}

}  // namespace hapticd::daemon
