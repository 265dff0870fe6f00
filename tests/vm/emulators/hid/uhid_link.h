// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "tests/vm/emulators/hid/hid_link.h"

namespace hapticd::test::hid {

/// A device made with the events of <linux/uhid.h>: /dev/uhid, or a socket that keeps the borders of its
/// packets with the kernel's part played at the other end.
class UhidLink final : public HidLink {
 public:
  /// Errors: the file cannot be opened.
  static config::Result<std::unique_ptr<UhidLink>> open(const std::filesystem::path& path = "/dev/uhid");
  /// Takes over `file`, which does not block.
  explicit UhidLink(int file) : file_(file) {}
  ~UhidLink() override;
  UhidLink(const UhidLink&) = delete;
  UhidLink& operator=(const UhidLink&) = delete;

  int file() const override { return file_; }
  config::Result<void> plug(const Identity& identity) override;
  config::Result<void> unplug() override;
  bool send(std::span<const std::uint8_t> report) override;
  std::optional<Bytes> receive() override;

 private:
  int file_;
};

}  // namespace hapticd::test::hid
