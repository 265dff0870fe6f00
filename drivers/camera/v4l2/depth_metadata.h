// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/camera/v4l2/little_endian.h"

namespace hapticd::drivers {

/// What a buffer of a metadata node in the format D4XX says of a frame, in microseconds. Layout: the kernel's
/// metafmt-d4xx.rst.
struct DepthMetadata {
  std::uint32_t optical_time_us = 0;  ///< from the start of the frame to mid-exposure
  std::uint32_t exposure_us = 0;      ///< duration
  std::uint32_t pipe_latency_us = 0;  ///< from the start of the frame to its data in the buffer for USB
};

/// Returns the metadata with a block "capture timing" of one buffer; nothing if it holds none or is damaged.
std::optional<DepthMetadata> depthMetadataFrom(Bytes buffer);

/// Returns the time from mid-exposure to the start of the transmission; nothing if the two times do not fit
/// together.
std::optional<std::int64_t> exposureAge_ns(const DepthMetadata& metadata);

}  // namespace hapticd::drivers
