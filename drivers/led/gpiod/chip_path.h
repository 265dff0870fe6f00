// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace hapticd::drivers {

/// A GPIO chip.
struct GpioChip {
  std::string path;                       ///< its device file, /dev/gpiochipN
  std::expected<std::string, int> label;  ///< what its driver calls it, or errno
};

/// Returns the label of the chip with a device file, or errno.
using ChipLabel = std::function<std::expected<std::string, int>(const std::string& path)>;

/// Returns the chips with a device file in a folder, by their numbers. Links are left out: some kernels make
/// one for a number that a chip had before.
std::vector<GpioChip> chipsIn(const std::filesystem::path& folder, const ChipLabel& label);

/// Returns the chips of this machine.
std::vector<GpioChip> gpioChips();

/// Returns the device file of a chip: a path as it is, /dev/gpiochipN for "gpiochipN", and otherwise the
/// first of `chips` with this label. The number of a chip may differ between kernels and when it is
/// reconnected, its label does not. Errors: errno; for a label ENOENT, or EACCES if the label of a chip could
/// not be read.
std::expected<std::string, int> chipPath(const std::string& chip, const std::vector<GpioChip>& chips);

/// The chips for people: "gpiochip0 (pinctrl-rp1), gpiochip10 (gpio-brcmstb@107d508500)"; empty: there are
/// none.
std::string chipsText(const std::vector<GpioChip>& chips);

}  // namespace hapticd::drivers
