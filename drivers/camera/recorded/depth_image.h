// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "config/error.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// Width and height of an image in pixels.
struct ImageSize {
  int width_px = 0;
  int height_px = 0;
};

/// Reads the size of a 16-bit image from its header.
/// Errors: no such file, neither PGM nor PNG of 16-bit greys, larger than any camera's frame.
/// Thread: any.  RT: not safe.
config::Result<ImageSize> sizeOfDepthImage(const std::filesystem::path& file);

/// Reads an image of raw values into `frame.raw`, in the padded rows of `frame.camera`, whose size it must
/// have: binary PGM (P5) of 16 bits as netpbm defines it, with the more significant byte first, or PNG of 16
/// bits of grey. The file's first bytes decide the format. The other members of `frame` are not
/// changed. Errors: no such file, another size or number of bits, a truncated or damaged file, a raw value
/// that the camera does not have; frame.raw then holds no valid image. Thread: any, one at a time per frame.
/// RT: not safe.
config::Result<void> readDepthImage(const std::filesystem::path& file, rt::DepthFrame& frame);

/// Writes the pixels of `frame` as a PGM image in the format of readDepthImage(). An existing file of that
/// name is replaced.
/// Errors: it cannot be written completely; the file is then removed.
config::Result<void> writeDepthImage(const std::filesystem::path& file, const rt::DepthFrame& frame);

}  // namespace hapticd::drivers
