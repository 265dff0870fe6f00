// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "config/error.h"
#include "tests/vm/emulators/hid/hid_device.h"

namespace hapticd::test::hid {

/// The connection of an emulated device to a kernel.  Thread: one.
class HidLink {
 public:
  virtual ~HidLink() = default;
  /// Readable when receive() has something to do.
  virtual int file() const = 0;
  virtual config::Result<void> plug(const Identity& identity) = 0;
  virtual config::Result<void> unplug() = 0;
  /// Sends an input report; returns false if the kernel does not accept it now.
  virtual bool send(std::span<const std::uint8_t> report) = 0;
  /// Returns the next output report, without an id; nothing if none has arrived. Does not wait.
  virtual std::optional<Bytes> receive() = 0;
};

}  // namespace hapticd::test::hid
