// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"
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

/// A Novint Falcon.
struct FalconHandleSettings {
  std::string firmware;       ///< path of the firmware image
  double force_share = 0.25;  ///< fraction of the motor counts per newton that other drivers send
};

// Columns: as those of the table (config/settings/parameter_table.cpp).
// clang-format off
inline constexpr auto kFalconHandleRows = std::to_array<config::Parameter>({
    config::row<HAPTICD_OWN_MEMBER(handle, FalconHandleSettings, firmware)>(
        "falcon_handle.firmware", config::Effect::restart, "", {}, "",
        "path of the firmware image, which is licensed by Novint and not part of hapticd"),
    config::row<HAPTICD_OWN_MEMBER(handle, FalconHandleSettings, force_share)>(
        "falcon_handle.force_share", config::Effect::restart, "", {0.01, 1}, "",
        "fraction of the motor counts per newton that other drivers send; calibrate with a scale before raising it"),
});
// clang-format on

inline constexpr config::HandleDriver kFalconHandle{
    .word = "falcon",
    .help = "a Novint Falcon, whose firmware image is Novint's and not part of hapticd",
    .parameters = kFalconHandleRows,
    .position_step_m = 4e-5,  // a count turns a thigh of 60 mm by 0.64 mrad
    .check =
        [](const config::Settings& settings, std::vector<config::Conflict>& conflicts) {
          if (settings.handle.driver != "falcon" ||
              !settings.handle.of<FalconHandleSettings>().firmware.empty())
            return;
          config::addConflict(conflicts, {"falcon_handle.firmware", "handle.driver"},
                              "is empty, and the handle.driver falcon needs it",
                              "set falcon_handle.firmware to the path of the image in Novint's driver");
        },
    .needs =
        [](const config::HandleSettings& handle) {
          return std::vector<config::Need>{
              config::FileNeed{.noun = "firmware",
                               .path = handle.of<FalconHandleSettings>().firmware,
                               .remedy = "put the device's firmware there and set falcon_handle.firmware"},
              config::UsbNeed{"Falcon", "0403", "cb48", "plug it in, and its own power supply"}};
        }};

std::unique_ptr<Handle> makeFalconHandle(const config::HandleSettings& settings,
                                         const rt::HandleScaleParameters& scale,
                                         const HandleThreadPolicy& policy);

}  // namespace hapticd::drivers
