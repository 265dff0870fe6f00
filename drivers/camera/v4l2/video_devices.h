// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"

namespace hapticd::drivers {

/// The system calls on a video device, so that tests can replace the kernel. Each returns a negative errno on
/// failure and repeats a call that a signal interrupted.
/// Thread: any for ioctl(), the rest one at a time.  RT: not safe.
class SystemCalls {
 public:
  virtual ~SystemCalls() = default;
  /// Opens a device for reading and writing, without blocking. Returns the descriptor.
  virtual int open(const std::string& path) = 0;
  virtual void close(int descriptor) = 0;
  virtual int ioctl(int descriptor, unsigned long request, void* argument) = 0;
  /// Maps a buffer of the device for reading; null on failure.
  virtual const std::byte* map(int descriptor, std::size_t bytes, std::size_t offset) = 0;
  virtual void unmap(const std::byte* address, std::size_t bytes) = 0;
  /// Waits until a buffer can be taken. Returns the events of poll(2), or 0 after `limit`.
  virtual int poll(int descriptor, std::chrono::milliseconds limit) = 0;
};

/// The kernel.
class KernelCalls final : public SystemCalls {
 public:
  int open(const std::string& path) override;
  void close(int descriptor) override;
  int ioctl(int descriptor, unsigned long request, void* argument) override;
  const std::byte* map(int descriptor, std::size_t bytes, std::size_t offset) override;
  void unmap(const std::byte* address, std::size_t bytes) override;
  int poll(int descriptor, std::chrono::milliseconds limit) override;
};

/// A device opened through SystemCalls; closed by the destructor.
class OpenDevice {
 public:
  OpenDevice(SystemCalls& calls, int descriptor) : calls_(calls), descriptor_(descriptor) {}
  ~OpenDevice() {
    if (descriptor_ >= 0) calls_.close(descriptor_);
  }
  OpenDevice(const OpenDevice&) = delete;
  OpenDevice& operator=(const OpenDevice&) = delete;

  int descriptor() const { return descriptor_; }
  int ioctl(unsigned long request, void* argument) const {
    return calls_.ioctl(descriptor_, request, argument);
  }
  SystemCalls& calls() const { return calls_; }

 private:
  SystemCalls& calls_;
  int descriptor_;
};

/// A video node of a USB device, as sysfs shows it.
struct VideoDevice {
  std::string node;          ///< "/dev/video2"
  std::string name;          ///< of the function, "Intel(R) RealSense(TM) Depth Camera 435"
  std::uint16_t vendor = 0;  ///< 0: not a USB device
  std::uint16_t product = 0;
  std::string serial;              ///< of the USB device; may be empty
  std::string usb_interface;       ///< "1-2:1.0"; empty: not a USB device
  std::vector<std::string> links;  ///< names in /dev/v4l/by-id
  int index = 0;                   ///< among the nodes of the same interface, in order of registration
};

/// Returns all video nodes, in the order of their numbers; none on a machine without any. `root`: stands for
/// "/".
std::vector<VideoDevice> videoDevices(const std::filesystem::path& root = "/");

/// Returns the nodes that the settings allow, in order: that of camera.device, those of camera.serial, or all
/// of them.
/// Errors: none; the error names what was found.
base::Result<std::vector<VideoDevice>> candidatesOf(const config::CameraSettings& settings,
                                                    const std::vector<VideoDevice>& devices);

}  // namespace hapticd::drivers
