// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <memory>
#include <string>

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

}  // namespace hapticd::drivers
