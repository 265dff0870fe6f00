// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "config/base/value_text.h"
#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"
#include "drivers/handle/command_gate.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"
#include "drivers/handle/simulated/simulated_hand.h"

namespace hapticd::drivers {

/// Runs a SimulatedHand in real time: one step and one measurement per millisecond. A thread that wakes late
/// makes up for at most kMaxStepsAtOnce missed steps with the newest command; beyond that, simulated time
/// falls behind the clock.
class SimulatedHandle final : public Handle {
 public:
  static constexpr std::int64_t kStepNs = 1'000'000;
  static constexpr std::int64_t kMaxStepsAtOnce = 50;

  explicit SimulatedHandle(const SimulatedHandleSettings& settings, const HandleThreadPolicy& policy = {})
      : settings_(settings), policy_(policy) {}
  ~SimulatedHandle() override { stop(); }

  /// Errors: settings that describe no hand (a mass or stiffness that is not above zero, no direction).
  base::Result<void> check() const override;
  base::Result<void> start(HandleChannels& channels) override;
  void stop() override;
  HandleStatus status() const override;

  /// Returns the magnitude of the force exerted now, in N; 0 while not running.  Thread: any.
  double exertedForceN() const { return exerted_force_n_.load(std::memory_order_relaxed); }

 private:
  void simulate(HandleChannels& channels);

  SimulatedHandleSettings settings_;
  HandleThreadPolicy policy_;
  CommandGate gate_;
  std::atomic<bool> stop_requested_{false};
  std::atomic<bool> running_{false};
  std::atomic<HandleScheduling> scheduling_{HandleScheduling{}};
  std::atomic<double> exerted_force_n_{0};
  std::atomic<std::uint64_t> measurements_{0};
  std::thread thread_;
};

// Columns: as those of the table (config/settings/parameter_table.cpp).
// clang-format off
inline constexpr auto kSimulatedHandleRows = std::to_array<config::Parameter>({
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, script)>(
        "simulated_handle.script", config::Effect::restart, "", {}, "",
        "action of the hand on the surface; mixed: tap, stroke and lean in turn"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, mass_kg)>(
        "simulated_handle.mass_kg", config::Effect::restart, "kg", {0.005, 10}, "",
        "mass of the handle"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, damping_n_s_per_m)>(
        "simulated_handle.damping_n_s_per_m", config::Effect::restart, "N s/m", {0, 100}, "",
        "viscous friction of the handle"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, friction_n)>(
        "simulated_handle.friction_n", config::Effect::restart, "N", {0, 5}, "",
        "dry friction of the handle, along each axis"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, position_quantum_m)>(
        "simulated_handle.position_quantum_m", config::Effect::restart, "m", {0, 0.001}, "",
        "steps of the measured position, which is then interpolated and the velocity estimated from it; 0: exact"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, hand_stiffness_n_per_m)>(
        "simulated_handle.hand_stiffness_n_per_m", config::Effect::restart, "N/m", {1, 5000}, "",
        "stiffness of the hand's grip"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, hand_damping_n_s_per_m)>(
        "simulated_handle.hand_damping_n_s_per_m", config::Effect::restart, "N s/m", {0, 100}, "",
        "damping of the hand's grip"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, start_m_in_world.x)>(
        "simulated_handle.start_x_m", config::Effect::restart, "m", {-10, 10}, "",
        "start position of the hand in the world, x"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, start_m_in_world.y)>(
        "simulated_handle.start_y_m", config::Effect::restart, "m", {-10, 10}, "",
        "start position of the hand in the world, y"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, start_m_in_world.z)>(
        "simulated_handle.start_z_m", config::Effect::restart, "m", {-10, 10}, "",
        "start position of the hand in the world, z"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, direction_in_world.x)>(
        "simulated_handle.direction_x", config::Effect::restart, "", {-1, 1}, "",
        "direction of the approach in the world, x; any length except zero"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, direction_in_world.y)>(
        "simulated_handle.direction_y", config::Effect::restart, "", {-1, 1}, "",
        "direction of the approach in the world, y; any length except zero"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, direction_in_world.z)>(
        "simulated_handle.direction_z", config::Effect::restart, "", {-1, 1}, "",
        "direction of the approach in the world, z; any length except zero"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, travel_m)>(
        "simulated_handle.travel_m", config::Effect::restart, "m", {0.001, 5}, "",
        "distance after which the hand turns back"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, speed_m_per_s)>(
        "simulated_handle.speed_m_per_s", config::Effect::restart, "m/s", {0.001, 2}, "",
        "speed of approach and retreat"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, press_force_n)>(
        "simulated_handle.press_force_n", config::Effect::restart, "N", {0, 40}, "",
        "force at which the hand stops its approach"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, press_s)>(
        "simulated_handle.press_s", config::Effect::restart, "s", {0, 600}, "",
        "time for which the hand strokes or leans on the surface before it retreats"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, stroke_m)>(
        "simulated_handle.stroke_m", config::Effect::restart, "m", {0, 1}, "",
        "amplitude of the stroke across the direction of approach"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, stroke_period_s)>(
        "simulated_handle.stroke_period_s", config::Effect::restart, "s", {0.05, 600}, "",
        "period of the stroke"),
    config::row<HAPTICD_OWN_MEMBER(handle, SimulatedHandleSettings, follows_person)>(
        "simulated_handle.follows_person", config::Effect::restart, "", {}, "",
        "whether a person may lead the hand by MoveHand, as in the picture of hapticd-view --move-hand"),
});
// clang-format on

/// Refuses a direction of approach that would lose digits when it is normalised.
inline void checkSimulatedHandle(const config::Settings& settings, std::vector<config::Conflict>& conflicts) {
  constexpr double kMinDirection = 1e-3;
  const rt::Vec3& direction = settings.handle.of<SimulatedHandleSettings>().direction_in_world;
  if (rt::norm(direction) >= kMinDirection) return;
  config::addConflict(
      conflicts,
      {"simulated_handle.direction_x", "simulated_handle.direction_y", "simulated_handle.direction_z"},
      fmt::format("({}, {}, {}) is not a direction: it is shorter than {}", base::numberText(direction.x),
                  base::numberText(direction.y), base::numberText(direction.z),
                  base::numberText(kMinDirection)),
      "set at least one of direction_x, direction_y and direction_z, as in 0, 0, -1");
}

inline constexpr config::HandleDriver kSimulatedHandle{
    .word = "simulated",
    .help = "a handle in a simulated hand that strokes, taps and leans by itself",
    .parameters = kSimulatedHandleRows,
    .stands_in = true,
    .follows_person =
        [](const config::HandleSettings& handle) {
          return handle.of<SimulatedHandleSettings>().follows_person;
        },
    .device_mass_kg =
        [](const config::HandleSettings& handle) { return handle.of<SimulatedHandleSettings>().mass_kg; },
    .check = checkSimulatedHandle};

std::unique_ptr<Handle> makeSimulatedHandle(const config::HandleSettings& settings,
                                            const rt::HandleScaleParameters& scale,
                                            const HandleThreadPolicy& policy);

}  // namespace hapticd::drivers
