// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/simulated/simulated_handle.h"

#include <gtest/gtest.h>

#include <memory>

#include "drivers/make_handle.h"
#include "frame_collector.h"
#include "rt/clock.h"

namespace hapticd::drivers {
namespace {

TEST(SimulatedHandle, PublishesMeasurementsInOrderThatMoveAlongTheApproach) {
  const auto channels = std::make_unique<HandleChannels>();
  SimulatedHandle handle({});
  EXPECT_EQ(handle.status().state, HandlePresence::absent);
  ASSERT_TRUE(handle.start(*channels));
  EXPECT_EQ(handle.status().state, HandlePresence::present);
  std::uint64_t sequence = 0;
  std::int64_t time_ns = 0;
  double z = -0.8;
  int measurements = 0;
  ASSERT_TRUE(test::eventually([&] {
    if (!channels->state.refresh()) return false;
    const rt::HandleState& state = channels->state.front();
    EXPECT_GT(state.sequence, sequence);
    EXPECT_GE(state.time_ns, time_ns);
    EXPECT_LE(state.position_m_in_world.z, z);  // the first 4 s of the script
    sequence = state.sequence;
    time_ns = state.time_ns;
    z = state.position_m_in_world.z;
    return ++measurements >= 100;
  }));
  handle.stop();
  EXPECT_EQ(handle.status().state, HandlePresence::absent);
  EXPECT_LT(z, -0.8);
}

TEST(SimulatedHandle, ExertsTheNewestCommandAndNothingAfterStop) {
  const auto channels = std::make_unique<HandleChannels>();
  SimulatedHandle handle({});
  ASSERT_TRUE(handle.start(*channels));
  std::uint64_t tick = 0;
  const auto commandUntil = [&](std::uint64_t session, auto condition) {
    return test::eventually([&] {
      channels->command.write({{0, 3, 4}, ++tick, session, rt::monotonicNow_ns()});
      return condition();
    });
  };
  EXPECT_TRUE(commandUntil(1, [&] { return handle.exertedForceN() == 5; }));
  EXPECT_TRUE(handle.status().last_hop);
  EXPECT_TRUE(test::eventually([&] { return handle.exertedForceN() == 0; })) << "commands have stopped";
  EXPECT_TRUE(commandUntil(1, [&] { return handle.exertedForceN() == 5; }));
  EXPECT_TRUE(commandUntil(2, [&] { return handle.exertedForceN() == 0; })) << "of another session";
  EXPECT_TRUE(commandUntil(1, [&] {
    channels->state.refresh();
    return handle.exertedForceN() == 5 && channels->state.front().command_latency_ns > 0;
  }));
  handle.stop();
  EXPECT_EQ(handle.exertedForceN(), 0);
  channels->state.refresh();
  EXPECT_FALSE(channels->state.refresh()) << "nothing is published after stop()";
}

TEST(SimulatedHandle, StopsStartsAndStopsAgain) {
  const auto channels = std::make_unique<HandleChannels>();
  SimulatedHandle handle({});
  handle.stop();
  ASSERT_TRUE(handle.start(*channels));
  EXPECT_FALSE(handle.start(*channels)) << "it is running";
  handle.stop();
  handle.stop();
  ASSERT_TRUE(handle.start(*channels));
}

TEST(SimulatedHandle, DoesNotStartWithSettingsThatDescribeNoHand) {
  const auto channels = std::make_unique<HandleChannels>();
  config::SimulatedHandleSettings no_direction;
  no_direction.direction_in_world = {};
  EXPECT_FALSE(SimulatedHandle(no_direction).start(*channels));
  config::SimulatedHandleSettings no_mass;
  no_mass.mass_kg = 0;
  EXPECT_FALSE(SimulatedHandle(no_mass).start(*channels));
}

TEST(MakeHandle, MakesTheDriverThatTheSettingsName) {
  EXPECT_NE(dynamic_cast<SimulatedHandle*>(makeHandle({}, {}).get()), nullptr);
}

}  // namespace
}  // namespace hapticd::drivers
