// SPDX-License-Identifier: Apache-2.0
#include "drivers/led/gpiod/chip_path.h"

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <system_error>

#include "config/base/value_text.h"
#include "drivers/led/gpiod/output_line.h"

namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kChipName = "gpiochip";

bool isChipName(std::string_view name) {
  if (!name.starts_with(kChipName) || name.size() == kChipName.size()) return false;
  return name.find_first_not_of("0123456789", kChipName.size()) == std::string_view::npos;
}

bool isNoAccess(int error) {
  return error == EACCES || error == EPERM;
}

/// Paths of the same folder by the numbers at their ends, which have no leading zeros.
bool hasLowerNumber(const std::string& a, const std::string& b) {
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

}  // namespace

std::vector<GpioChip> chipsIn(const fs::path& folder, const ChipLabel& label) {
  std::vector<std::string> paths;
  std::error_code error, ignored;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    if (isChipName(entry->path().filename().string()) && !entry->is_symlink(ignored)) {
      paths.push_back(entry->path());
    }
  }
  std::ranges::sort(paths, hasLowerNumber);
  std::vector<GpioChip> chips;
  for (std::string& path : paths) {
    auto its_label = label(path);
    chips.push_back({std::move(path), std::move(its_label)});
  }
  return chips;
}

std::vector<GpioChip> gpioChips() {
  return chipsIn("/dev", chipLabel);
}

std::expected<std::string, int> chipPath(const std::string& chip, const std::vector<GpioChip>& chips) {
  if (chip.starts_with('/')) return chip;
  if (isChipName(chip)) return "/dev/" + chip;
  int error = ENOENT;
  for (const auto& [path, label] : chips) {
    if (label && *label == chip) return path;
    if (!label && isNoAccess(label.error())) error = EACCES;
  }
  return std::unexpected(error);
}

std::string chipsText(const std::vector<GpioChip>& chips) {
  std::string text;
  for (const auto& [path, label] : chips) {
    text += (text.empty() ? "" : ", ") + fs::path(path).filename().string() + " (";
    text += label ? base::printable(*label)
                  : "label not readable: " + std::generic_category().message(label.error());
    text += ")";
  }
  return text;
}

}  // namespace hapticd::drivers
