// SPDX-License-Identifier: Apache-2.0
// The force when the box stops: no process shows it, so the RunningBox itself is tested.

#include <gtest/gtest.h>

#include "config/settings.h"
#include "daemon/running_box.h"
#include "tests/support/program.h"

namespace hapticd::daemon {
namespace {

/// A hand that presses on a plane 1 m away.
config::Settings pressing() {
  config::Settings settings;
  settings.camera.driver = config::CameraDriver::synthetic;
  settings.synthetic.scene = config::SyntheticScene::plane;
  settings.synthetic.noise = config::SyntheticNoise::off;
  settings.handle.simulated.start_m_in_world = {0, 0, -0.97};
  settings.handle.simulated.travel_m = 0.02;
  settings.force.law = rt::ForceLaw::nearest_springs;
  settings.live.safety.handle_timeout_s = 1;
  settings.live.safety.depth_timeout_s = 5;
  settings.live.safety.engage_inside = true;
  settings.live.safety.overrun_burst = 65;
  settings.live.safety.max_slew_n_per_s = 500;
  settings.control.engage_at_start = true;
  return settings;
}

TEST(StopForce, GoesToZeroWithinTheSlewLimitBeforeTheLoopEnds) {
  const config::Settings settings = pressing();
  RunningBox box(settings);
  std::vector<rt::Vec3> forces;
  const auto keep = [&forces](const rt::Tick& tick) { forces.push_back(tick.command_force_n_in_world); };
  ASSERT_TRUE(box.start());
  ASSERT_TRUE(test::becomesTrue([&] {
    box.drainTicks(keep);
    return !forces.empty() && norm(forces.back()) > 1;
  }));
  box.stop();
  box.drainTicks(keep);

  EXPECT_EQ(forces.back(), rt::Vec3{});
  // Above: 1 N and more; at 500 N/s for the 1 ms of a tick it takes at least 2 ticks to zero.
  const double step_n = settings.live.safety.max_slew_n_per_s / settings.loop.rate_hz;
  double largest_step_n = 0;
  for (std::size_t i = 1; i < forces.size(); ++i) {
    largest_step_n = std::max(largest_step_n, norm(forces[i] - forces[i - 1]));
  }
  EXPECT_LE(largest_step_n, step_n * (1 + 1e-9));   // rounding of a double
  EXPECT_EQ(box.status().trace_ticks_dropped, 0U);  // otherwise a step could have been missed
}

}  // namespace
}  // namespace hapticd::daemon
