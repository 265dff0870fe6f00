// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/base/rate_choice.h"
#include "rt/loop/loop_state.h"
#include "tools/hapticd-ros/box/box_view.h"
#include "tools/hapticd-ros/commands/box_commands.h"
#include "tools/hapticd-ros/dds/publisher.h"
#include "tools/hapticd-ros/status_file.h"
#include "tools/lib/ros/tick_messages.h"
#include "tools/lib/ros/utc_clock.h"

namespace hapticd::tools::ros {

struct BridgeOptions {
  std::string socket;
  std::string name_space = "hapticd";
  int rate_hz = 250;  ///< of positions, velocities and forces, 1..1000
};

/// Reads a hapticd that may come and go, and publishes what it does.
/// Thread: main.
class RosBridge {
 public:
  /// box: kept up to date. status: written once a second. interrupt: a descriptor that becomes readable when
  /// the bridge is to end. All outlive the bridge.
  RosBridge(Publications& publications, BridgeOptions options, BoxState& box, StatusFile& status,
            int interrupt);

  /// Returns when it is to end.
  void run();

 private:
  /// Publishes until the link fails; the reason, or nothing when the bridge is to end.
  std::optional<ClientError> follow();
  std::optional<ClientError> followTicks(BoxLink& link);
  void takeBatch(const Json& reply);
  void takeTick(const rt::Tick& tick);
  OperatingState stateAt(const rt::Tick& tick);
  void publishMotion(const rt::Tick& tick);
  void publishState(const OperatingState& state, std::int64_t utc_ns);
  /// What is due once a second.
  std::optional<ClientError> reportOncePerSecond(BoxLink& link);
  void publishDiagnostics(const Json& status, const std::string& problem);
  void publishFrames(const Json& calibration, const Json& parameters);
  void beAbsent(const ClientError& reason);
  /// Returns false when the bridge is to end.
  bool pause() const;
  std::string framePrefix() const { return options_.name_space + "/"; }
  /// Of all poses, velocities and forces.
  trace::ros::Header at(std::int64_t utc_ns) const { return {utc_ns, world_frame_}; }

  Publications& publications_;
  BridgeOptions options_;
  BoxState& box_;
  StatusFile& status_;
  int interrupt_;
  std::string world_frame_;
  rt::RateChoice choice_;
  UtcClock utc_;
  BridgeCounters counters_;
  std::uint64_t ticks_lost_before_ = 0;  // by streams that have ended
  std::uint64_t ticks_lost_now_ = 0;     // by this one
  std::int64_t next_report_ns_ = 0;      // CLOCK_MONOTONIC
  bool box_was_said_absent_ = false;
  bool write_problem_was_said_ = false;

  // of the present link to hapticd
  std::optional<OperatingState> state_;
  TickMessages messages_;
  std::vector<trace::ros::FixedFrame> frames_;
};

}  // namespace hapticd::tools::ros
