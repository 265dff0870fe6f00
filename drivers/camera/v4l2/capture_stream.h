// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/v4l2/little_endian.h"
#include "drivers/camera/v4l2/pinhole.h"
#include "drivers/camera/v4l2/video_devices.h"

namespace hapticd::drivers {

/// The format of a running stream.
struct StreamFormat {
  std::uint32_t pixels = 0;  ///< V4L2_PIX_FMT_Z16 or _Y16; of metadata, its format
  FrameSize size;
  std::size_t bytes_per_line = 0;
  std::size_t bytes = 0;  ///< of a frame
};

/// Whether the device captures video, and which depth format it offers.
struct Capability {
  bool is_capture = false;
  bool is_metadata = false;
  std::uint32_t depth_format = 0;  ///< Z16 preferred to Y16; 0: none
  std::string bus;                 ///< the same for all nodes of a device
};
/// Errors: the device does not answer.
base::Result<Capability> capabilityOf(const OpenDevice& device);

/// Negotiates format, size and rate.
/// Errors: the camera answers with another size, format, or rate; the error lists what it offers.
base::Result<StreamFormat> negotiateDepth(const OpenDevice& device, std::uint32_t pixels, FrameSize size,
                                          int rate_hz);
/// Errors: the node does not offer metadata in the format D4XX.
base::Result<StreamFormat> negotiateMetadata(const OpenDevice& device);

/// A buffer that the device has filled, until giveBack().
struct FilledBuffer {
  Bytes bytes;
  std::uint32_t index = 0;
  std::uint32_t sequence = 0;
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC at the start of the transmission; 0: another clock
  bool is_damaged = false;   ///< flagged by the driver
};

/// A running stream with its mapped buffers; stopped by the destructor.
/// Thread: always the same one.
class CaptureStream {
 public:
  CaptureStream(const OpenDevice& device, std::uint32_t buffer_type);
  ~CaptureStream();
  CaptureStream(const CaptureStream&) = delete;
  CaptureStream& operator=(const CaptureStream&) = delete;

  /// Maps the buffers and starts the stream.
  base::Result<void> start();
  /// Returns the next filled buffer without waiting; nothing: there is none.
  /// Errors: the device is gone or fails.
  base::Result<std::optional<FilledBuffer>> take();
  base::Result<void> giveBack(const FilledBuffer& buffer);

 private:
  base::Result<void> mapBuffer(std::uint32_t index);
  base::Result<void> queue(std::uint32_t index);

  const OpenDevice& device_;
  std::uint32_t type_;
  std::vector<Bytes> buffers_;
  bool started_ = false;
};

/// Returns a format's code as text, "Z16".
std::string fourccText(std::uint32_t code);

/// Returns the error for a failed call on a device.
base::Error callFailure(const char* call, int result);

}  // namespace hapticd::drivers
