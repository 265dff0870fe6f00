// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "config/base/error.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// Reads an image of raw values into `frame.raw`, in the padded rows of `frame.camera`, whose size it must
/// have: binary PGM (P5) of 16 bits as netpbm defines it, with the more significant byte first, or PNG of 16
/// bits of grey. The file's first bytes decide the format. The other members of `frame` are not
/// changed. Errors: no such file, another size or number of bits, a truncated or damaged file, a raw value
/// that the camera does not have; frame.raw then holds no valid image. Thread: any, one at a time per frame.
/// RT: not safe.
base::Result<void> readDepthImage(const std::filesystem::path& file, rt::DepthFrame& frame);

/// Writes the pixels of `frame` as a PGM image in the format of readDepthImage(). An existing file of that
/// name is replaced.
/// Errors: it cannot be written completely; the file is then removed.
base::Result<void> writeDepthImage(const std::filesystem::path& file, const rt::DepthFrame& frame);

/// The same for the images of a Kinect v1 as libfreenect's recorder writes them: exactly the header line "P5
/// 640 480 65535" and 614400 bytes of little-endian 16-bit raw disparities up to 2047.
base::Result<void> readKinectImage(const std::filesystem::path& file, rt::DepthFrame& frame);
base::Result<void> writeKinectImage(const std::filesystem::path& file, const rt::DepthFrame& frame);

}  // namespace hapticd::drivers
