// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/methods/methods.h"
#include "daemon/control/streams/depth_streams.h"
#include "daemon/control/streams/status_streams.h"
#include "daemon/control/streams/tick_streams.h"
#include "daemon/state/state_file.h"

namespace hapticd::daemon {

struct ControlServiceOptions {
  /// Longest time for the force loop to take over a change; then the caller gets NotApplied.
  std::chrono::milliseconds apply_timeout{1000};
  /// Called with an entry for each change, which names the uid of the caller. May be empty.
  std::function<void(const JournalEntry&)> log;
  CalibrationAtStart calibration = {};
  Reloads* reloads = nullptr;  ///< outlives the service; null: there is no configuration to read again
};

/// The interfaces io.hapticd.Status, io.hapticd.Control and org.varlink.service, as the .varlink files of
/// this folder describe them. It dispatches each call to its method, and answers calls of unknown methods
/// with the appropriate error. Thread: control thread only.
class ControlService final : public CallHandler {
 public:
  /// `box` must outlive the service. Files are kept below its setting state.folder.
  ControlService(Box& box, const ControlServiceOptions& options);
  ControlService(const ControlService&) = delete;
  ControlService& operator=(const ControlService&) = delete;

  void handle(const Call& call, const Caller& caller, Replies& replies) override;
  void closed(ConnectionId connection) override;

  /// To be called with every tick of the force loop, for the streams of Monitor and Ticks.
  void onTick(const rt::Tick& tick) {
    monitors_.onTick(tick);
    ticks_.onTick(tick);
  }
  /// To be called with every entry of the journal, for the streams of events.
  void onEvent(const JournalEntry& entry) { events_.add(entry); }
  /// To be called every few milliseconds: sends answers that have become known, and feeds the streams.
  void periodic(Replies& replies);

  /// Warnings for the status that come from calls of this service, each with its remedy.
  std::vector<std::string> warnings() const;
  const FeedStatus& feedStatus() const { return additions_.feedStatus(); }
  /// See FrameMethods::limited().
  const auto& limitedPoses() const { return frames_.limited(); }
  const std::vector<Method>& methods() const { return methods_; }

 private:
  bool mayCall(const Method& method, const Caller& caller) const;

  StateWorker worker_;
  MethodContext context_;
  MonitorStreams monitors_;
  TickStreams ticks_;
  EventStreams events_;
  SnapshotStreams snapshots_;
  DepthStreams depth_;
  ParameterMethods parameters_;
  AdditionMethods additions_;
  FrameMethods frames_;
  ForceMethods forces_;
  HandMethods hand_;
  TraceMethods traces_;
  ProfileMethods profiles_;
  CalibrationMethods calibration_;
  ReloadMethods reloads_;
  SolidMethods solids_;
  UndoMethod undo_;
  std::vector<Method> methods_;
};

}  // namespace hapticd::daemon
