// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "config/settings/settings.h"
#include "drivers/led/gpiod/output_line.h"
#include "drivers/led/led_panel.h"

namespace hapticd::drivers {

/// LEDs on the lines of a GPIO chip, through libgpiod. Each line is requested separately, so that one used by
/// another program does not affect the others. Missing lines are searched for once a second, and present ones
/// are written as often, so that the loss of a chip is noticed while no LED blinks.
/// Only the driver's own thread accesses the chip, because one on a slow bus blocks its caller.
class GpiodLeds final : public LedPanel {
 public:
  explicit GpiodLeds(const config::LedSettings& settings);
  ~GpiodLeds() override { stop(); }

  base::Result<void> start() override;
  void stop() override;
  void show(LedSet lit) override;
  LedStatus status() const override;

 private:
  using Clock = std::chrono::steady_clock;

  /// One LED. While the driver's thread runs, only that thread accesses it.
  struct Output {
    std::string configured;       // as in the configuration; empty: no such LED
    config::LineAddress address;  // valid after start()
    std::optional<OutputLine> line;
    bool was_held = false;
    bool shown_on = false;
    std::string problem;  // why the line is missing
  };

  void run();
  void requestMissing();
  void write(LedSet lit, bool refresh);
  void report();

  const std::string chip_;
  std::array<Output, kLedCount> outputs_;
  std::thread thread_;

  mutable std::mutex mutex_;  // for the following members; never held while the chip is accessed
  std::condition_variable changed_;
  LedSet lit_;
  bool stop_requested_ = false;
  LedStatus status_;
};

}  // namespace hapticd::drivers
