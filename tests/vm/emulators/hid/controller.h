// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "drivers/handle/hid/hid_controller.h"
#include "rt/base/vec3.h"
#include "tests/vm/emulators/hid/hid_device.h"

namespace hapticd::test::hid {

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

}  // namespace hapticd::test::hid
