// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/base/error.h"

namespace hapticd::test::uvc {

struct CaptureFormat {
  std::string fourcc = "Z16 ";
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  std::uint32_t rate_hz = 0;
};

/// A filled buffer of the kernel, valid until the next call of next().
struct CapturedFrame {
  std::span<const std::uint16_t> pixels;
  std::uint32_t sequence = 0;
  std::uint32_t bytes = 0;
  bool error = false;  ///< the kernel marks the frame as damaged
};

/// A stream from a node of V4L2 through memory that is shared with the kernel.  Thread: one.
class V4l2Capture {
 public:
  /// Opens the node, sets the format and starts streaming.
  /// Errors: the node, or the kernel refuses the format or has another one.
  static base::Result<std::unique_ptr<V4l2Capture>> start(const std::string& device,
                                                          const CaptureFormat& format);
  ~V4l2Capture();
  V4l2Capture(const V4l2Capture&) = delete;
  V4l2Capture& operator=(const V4l2Capture&) = delete;

  /// The next frame, nothing if none comes in that time.  Errors: the device is gone.
  base::Result<std::optional<CapturedFrame>> next(std::chrono::milliseconds patience);
  /// What the kernel has set as the time between two frames.
  std::uint32_t interval_us() const { return interval_us_; }

 private:
  struct Buffer {
    void* begin;
    std::size_t bytes;
  };

  explicit V4l2Capture(std::string device) : device_(std::move(device)) {}
  base::Result<void> setFormat(const CaptureFormat& format);
  base::Result<void> setRate(std::uint32_t rate_hz);
  base::Result<void> shareBuffers();
  base::Result<void> giveBack(std::uint32_t index);
  std::unexpected<base::Error> failed(const std::string& what) const;

  std::string device_;
  int file_ = -1;
  std::uint32_t interval_us_ = 0;
  std::vector<Buffer> buffers_;
  std::optional<std::uint32_t> held_;  // the buffer that next() has returned
};

}  // namespace hapticd::test::uvc
