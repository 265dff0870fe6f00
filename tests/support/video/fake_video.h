// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/camera/v4l2/video_devices.h"

namespace hapticd::test {

/// One frame that the fake camera sends.
struct SentFrame {
  std::vector<std::uint16_t> pixels;  ///< line by line, with the padding
  std::size_t bytes = 0;              ///< that arrive
  bool is_damaged = false;
  std::uint32_t lost_before = 0;  ///< frames that the kernel has numbered and dropped before it
};

/// A RealSense camera behind the system calls, as uvcvideo shows it: /dev/video0 with one mode and the
/// hardware monitor, and /dev/video1 with its metadata.  Thread: any.
class FakeVideo final : public drivers::SystemCalls {
 public:
  FakeVideo();

  // What it is; set before the driver starts, or under change().
  struct Camera {
    bool plugged = true;
    bool in_use = false;           ///< by another program
    bool negotiates = true;        ///< answers when it is asked for a mode
    std::uint32_t format = 0;      ///< Z16 as it is made
    std::uint32_t width = 848;     ///< with which it answers
    std::uint32_t height = 480;    ///< with which it answers
    std::uint32_t line_bytes = 0;  ///< 0: without padding
    std::uint32_t rate_hz = 30;    ///< with which it answers
    int control_result = 0;        ///< a negative errno: with which every control of the extension unit fails
    std::chrono::milliseconds temperature_delay{0};  ///< until it answers with its temperature
    bool queue_fails = false;                        ///< the kernel has given its buffers up
    bool has_depth_modes = true;
    bool keeps_unit = false;  ///< refuses to change it
    std::uint32_t unit_um = 1000;
    std::int32_t disparity_mode = 0;
    std::vector<std::byte> table;  ///< table 25
    std::vector<std::byte> modes;  ///< reply to RECPARAMSGET
  };
  template <typename Change>
  void change(Change what) {
    const std::lock_guard lock(mutex_);
    what(camera_);
  }

  /// Sends a frame as soon as the driver has a buffer for it.
  void send(SentFrame frame);
  /// A frame of the configured size without padding, whose pixels count up from `first`.
  SentFrame countingFrame(std::uint16_t first);
  /// The values written to the controls of the extension unit other than the monitor, by selector.
  std::map<int, std::vector<std::byte>> controls();
  int opened();       ///< number of open() calls that have succeeded
  int descriptors();  ///< that are open now
  int mappings();     ///< that exist now

  int open(const std::string& path) override;
  void close(int descriptor) override;
  int ioctl(int descriptor, unsigned long request, void* argument) override;
  const std::byte* map(int descriptor, std::size_t bytes, std::size_t offset) override;
  void unmap(const std::byte* address, std::size_t bytes) override;
  int poll(int descriptor, std::chrono::milliseconds limit) override;

 private:
  int answer(unsigned long request, void* argument);
  int answerMetadata(unsigned long request, void* argument);
  int query(void* argument);
  std::chrono::milliseconds temperatureDelay();
  void runCommand(const std::vector<std::byte>& request);
  std::size_t frameBytes() const;

  std::mutex mutex_;
  Camera camera_;
  std::vector<std::vector<std::byte>> buffers_;
  std::deque<std::uint32_t> queued_;
  std::vector<std::vector<std::byte>> metadata_buffers_;
  std::deque<std::uint32_t> metadata_queued_;
  std::deque<std::uint32_t> metadata_sent_;  // sequence numbers
  std::deque<SentFrame> sent_;
  std::vector<std::byte> reply_;
  std::map<int, std::vector<std::byte>> controls_;
  std::uint32_t sequence_ = 0;
  bool streaming_ = false;
  int opened_ = 0;
  int descriptors_ = 0;
  int mappings_ = 0;
};

}  // namespace hapticd::test
