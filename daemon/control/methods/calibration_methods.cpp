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

/// The registration that a call requests; nothing if it requests none.
Field<Registration> registrationOf(const Call& call) {
  const Json* const pose = field(call, "cameraPose");
  const Json* const residual = field(call, "residualM");
  const bool good_residual = !residual || (pose && residual->is_number() && residual->get<double>() >= 0 &&
                                           std::isfinite(residual->get<double>()));
  if (!good_residual) return std::unexpected(invalidParameter("residualM"));
  if (!pose) return std::nullopt;
  const auto T_world_camera = poseFrom(*pose);
  if (!T_world_camera) return std::unexpected(invalidParameter("cameraPose"));
  Registration registration{*T_world_camera, {}, utcNow()};
  if (residual) registration.residual_m = residual->get<double>();
  return registration;
}

}  // namespace

CalibrationMethods::CalibrationMethods(MethodContext& context, StateWorker& worker,
                                       const CalibrationAtStart& at_start)
    : context_(context), worker_(worker), at_start_(at_start), registered_(at_start.registration) {}

std::vector<Method> CalibrationMethods::methods() {
  using Self = CalibrationMethods;
  return {
      {.name = "io.hapticd.Status.GetCalibration", .answer = std::bind_front(&Self::getCalibration, this)},
      {.name = "io.hapticd.Control.SetCalibration",
       .access = Access::control,
       .parameters = {"cameraPose", "residualM"},
       .answer = std::bind_front(&Self::setCalibration, this)}};
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

void CalibrationMethods::getCalibration(const Call&, const Caller& caller, Replies& replies) {
  const auto text = [this](const std::string& time) {
    return registered_ && !time.empty() ? OrderedJson(time) : OrderedJson();
  };
  const bool has_residual = registered_ && registered_->residual_m;
  replies.finish(caller.connection,
                 {"",
                  {{"calibration",
                    {{"cameraPose", poseJson(context_.box.settings().camera.pose())},
                     {"source", at_start_.registration ? "registration" : "configuration"},
                     {"waiting", waits() ? poseJson(poseOf(registered_)) : OrderedJson()},
                     {"residualM", has_residual ? OrderedJson(*registered_->residual_m) : OrderedJson()},
                     {"time", text(registered_ ? registered_->time : "")}}}}});
}

void CalibrationMethods::setCalibration(const Call& call, const Caller& caller, Replies& replies) {
  const auto registration = registrationOf(call);
  if (!registration) return replies.finish(caller.connection, registration.error());
  if (*registration) {
    const auto problems = problemsOf((*registration)->T_world_camera, context_.box.settings());
    if (!problems.empty()) return replies.finish(caller.connection, failed(kFailed, textOf(problems)));
  }
  if (context_.pending.full(Access::control)) {
    return replies.finish(caller.connection, failed(kFailed, PendingAnswers::kFullReason));
  }
  write(call, caller, replies, *registration);
}

void CalibrationMethods::write(const Call& call, const Caller& caller, Replies& replies,
                               const std::optional<Registration>& registration) {
  using Outcome = base::Result<void>;
  auto writing = worker_.run([folder = context_.box.settings().state.folder, registration] {
    return writeRegistration(folder, registration);
  });
  const auto reply = [this, caller, registration](const Outcome& done) {
    if (!done) return failed(kFailed, done.error().text());
    return written(caller, registration);
  };
  context_.pending.add(call, caller, replies, PendingAnswers::Unawaited::finish,
                       whenReady<Outcome>(std::move(writing), reply));
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
