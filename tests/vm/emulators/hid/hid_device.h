// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/handle/hid/hid_controller.h"
#include "rt/base/vec3.h"

namespace hapticd::test::hid {

using Bytes = std::vector<std::uint8_t>;

/// The description of a device that the kernel gets.
struct Identity {
  std::string name;
  std::string serial;
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  Bytes descriptor;  ///< of the reports
};

/// The firmware of a HID device, without its connection. Times are CLOCK_MONOTONIC.  Thread: one.
class HidDevice {
 public:
  virtual ~HidDevice() = default;
  virtual const Identity& identity() const = 0;
  /// Advances the device by a millisecond; returns the input report to send, if there is one.
  virtual std::optional<Bytes> tick(std::int64_t now_ns) = 0;
  /// Processes an output report, without an id.
  virtual void take(std::span<const std::uint8_t> report, std::int64_t now_ns) = 0;
  /// Executes a command; returns "ok", or "error: " and the reason.
  virtual std::string command(std::string_view line) = 0;
  /// Returns statistics as members of a JSON object, without its braces.
  virtual std::string stats(std::int64_t now_ns) const = 0;
};

/// A controller with the firmware of drivers/handle/hid/reports.md, in a hand: a mass on a spring and a
/// damper that hold it where the hand aims, which moves at kHandSpeedMPerS at most. Commands: `aim X Y Z`
/// (metres), `button N` (toggles it), `fault N`, `home` (toggles homing), `reset` (as after a power failure).
class Controller final : public HidDevice {
 public:
  static constexpr double kHandSpeedMPerS = 0.3;

  explicit Controller(const std::string& serial);

  const Identity& identity() const override { return identity_; }
  std::optional<Bytes> tick(std::int64_t now_ns) override;
  void take(std::span<const std::uint8_t> report, std::int64_t now_ns) override;
  std::string command(std::string_view line) override;
  std::string stats(std::int64_t now_ns) const override;

 private:
  bool isSilent(std::int64_t now_ns) const;
  void moveHand();
  void count(std::int64_t now_ns);

  Identity identity_;
  drivers::InputReport input_;
  drivers::OutputReport output_;  // the last valid one
  std::int64_t output_ns_ = 0;    // when it came; 0: none yet
  rt::Vec3 target_m_;             // where the aim goes
  rt::Vec3 aim_m_;
  rt::Vec3 velocity_m_per_s_;
  rt::Vec3 exerted_n_;

  std::uint64_t sent_ = 0;
  std::uint64_t received_ = 0;
  std::uint64_t invalid_ = 0;
  std::uint64_t lost_ = 0;
  double most_force_n_ = 0;
  std::int64_t last_force_ns_ = 0;  // newest tick with a force other than zero
};

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
