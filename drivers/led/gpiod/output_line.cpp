// SPDX-License-Identifier: Apache-2.0
#include "drivers/led/gpiod/output_line.h"

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <system_error>

#include "config/base/value_text.h"

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

namespace {

using base::Error;
using base::inQuotes;

constexpr const char* kNoAccess =
    "restart hapticd.service, for which udev then opens the chip that /etc/hapticd/hapticd.yaml names; for "
    "another "
    "configuration let the daemon's user read and write the chip by a udev rule";

std::string chipText(const std::string& chip) {
  return "GPIO chip " + inQuotes(chip);
}

std::string lineText(const std::string& chip, const config::LineAddress& line) {
  return chipText(chip) + ", " + textOf(line);
}

std::string systemText(int error) {
  return std::generic_category().message(error);
}

Error chipError(const std::string& chip, int error, const std::string& chips) {
  const std::string where = chipText(chip);
  if (error == ENOENT && chips.empty()) {
    return {where, "no such chip, as this machine has none",
            "load the driver of the chip, or correct leds.chip"};
  }
  if (error == ENOENT) {
    return {where, "no such chip; there are " + chips,
            "set leds.chip to the label of one of them, or load the driver of the chip"};
  }
  if (isNoAccess(error)) return {where, "permission denied", kNoAccess};
  // errno for a file that is not a chip depends on the version of libgpiod
  if (error == ENOTTY || error == ENODEV || error == EINVAL)
    return {where, "not a GPIO chip", "gpiodetect lists the chips; correct leds.chip"};
  return {where, systemText(error), "gpiodetect shows whether the chip responds"};
}

Error requestError(const std::string& where, const LineFailure& failure) {
  if (failure.error == EBUSY) {
    const std::string holder = failure.holder.empty() ? "" : " by " + inQuotes(failure.holder);
    return {where, "the line is in use" + holder,
            "stop the program that holds it, or choose another line (gpioinfo shows the holders)"};
  }
  if (isNoAccess(failure.error)) return {where, "the line cannot be an output", "choose another line"};
  return {where, systemText(failure.error), "gpioinfo shows what the line can be used for"};
}

}  // namespace

Error lineError(const std::string& chip, const config::LineAddress& line, const LineFailure& failure,
                const std::string& chips) {
  switch (failure.step) {
    case LineFailure::Step::chip:
      return chipError(chip, failure.error, chips);
    case LineFailure::Step::line:
      if (failure.error == ENOENT || failure.error == EINVAL) {
        return {lineText(chip, line), "no such line",
                "gpioinfo lists the lines of each chip; correct leds.*_line"};
      }
      return chipError(chip, failure.error, chips);
    case LineFailure::Step::request:
      break;
  }
  return requestError(lineText(chip, line), failure);
}

Error setError(const std::string& chip, const config::LineAddress& line, int error) {
  if (error == ENODEV || error == ENXIO) {
    return {chipText(chip), "the chip is gone",
            "connect it again or load its driver; hapticd searches for it once a second"};
  }
  return {lineText(chip, line), "cannot be switched: " + systemText(error),
          "check the chip's connection; hapticd tries again once a second"};
}

}  // namespace hapticd::drivers
