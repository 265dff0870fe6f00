// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "config/error.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// Reads one depth image as written by libfreenect's recorder into `frame.raw`: exactly the header line "P5
/// 640 480 65535" and 614400 bytes of little-endian 16-bit raw disparities. The other members of `frame` are
/// not changed.
/// Errors: no such file, another size or header, a value above 2047; frame.raw then holds no valid image.
/// Thread: any, one at a time per frame.  RT: not safe.
config::Result<void> readDepthPgm(const std::filesystem::path& file, rt::DepthFrame& frame);

/// Writes `frame.raw` in the format of readDepthPgm(). An existing file of that name is replaced.
/// Errors: it cannot be written completely; the file is then removed.
config::Result<void> writeDepthPgm(const std::filesystem::path& file, const rt::DepthFrame& frame);

}  // namespace hapticd::drivers
