// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>

#include "tests/vm/emulators/hid/hid_device.h"

namespace hapticd::test::hid {

/// A SpaceMouse Wireless: all six axes every 16 ms while the cap is deflected, zeros once when it is
/// released, buttons when they change. Not a SpaceNavigator, because the kernel's driver for that one takes
/// no device of uhid. Commands: `push X Y Z` (-350..350), `button N` (0 or 1, toggles it).
class SpaceMouse final : public HidDevice {
 public:
  explicit SpaceMouse(const std::string& serial);

  const Identity& identity() const override { return identity_; }
  std::optional<Bytes> tick(std::int64_t now_ns) override;
  void take(std::span<const std::uint8_t> report, std::int64_t now_ns) override;
  std::string command(std::string_view line) override;
  std::string stats(std::int64_t now_ns) const override;

 private:
  Identity identity_;
  std::array<int, 3> cap_{};
  bool was_deflected_ = false;
  std::uint8_t buttons_ = 0;
  std::deque<Bytes> waiting_;
  std::uint64_t ticks_ = 0;
  std::uint64_t sent_ = 0;
};

}  // namespace hapticd::test::hid
