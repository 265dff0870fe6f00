// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/line_address.h"

namespace hapticd::drivers {

/// Why a line could not be requested.
struct LineFailure {
  enum class Step {
    chip,     ///< finding and opening the chip
    line,     ///< finding the line on it
    request,  ///< requesting the line as an output
  };
  Step step = Step::chip;
  int error = 0;       ///< errno
  std::string holder;  ///< current user of the line; may be empty
};

/// A line of a GPIO chip, driven as an output from request() to the end of the object, which switches it off.
/// "On" is the level given by the address. Both versions of libgpiod's interface are implemented:
/// output_line_v1.cpp, output_line_v2.cpp.
/// Thread: one at a time.  Progress: blocking for as long as the chip takes (milliseconds on a slow bus).
class OutputLine {
 public:
  /// Requests the line, switched off.  `chip_path`: the chip's device file.
  static std::expected<OutputLine, LineFailure> request(const std::string& chip_path,
                                                        const config::LineAddress& address);
  OutputLine(OutputLine&&) noexcept;
  OutputLine& operator=(OutputLine&&) noexcept;
  ~OutputLine();

  /// Switches the line; returns 0 or errno.
  int set(bool on);

 private:
  struct Held;
  explicit OutputLine(std::unique_ptr<Held> held);

  std::unique_ptr<Held> held_;
};

/// Returns the label of a chip, or errno.  `chip_path`: its device file.
std::expected<std::string, int> chipLabel(const std::string& chip_path);

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

/// Describes a failure of OutputLine::request() for people. A failure of the chip is the same for all its
/// lines. `chips`: the chips that there are (chipsText()).
base::Error lineError(const std::string& chip, const config::LineAddress& line, const LineFailure& failure,
                      const std::string& chips);

/// Describes a failure of OutputLine::set() for people.  `error`: errno.
base::Error setError(const std::string& chip, const config::LineAddress& line, int error);

}  // namespace hapticd::drivers
