// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/control/base/method_context.h"
#include "daemon/control/server/call_fields.h"
#include "daemon/state/registration.h"
#include "daemon/state/state_worker.h"

namespace hapticd::daemon {

/// The camera's pose at the start of the daemon.
struct CalibrationAtStart {
  rt::PoseParameters configured_T_world_camera;
  std::optional<Registration> registration;  ///< the registration in use instead of the configured pose
};

/// Methods for the camera's pose: the one in use, and the one that takes effect at the next start.
/// Thread: control thread only; the file is written by the worker.
class CalibrationMethods {
 public:
  CalibrationMethods(MethodContext& context, StateWorker& worker, const CalibrationAtStart& at_start);
  std::vector<Method> methods();

  /// A warning that a pose waits for the next start, with its remedy.
  std::vector<std::string> warnings() const;

 private:
  void getCalibration(const Call&, const Caller&, Replies&);
  void setCalibration(const Call&, const Caller&, Replies&);
  void write(const Call&, const Caller&, Replies&, const std::optional<Registration>& registration);
  /// Remembers what was written.
  Reply written(const Caller& caller, const std::optional<Registration>& registration);

  const rt::PoseParameters& poseOf(const std::optional<Registration>& registration) const;
  bool waits() const;

  MethodContext& context_;
  StateWorker& worker_;
  const CalibrationAtStart at_start_;
  std::optional<Registration> registered_;  ///< as it is on the disk
};

}  // namespace hapticd::daemon
