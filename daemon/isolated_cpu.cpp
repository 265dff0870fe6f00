#include "daemon/isolated_cpu.h"

#include <charconv>
#include <fstream>
#include <string>

namespace hapticd::daemon {

int lastIsolatedCpu(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string list;
  if (!std::getline(stream, list)) return -1;
  // The list ascends: its last number is the last CPU.
  const std::size_t separator = list.find_last_of(",-");
  const char* const begin = list.data() + (separator == std::string::npos ? 0 : separator + 1);
  int cpu = -1;
  const auto [end, error] = std::from_chars(begin, list.data() + list.size(), cpu);
  return error == std::errc() && end == list.data() + list.size() ? cpu : -1;
}

}  // namespace hapticd::daemon
