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
  virtual ~HidLink() = default;
  /// Readable when receive() has something to do.
  virtual int file() const = 0;
  virtual base::Result<void> plug(const Identity& identity) = 0;
  virtual base::Result<void> unplug() = 0;
  /// Sends an input report; returns false if the kernel does not accept it now.
  virtual bool send(std::span<const std::uint8_t> report) = 0;
  /// Returns the next output report, without an id; nothing if none has arrived. Does not wait.
  virtual std::optional<Bytes> receive() = 0;
};

/// The device's side of a USB gadget with a HID function (/dev/hidgN), or a socket that keeps the borders of
/// its packets. The creator of the gadget plugs it in and out.
class GadgetLink final : public HidLink {
 public:
  /// Errors: the file cannot be opened.
  static base::Result<std::unique_ptr<GadgetLink>> open(const std::filesystem::path& path);
  /// Takes over `file`, which does not block.
  explicit GadgetLink(int file) : file_(file) {}
  ~GadgetLink() override;
  GadgetLink(const GadgetLink&) = delete;
  GadgetLink& operator=(const GadgetLink&) = delete;

  int file() const override { return file_; }
  base::Result<void> plug(const Identity& identity) override;
  base::Result<void> unplug() override;
  bool send(std::span<const std::uint8_t> report) override;
  std::optional<Bytes> receive() override;

 private:
  int file_;
};

/// A device made with the events of <linux/uhid.h>: /dev/uhid, or a socket that keeps the borders of its
/// packets with the kernel's part played at the other end.
class UhidLink final : public HidLink {
 public:
  /// Errors: the file cannot be opened.
  static base::Result<std::unique_ptr<UhidLink>> open(const std::filesystem::path& path = "/dev/uhid");
  /// Takes over `file`, which does not block.
  explicit UhidLink(int file) : file_(file) {}
  ~UhidLink() override;
  UhidLink(const UhidLink&) = delete;
  UhidLink& operator=(const UhidLink&) = delete;

  int file() const override { return file_; }
  base::Result<void> plug(const Identity& identity) override;
  base::Result<void> unplug() override;
  bool send(std::span<const std::uint8_t> report) override;
  std::optional<Bytes> receive() override;

 private:
  int file_;
};

}  // namespace hapticd::test::hid
