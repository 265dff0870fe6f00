// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>

namespace hapticd::drivers {

/// The device file of a GPIO chip: of a path the path, of "gpiochipN" /dev/gpiochipN, of anything else the
/// first chip with that label. Numbers are given anew when a chip comes back, labels stay.
/// Errors: errno; for a label ENOENT, or EACCES where a chip could not be asked for its own.
std::expected<std::string, int> chipPath(const std::string& chip);

}  // namespace hapticd::drivers
