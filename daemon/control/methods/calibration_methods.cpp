// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/methods/methods.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <functional>
#include <utility>

#include "daemon/control/base/method_context.h"
#include "daemon/state/profile_folder.h"

namespace hapticd::daemon {
namespace {

constexpr const char* kFailed = "io.hapticd.Control.CalibrationFailed";

std::string utcNow() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

bool isPose(const Json& json) {
  return poseFrom(json).has_value();
}

/// The registration that a call requests; nothing if it requests none.
std::optional<Registration> registrationOf(const Call& call) {
  const Json* const pose = field(call, "cameraPose");
  if (!pose) return std::nullopt;
  return Registration{*poseFrom(*pose), optionalNumber(call, "residualM"), utcNow()};
}

}  // namespace

CalibrationMethods::CalibrationMethods(MethodContext& context, StateWorker& worker,
                                       const CalibrationAtStart& at_start)
    : context_(context), worker_(worker), at_start_(at_start), registered_(at_start.registration) {}

std::vector<Method> CalibrationMethods::methods() {
  using Self = CalibrationMethods;
  return {methodOf(this, "io.hapticd.Status.GetCalibration", &Self::getCalibration),
          methodOf(this, "io.hapticd.Control.SetCalibration", &Self::setCalibration,
                   {{"cameraPose", isPose}, {"residualM", isNumber}})};
}

const rt::PoseParameters& CalibrationMethods::poseOf(const std::optional<Registration>& registration) const {
  return registration ? registration->T_world_camera : at_start_.configured_T_world_camera;
}

bool CalibrationMethods::waits() const {
  return !same(poseOf(registered_), poseOf(at_start_.registration));
}

std::vector<std::string> CalibrationMethods::warnings() const {
  if (!waits()) return {};
  return {"a new pose of the camera takes effect at the next start only (systemctl restart hapticd)"};
}

Answer CalibrationMethods::getCalibration(const Call&, const Caller&) {
  const auto text = [this](const std::string& time) {
    return registered_ && !time.empty() ? OrderedJson(time) : OrderedJson();
  };
  const bool has_residual = registered_ && registered_->residual_m;
  return Reply{"",
               {{"calibration",
                 {{"cameraPose", poseJson(context_.box.settings().camera.pose())},
                  {"source", at_start_.registration ? "registration" : "configuration"},
                  {"waiting", waits() ? poseJson(poseOf(registered_)) : OrderedJson()},
                  {"residualM", has_residual ? OrderedJson(*registered_->residual_m) : OrderedJson()},
                  {"time", text(registered_ ? registered_->time : "")}}}}};
}

Answer CalibrationMethods::setCalibration(const Call& call, const Caller& caller) {
  const auto registration = registrationOf(call);
  const auto residual = optionalNumber(call, "residualM");
  if (residual && !(registration && *residual >= 0)) return invalidParameter("residualM");
  if (registration) {
    const auto problems = problemsOf(registration->T_world_camera, context_.box.settings());
    if (!problems.empty()) return failed(kFailed, textOf(problems));
  }
  if (context_.pending.full(Access::control)) return failed(kFailed, PendingAnswers::kFullReason);
  using Outcome = base::Result<void>;
  auto writing = worker_.run([folder = context_.box.settings().state.folder, registration] {
    return writeRegistration(folder, registration);
  });
  const auto reply = [this, caller, registration](const Outcome& done) {
    if (!done) return failed(kFailed, done.error().text());
    return written(caller, registration);
  };
  return Later{PendingAnswers::Unawaited::finish, whenReady<Outcome>(std::move(writing), reply)};
}

Reply CalibrationMethods::written(const Caller& caller, const std::optional<Registration>& registration) {
  const std::string old_pose = textOf(poseOf(registered_));
  registered_ = registration;
  const std::string new_pose = textOf(poseOf(registered_));
  logChange(context_, caller,
            registration ? fmt::format("registers the camera's pose {}", new_pose)
                         : fmt::format("takes the camera's pose from the configuration again, {}", new_pose),
            config::EventKind::calibration, {{"OLD", old_pose}, {"NEW", new_pose}});
  return {"", {{"restartRequired", waits()}}};
}

}  // namespace hapticd::daemon
