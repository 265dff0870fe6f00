// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "config/settings/settings.h"
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

  explicit SimulatedHandle(const config::SimulatedHandleSettings& settings,
                           const HandleThreadPolicy& policy = {})
      : settings_(settings), policy_(policy) {}
  ~SimulatedHandle() override { stop(); }

  /// Errors: settings that describe no hand (a mass or stiffness that is not above zero, no direction).
  base::Result<void> start(HandleChannels& channels) override;
  void stop() override;
  HandleStatus status() const override;

  /// Returns the magnitude of the force exerted now, in N; 0 while not running.  Thread: any.
  double exertedForceN() const { return exerted_force_n_.load(std::memory_order_relaxed); }

 private:
  void simulate(HandleChannels& channels);

  config::SimulatedHandleSettings settings_;
  HandleThreadPolicy policy_;
  CommandGate gate_;
  std::atomic<bool> stop_requested_{false};
  std::atomic<bool> running_{false};
  std::atomic<HandleScheduling> scheduling_{HandleScheduling{}};
  std::atomic<double> exerted_force_n_{0};
  std::atomic<std::uint64_t> measurements_{0};
  std::thread thread_;
};

}  // namespace hapticd::drivers
