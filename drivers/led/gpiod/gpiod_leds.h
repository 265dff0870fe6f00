// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "config/settings.h"
#include "drivers/led/gpiod/output_line.h"
#include "drivers/led/led_panel.h"

namespace hapticd::drivers {

/// LEDs on the lines of a GPIO chip, through libgpiod. Each line is held by itself: one that is taken by
/// another program leaves the others working. What is missing is looked for once a second, and what is there
/// is written as often, so that a chip that has gone is noticed while no LED blinks.
/// The chip is only touched by the driver's own thread, because one on a slow bus keeps its caller waiting.
class GpiodLeds final : public LedPanel {
 public:
  explicit GpiodLeds(const config::LedSettings& settings);
  ~GpiodLeds() override { stop(); }

  config::Result<void> start() override;
  void stop() override;
  void show(LedSet lit) override;
  LedStatus status() const override;

 private:
  using Clock = std::chrono::steady_clock;

  /// One LED. Only the driver's thread touches it while there is one.
  struct Output {
    std::string configured;       // as in the configuration; empty: there is no such LED
    config::LineAddress address;  // valid from start() on
    std::optional<OutputLine> line;
    bool was_held = false;
    bool shown_on = false;
    std::string complaint;  // why there is no line
  };

  void run();
  void requestMissing();
  void write(LedSet lit, bool refresh);
  void report();

  const std::string chip_;
  std::array<Output, kLedCount> outputs_;
  std::thread thread_;

  mutable std::mutex mutex_;  // for what follows; never held while the chip is touched
  std::condition_variable changed_;
  LedSet lit_;
  bool stop_requested_ = false;
  LedStatus status_;
};

}  // namespace hapticd::drivers
