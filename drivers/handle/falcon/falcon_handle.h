// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>

#include "config/settings/settings.h"
#include "drivers/base/status_board.h"
#include "drivers/base/stop_signal.h"
#include "drivers/handle/command_gate.h"
#include "drivers/handle/falcon/falcon_firmware.h"
#include "drivers/handle/falcon/falcon_link.h"
#include "drivers/handle/falcon/falcon_tracker.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_frame.h"
#include "drivers/handle/handle_thread.h"

namespace hapticd::drivers {

/// Driver of a Novint Falcon through libusb. The origin of its frame is kFalconCentre_m; its axes are the
/// device's.
///
/// The thread searches for the device once a second, loads its firmware if it has none, asks the person to
/// home it, and then exchanges an order for a reply about 1000 times a second. Forces are zero while the
/// encoders are not homed, while the position is unknown, and while CommandGate lets no command pass. A
/// device that sends no complete reply for kSilenceLimit is lost.
class FalconHandle final : public Handle {
 public:
  static constexpr std::chrono::milliseconds kSilenceLimit{100};
  static constexpr int kMaxLoads = 10;

  FalconHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
               const HandleThreadPolicy& policy = {})
      : settings_(settings), scale_(scale), policy_(policy) {}
  ~FalconHandle() override { stop(); }

  base::Result<void> start(HandleChannels& channels) override;
  void stop() override;
  HandleStatus status() const override;

 private:
  struct Session;

  void run(HandleChannels& channels);
  void useDeviceOnce(HandleChannels& channels);
  base::Result<std::string> ensureFirmware(FtdiPort& port);
  base::Result<void> exchange(Session& session);
  void take(Session& session, const FalconReply& reply);
  void report(Session& session);
  void reportMissing(const base::Error& error);
  std::string identityOf(const std::string& serial) const;

  config::HandleSettings settings_;
  rt::HandleScaleParameters scale_;
  HandleThreadPolicy policy_;
  CommandGate gate_;
  StatusBoard<HandleStatus> board_;
  StopSignal stop_signal_;
  std::thread thread_;

  // accessed by the driver's thread only
  std::optional<HandleFrame> frame_;
  bool seen_ = false;  // the device has been found before
  std::uint64_t measurements_ = 0;
  std::uint64_t rejected_ = 0;
};

}  // namespace hapticd::drivers
