// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>

namespace hapticd::drivers {

/// Returns the device file of a GPIO chip: a path as it is, /dev/gpiochipN for "gpiochipN", and otherwise the
/// first chip with this label. Numbers may change when a chip is reconnected, labels do not.
/// Errors: errno; for a label ENOENT, or EACCES if the label of a chip could not be read.
std::expected<std::string, int> chipPath(const std::string& chip);

}  // namespace hapticd::drivers
