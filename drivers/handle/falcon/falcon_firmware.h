// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "config/error.h"
#include "drivers/base/stop_signal.h"
#include "drivers/handle/falcon/ftdi_port.h"

namespace hapticd::drivers {

/// A Falcon forgets its firmware without power; its bootloader takes it over the serial line.
/// Thread: the port's.  RT: not safe.

using FalconImage = std::vector<std::uint8_t>;

inline constexpr std::size_t kLargestFalconImage = 64 * 1024;

/// Errors: no such file, not readable, empty, larger than kLargestFalconImage.
config::Result<FalconImage> readFalconImage(const std::string& path);

/// Whether a firmware answers; up to 1 s where none does. False also when `stop` was raised.
config::Result<bool> falconAnswers(FtdiPort& port, const StopSignal& stop);

/// Loads the image once, seconds. A bootloader that has just been switched on may need several tries.
/// Errors: the step that failed; `stop` was raised.
config::Result<void> loadFalconImage(FtdiPort& port, const FalconImage& image, const StopSignal& stop);

}  // namespace hapticd::drivers
