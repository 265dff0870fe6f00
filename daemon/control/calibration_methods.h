// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/control/method.h"
#include "daemon/control/method_context.h"
#include "daemon/state/registration.h"
#include "daemon/state/state_worker.h"

namespace hapticd::daemon {

/// What the camera's pose was at the start.
struct CalibrationAtStart {
  rt::PoseParameters configured_T_world_camera;
  std::optional<Registration> registration;  ///< that is in use in its place
};

/// The camera's pose: what is in use, and what will be from the next start on.
/// Thread: control thread only; the file is written by the worker.
class CalibrationMethods {
 public:
  CalibrationMethods(MethodContext& context, StateWorker& worker, const CalibrationAtStart& at_start);
  std::vector<Method> methods();

  /// That a pose waits for the next start, and what to do.
  std::vector<std::string> warnings() const;

 private:
  void getCalibration(const Call&, const Caller&, Replies&);
  void setCalibration(const Call&, const Caller&, Replies&);
  void write(const Call&, const Caller&, Replies&, const std::optional<Registration>& registration);
  /// Takes note of what has been written.
  Reply written(const Caller& caller, const std::optional<Registration>& registration);

  const rt::PoseParameters& poseOf(const std::optional<Registration>& registration) const;
  bool waits() const;

  MethodContext& context_;
  StateWorker& worker_;
  const CalibrationAtStart at_start_;
  std::optional<Registration> registered_;  ///< on the disk
};

}  // namespace hapticd::daemon
