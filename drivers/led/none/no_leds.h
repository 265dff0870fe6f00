// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/led/led_panel.h"

namespace hapticd::drivers {

/// LED driver of a box without LEDs.
class NoLeds final : public LedPanel {
 public:
  config::Result<void> start() override { return {}; }
  void stop() override {}
  void show(LedSet) override {}
  LedStatus status() const override { return {LedState::none, "", "none", {}}; }
};

}  // namespace hapticd::drivers
