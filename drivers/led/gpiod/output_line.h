// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <memory>
#include <string>

#include "config/line_address.h"

namespace hapticd::drivers {

/// Why a line cannot be had.
struct LineFailure {
  enum class Step {
    chip,     ///< finding and opening the chip
    line,     ///< finding the line on it
    request,  ///< taking the line over as an output
  };
  Step step = Step::chip;
  int error = 0;       ///< errno
  std::string holder;  ///< who has the line now; may be empty
};

/// A line of a GPIO chip, driven as an output from request() to the end of the object, which leaves it off.
/// "On" is the level that the address says. The two versions of libgpiod's interface are behind this one:
/// output_line_v1.cpp, output_line_v2.cpp.
/// Thread: one at a time.  Progress: blocking, as long as the chip takes (one on a slow bus: milliseconds).
class OutputLine {
 public:
  /// Takes the line over, off.  `chip_path`: of the chip's device file.
  static std::expected<OutputLine, LineFailure> request(const std::string& chip_path,
                                                        const config::LineAddress& address);
  OutputLine(OutputLine&&) noexcept;
  OutputLine& operator=(OutputLine&&) noexcept;
  ~OutputLine();

  /// 0, or errno.
  int set(bool on);

 private:
  struct Held;
  explicit OutputLine(std::unique_ptr<Held> held);

  std::unique_ptr<Held> held_;
};

/// The label of a chip, or errno.  `chip_path`: of its device file.
std::expected<std::string, int> chipLabel(const std::string& chip_path);

}  // namespace hapticd::drivers
