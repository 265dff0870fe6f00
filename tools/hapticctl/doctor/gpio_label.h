// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <functional>
#include <string>

namespace hapticd::tools {

/// Returns the label of the GPIO chip with a device file, or errno.
using GpioLabel = std::function<std::expected<std::string, int>(const std::string& path)>;

/// Asks the kernel for the label of a chip of this machine.
std::expected<std::string, int> gpioLabelOf(const std::string& path);

}  // namespace hapticd::tools
