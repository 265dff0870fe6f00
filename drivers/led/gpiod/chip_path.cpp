// SPDX-License-Identifier: Apache-2.0
#include "drivers/led/gpiod/chip_path.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include "drivers/led/gpiod/output_line.h"

namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kChipName = "gpiochip";

bool isChipName(std::string_view name) {
  if (!name.starts_with(kChipName) || name.size() == kChipName.size()) return false;
  return name.find_first_not_of("0123456789", kChipName.size()) == std::string_view::npos;
}

std::vector<std::string> allChipPaths() {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::directory_iterator entry("/dev", error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    if (isChipName(entry->path().filename().string())) paths.push_back(entry->path());
  }
  std::ranges::sort(paths);
  return paths;
}

}  // namespace

std::expected<std::string, int> chipPath(const std::string& chip) {
  if (chip.starts_with('/')) return chip;
  if (isChipName(chip)) return "/dev/" + chip;
  int error = ENOENT;
  for (const std::string& path : allChipPaths()) {
    const std::expected<std::string, int> label = chipLabel(path);
    if (label && *label == chip) return path;
    if (!label && (label.error() == EACCES || label.error() == EPERM)) error = EACCES;
  }
  return std::unexpected(error);
}

}  // namespace hapticd::drivers
