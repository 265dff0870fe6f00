// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <string_view>

#include "tests/vm/emulators/hid/hid_device.h"
#include "tests/vm/emulators/hid/hid_link.h"
#include "tests/vm/emulators/usbip/control_socket.h"

namespace hapticd::test::hid {

/// Runs a device at 1 kHz on a link: one loop over the link, the clock and the control socket. Commands:
/// those of the device, and `mute` (no reports), `garbage` (random bytes instead of reports), `play` (ends
/// both), `unplug`, `replug`, `stats`.
class HidEmulator {
 public:
  /// `device` and `link` outlive it. `control`: path of the socket for commands.
  HidEmulator(HidDevice& device, HidLink& link, std::filesystem::path control);
  ~HidEmulator();
  HidEmulator(const HidEmulator&) = delete;
  HidEmulator& operator=(const HidEmulator&) = delete;

  /// Serves until `stop` (a file descriptor) becomes readable, then unplugs the device.
  /// Errors: the control socket or the device cannot be had.
  base::Result<void> run(int stop);

 private:
  enum class Conduct { play, mute, garbage };

  void serveUntil(int stop, usbip::ControlSocket& control);
  void tick();
  void send(Bytes report);
  std::string answer(std::string_view line);
  std::string plugOrUnplug(bool plug);

  HidDevice& device_;
  HidLink& link_;
  std::filesystem::path control_path_;
  int timer_;
  Conduct conduct_ = Conduct::play;
  bool plugged_ = false;
  std::uint64_t missed_ticks_ = 0;  // the timer went off again before it was served
  std::uint64_t not_taken_ = 0;     // reports that the kernel did not take
  std::mt19937 random_;             // the same garbage in each run
};

}  // namespace hapticd::test::hid
