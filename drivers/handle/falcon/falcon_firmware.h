// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "drivers/base/stop_signal.h"
#include "drivers/handle/falcon/ftdi_port.h"

namespace hapticd::drivers {

/// Loading the firmware of a Falcon, which loses it without power; its bootloader receives it over the serial
/// line.
/// Thread: the port's.  RT: not safe.

using FalconImage = std::vector<std::uint8_t>;

/// Largest accepted size of a firmware image in bytes.
inline constexpr std::size_t kMaxFalconImage = 64 * 1024;

/// Reads a firmware image.
/// Errors: no such file, not readable, empty, larger than kMaxFalconImage.
base::Result<FalconImage> readFalconImage(const std::string& path);

/// Returns whether a firmware responds; takes up to 1 s if none does. Returns false if `stop` was raised.
base::Result<bool> falconAnswers(FtdiPort& port, const StopSignal& stop);

/// Loads the image once, which takes seconds. A bootloader that has just been powered may need several tries.
/// Errors: the step that failed; `stop` was raised.
base::Result<void> loadFalconImage(FtdiPort& port, const FalconImage& image, const StopSignal& stop);

}  // namespace hapticd::drivers
