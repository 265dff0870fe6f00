// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/base/error.h"
#include "drivers/led/gpiod/output_line.h"

namespace hapticd::drivers {

/// Describes a failure of OutputLine::request() for people. A failure of the chip is the same for all its
/// lines. `chips`: the chips that there are (chipsText()).
base::Error lineError(const std::string& chip, const config::LineAddress& line, const LineFailure& failure,
                      const std::string& chips);

/// Describes a failure of OutputLine::set() for people.  `error`: errno.
base::Error setError(const std::string& chip, const config::LineAddress& line, int error);

}  // namespace hapticd::drivers
