// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "tests/vm/emulators/hid/hid_link.h"

namespace hapticd::test::hid {

/// The device's side of a USB gadget with a HID function (/dev/hidgN), or a socket that keeps the borders of
/// its packets. The creator of the gadget plugs it in and out.
class GadgetLink final : public HidLink {
 public:
  /// Errors: the file cannot be opened.
  static config::Result<std::unique_ptr<GadgetLink>> open(const std::filesystem::path& path);
  /// Takes over `file`, which does not block.
  explicit GadgetLink(int file) : file_(file) {}
  ~GadgetLink() override;
  GadgetLink(const GadgetLink&) = delete;
  GadgetLink& operator=(const GadgetLink&) = delete;

  int file() const override { return file_; }
  config::Result<void> plug(const Identity& identity) override;
  config::Result<void> unplug() override;
  bool send(std::span<const std::uint8_t> report) override;
  std::optional<Bytes> receive() override;

 private:
  int file_;
};

}  // namespace hapticd::test::hid
