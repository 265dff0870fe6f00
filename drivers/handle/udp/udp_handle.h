// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <thread>

#include "config/settings/settings.h"
#include "drivers/base/status_board.h"
#include "drivers/handle/command_gate.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"
#include "drivers/handle/udp/udp_settings.h"

namespace hapticd::drivers {

/// A handle on another computer, connected by the packets of protocol.md: present while a bridge there sends
/// valid states, lost 100 ms after the last one. Packets from anyone except the configured peer are rejected.
///
/// Packets from others cannot keep a CPU busy, even though the thread may have real-time priority: CpuBudget
/// makes it rest.
class UdpHandle final : public Handle {
 public:
  UdpHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
            const HandleThreadPolicy& policy = {});
  ~UdpHandle() override { stop(); }
  UdpHandle(const UdpHandle&) = delete;
  UdpHandle& operator=(const UdpHandle&) = delete;

  /// Errors: an invalid address or peer, a key file that cannot be used, no thread. An address or port that
  /// is not available yet is not an error: the driver tries again every second.
  base::Result<void> check() const override;
  base::Result<void> start(HandleChannels& channels) override;
  void stop() override;
  HandleStatus status() const override;

 private:
  config::HandleSettings settings_;
  rt::HandleScaleParameters scale_;
  HandleThreadPolicy policy_;
  CommandGate gate_;
  StatusBoard<HandleStatus> board_;
  int stop_event_ = -1;  // eventfd; readable: the thread is to end
  std::thread thread_;
};

std::unique_ptr<Handle> makeUdpHandle(const config::HandleSettings& settings,
                                      const rt::HandleScaleParameters& scale,
                                      const HandleThreadPolicy& policy);

}  // namespace hapticd::drivers
