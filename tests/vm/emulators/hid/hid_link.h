// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "config/base/error.h"
#include "tests/vm/emulators/hid/hid_device.h"

namespace hapticd::test::hid {

/// The connection of an emulated device to a kernel.  Thread: one.
class HidLink {
 public:
  /// Takes over `file`, which does not block.
  explicit HidLink(int file) : file_(file) {}
  virtual ~HidLink();
  HidLink(const HidLink&) = delete;
  HidLink& operator=(const HidLink&) = delete;

  /// Readable when receive() has something to do.
  int file() const { return file_; }
  virtual base::Result<void> plug(const Identity& identity) = 0;
  virtual base::Result<void> unplug() = 0;
  /// Sends an input report; returns false if the kernel does not accept it now.
  virtual bool send(std::span<const std::uint8_t> report) = 0;
  /// Returns the next output report, without an id; nothing if none has arrived. Does not wait.
  virtual std::optional<Bytes> receive() = 0;

 private:
  int file_;
};

/// The device's side of a USB gadget with a HID function (/dev/hidgN), or a socket that keeps the borders of
/// its packets. The creator of the gadget plugs it in and out.
class GadgetLink final : public HidLink {
 public:
  /// Errors: the file cannot be opened.
  static base::Result<std::unique_ptr<GadgetLink>> open(const std::filesystem::path& path);
  using HidLink::HidLink;

  base::Result<void> plug(const Identity& identity) override;
  base::Result<void> unplug() override;
  bool send(std::span<const std::uint8_t> report) override;
  std::optional<Bytes> receive() override;
};

/// A device made with the events of <linux/uhid.h>: /dev/uhid, or a socket that keeps the borders of its
/// packets with the kernel's part played at the other end.
class UhidLink final : public HidLink {
 public:
  /// Errors: the file cannot be opened.
  static base::Result<std::unique_ptr<UhidLink>> open(const std::filesystem::path& path = "/dev/uhid");
  using HidLink::HidLink;

  base::Result<void> plug(const Identity& identity) override;
  base::Result<void> unplug() override;
  bool send(std::span<const std::uint8_t> report) override;
  std::optional<Bytes> receive() override;
};

}  // namespace hapticd::test::hid
