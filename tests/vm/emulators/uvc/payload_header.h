// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "tests/vm/emulators/uvc/byte_writer.h"
#include "tests/vm/emulators/uvc/camera_model.h"

namespace hapticd::test::uvc {

/// What the header of a frame's payload tells.
struct FrameTimes {
  std::uint32_t number = 0;
  std::uint32_t exposure_start_us = 0;  ///< of the camera's clock, as are the others
  std::uint32_t exposure_us = 0;
  std::uint32_t sent_us = 0;
  std::uint32_t interval_us = 0;
};

/// Bytes of a payload header: 12, and of RealSense the blocks of metadata that the kernel's document
/// metafmt-d4xx describes.
std::size_t payloadHeaderBytes(const CameraModel& model);

/// The header of a payload that holds a whole frame, with presentation and source time.
Bytes payloadHeader(const CameraModel& model, const DepthMode& mode, const FrameTimes& times, bool frame_id);

}  // namespace hapticd::test::uvc
