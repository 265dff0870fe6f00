// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <thread>

#include "drivers/base/stop_signal.h"
#include "drivers/handle/handle.h"

namespace hapticd::daemon {

class FaultInjector;

/// Wraps a handle, and stops its measurements, makes them leap or replaces them by NaN on their way to the
/// force loop. Commands always reach the device, which shows how the force loop reacts to the fault.
class FaultyHandle final : public drivers::Handle {
 public:
  FaultyHandle(std::unique_ptr<drivers::Handle> handle, const FaultInjector& faults)
      : handle_(std::move(handle)), faults_(faults) {}
  ~FaultyHandle() override { stop(); }

  config::Result<void> start(drivers::HandleChannels& channels) override;
  /// Passes the force loop's last command on before it stops, as without faults.
  void stop() override;
  drivers::HandleStatus status() const override { return handle_->status(); }

 private:
  void relay(drivers::HandleChannels& outer);
  rt::HandleCommand asAnsweredTo(rt::HandleCommand command) const;
  void pass(const rt::HandleState& measured, drivers::HandleChannels& outer);

  std::unique_ptr<drivers::Handle> handle_;
  const FaultInjector& faults_;
  drivers::HandleChannels inner_;
  drivers::StopSignal stop_;
  std::thread thread_;
  std::uint64_t replugs_ = 0;
  bool unplugged_ = false;
};

}  // namespace hapticd::daemon
