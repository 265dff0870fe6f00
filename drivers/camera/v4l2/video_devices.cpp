// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/video_devices.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <set>
#include <system_error>

#include "drivers/camera/v4l2/camera_report.h"

namespace hapticd::drivers {
namespace {

template <typename Call>
int withoutInterruption(Call call) {
  for (;;) {
    const int result = call();
    if (result >= 0) return result;
    if (errno != EINTR) return -errno;
  }
}

}  // namespace

int KernelCalls::open(const std::string& path) {
  return withoutInterruption([&] { return ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); });
}

void KernelCalls::close(int descriptor) {
  ::close(descriptor);
}

int KernelCalls::ioctl(int descriptor, unsigned long request, void* argument) {
  return withoutInterruption([&] { return ::ioctl(descriptor, request, argument); });
}

const std::byte* KernelCalls::map(int descriptor, std::size_t bytes, std::size_t offset) {
  void* const address = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor, static_cast<off_t>(offset));
  return address == MAP_FAILED ? nullptr : static_cast<const std::byte*>(address);
}

void KernelCalls::unmap(const std::byte* address, std::size_t bytes) {
  ::munmap(const_cast<std::byte*>(address), bytes);
}

int KernelCalls::poll(int descriptor, std::chrono::milliseconds limit) {
  pollfd waiting{descriptor, POLLIN, 0};
  const int ready = withoutInterruption([&] { return ::poll(&waiting, 1, static_cast<int>(limit.count())); });
  return ready > 0 ? waiting.revents : ready;
}

namespace {

namespace fs = std::filesystem;

constexpr const char* kConnect =
    "connect the camera to a USB 3 port; journalctl -k shows what the kernel finds";

std::string lineOf(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

template <typename Number>
Number numberFrom(const std::string& text, int base) {
  Number number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number, base);
  return number;
}

std::vector<std::string> namesIn(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    names.push_back(entry->path().filename());
  }
  std::ranges::sort(names);
  return names;
}

VideoDevice deviceOf(const fs::path& root, const std::string& name) {
  const fs::path folder = root / "sys/class/video4linux" / name;
  VideoDevice device;
  device.node = "/dev/" + name;
  device.name = lineOf(folder / "name");
  device.index = numberFrom<int>(lineOf(folder / "index"), 10);
  std::error_code error;
  const fs::path interface = fs::canonical(folder / "device", error);
  if (error || !fs::exists(interface / "bInterfaceNumber", error)) return device;
  const fs::path usb = interface.parent_path();
  device.usb_interface = interface.filename();
  device.vendor = numberFrom<std::uint16_t>(lineOf(usb / "idVendor"), 16);
  device.product = numberFrom<std::uint16_t>(lineOf(usb / "idProduct"), 16);
  device.serial = lineOf(usb / "serial");
  return device;
}

void addLinks(const fs::path& root, std::vector<VideoDevice>& devices) {
  const fs::path folder = root / "dev/v4l/by-id";
  for (const std::string& link : namesIn(folder)) {
    std::error_code error;
    const std::string target = "/dev/" + fs::read_symlink(folder / link, error).filename().string();
    for (VideoDevice& device : devices) {
      if (device.node == target) device.links.push_back(link);
    }
  }
}

bool isNamed(const VideoDevice& device, const std::string& name) {
  const std::string link = fs::path(name).filename();
  return device.node == name || std::ranges::find(device.links, link) != device.links.end();
}

}  // namespace

std::vector<VideoDevice> videoDevices(const fs::path& root) {
  std::vector<VideoDevice> devices;
  for (const std::string& name : namesIn(root / "sys/class/video4linux")) {
    if (name.starts_with("video")) devices.push_back(deviceOf(root, name));
  }
  std::ranges::sort(devices, [](const VideoDevice& a, const VideoDevice& b) {
    return std::pair(a.node.size(), a.node) < std::pair(b.node.size(), b.node);
  });
  addLinks(root, devices);
  return devices;
}

base::Result<std::vector<VideoDevice>> candidatesOf(const config::CameraSettings& settings,
                                                    const std::vector<VideoDevice>& devices) {
  const auto refuse = [](std::string what, std::string remedy) {
    return std::unexpected(base::Error{"v4l2", std::move(what), std::move(remedy)});
  };
  if (devices.empty()) return refuse("there is no video device", kConnect);
  std::vector<VideoDevice> candidates = devices;
  if (!settings.of<V4l2Settings>().device.empty()) {
    std::erase_if(candidates,
                  [&](const VideoDevice& it) { return !isNamed(it, settings.of<V4l2Settings>().device); });
    if (candidates.empty()) {
      return refuse(fmt::format("there is no device {}", settings.of<V4l2Settings>().device),
                    "connect it, or set camera.device to a name that hapticctl camera list shows");
    }
  }
  if (!settings.serial.empty()) {
    std::erase_if(candidates, [&](const VideoDevice& it) { return it.serial != settings.serial; });
    if (candidates.empty()) {
      std::set<std::string> serials;
      for (const VideoDevice& device : devices) {
        if (!device.serial.empty()) serials.insert(device.serial);
      }
      return refuse(fmt::format("no camera has the serial number {}; found: {}", settings.serial,
                                serials.empty() ? "none" : fmt::format("{}", fmt::join(serials, ", "))),
                    "set camera.serial to one of these, which are those of the USB devices");
    }
  }
  return candidates;
}

}  // namespace hapticd::drivers
