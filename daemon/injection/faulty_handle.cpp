// SPDX-License-Identifier: Apache-2.0
#include "daemon/injection/faulty_handle.h"

#include <chrono>
#include <limits>

#include "daemon/injection/fault_injector.h"
#include "drivers/base/start_thread.h"

namespace hapticd::daemon {
namespace {

/// Short enough to relay every measurement and command of a 1 kHz loop.
constexpr std::chrono::microseconds kRelayPeriod{250};
constexpr double kLeap_m = 0.5;

}  // namespace

config::Result<void> FaultyHandle::start(drivers::HandleChannels& channels) {
  if (auto started = handle_->start(inner_); !started) return started;
  auto thread = drivers::startThread("handle-faults", [this, &channels] { relay(channels); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void FaultyHandle::stop() {
  stop_.raise();
  if (thread_.joinable()) thread_.join();
  handle_->stop();
}

void FaultyHandle::relay(drivers::HandleChannels& outer) {
  const auto relayOnce = [&] {
    if (outer.command.refresh()) inner_.command.write(asAnsweredTo(outer.command.front()));
    if (inner_.state.refresh()) pass(inner_.state.front(), outer);
  };
  auto due = std::chrono::steady_clock::now();
  do {
    relayOnce();
    due += kRelayPeriod;
  } while (!stop_.waitUntil(due));
  relayOnce();
}

/// The device does not know that it was unplugged, so its own session number has not changed.
rt::HandleCommand FaultyHandle::asAnsweredTo(rt::HandleCommand command) const {
  command.session -= replugs_;
  return command;
}

void FaultyHandle::pass(const rt::HandleState& measured, drivers::HandleChannels& outer) {
  if (faults_.isOn(Fault::handle_muted)) return;
  const bool was_unplugged = unplugged_;
  unplugged_ = faults_.isOn(Fault::handle_unplugged);
  if (unplugged_) return;
  if (was_unplugged) ++replugs_;
  rt::HandleState state = measured;
  state.session += replugs_;
  if (faults_.isOn(Fault::handle_leap)) state.position_m_in_world.x += kLeap_m;
  if (faults_.isOn(Fault::nan_pose)) state.position_m_in_world.y = std::numeric_limits<double>::quiet_NaN();
  outer.state.write(state);
}

}  // namespace hapticd::daemon
