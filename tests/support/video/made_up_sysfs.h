// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace hapticd::test {

/// A video node in a folder that stands for "/".
struct MadeUpNode {
  std::string name = "video0";
  std::string vendor = "8086";
  std::string product = "0b07";
  std::string serial = "012345678901";
  std::string link = "usb-RealSense_435_012345678901-video-index0";
  std::string index = "0";
};

inline void addNode(const std::filesystem::path& root, const MadeUpNode& node) {
  namespace fs = std::filesystem;
  const auto write = [](const fs::path& file, const std::string& text) {
    std::ofstream(file) << text << '\n';
  };
  const fs::path usb = root / "sys/devices/usb1" / ("1-" + node.serial);
  const fs::path interface = usb / ("1-" + node.serial + ":1.0");
  const fs::path video = root / "sys/class/video4linux" / node.name;
  fs::create_directories(interface);
  fs::create_directories(video);
  fs::create_directories(root / "dev/v4l/by-id");
  write(usb / "idVendor", node.vendor);
  write(usb / "idProduct", node.product);
  write(usb / "serial", node.serial);
  write(interface / "bInterfaceNumber", "00");
  write(video / "name", "Depth Camera");
  write(video / "index", node.index);
  fs::create_directory_symlink(interface, video / "device");
  fs::create_symlink("../../" + node.name, root / "dev/v4l/by-id" / node.link);
}

}  // namespace hapticd::test
