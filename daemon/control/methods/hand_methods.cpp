// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "config/settings/driver_rows.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/methods/methods.h"

namespace hapticd::daemon {
namespace {

/// A connection that has moved the hand within this time is the only one that may.
constexpr std::chrono::seconds kTurn{2};

Reply refused(const char* cause, std::string reason) {
  return {"io.hapticd.Control.HandRefused", {{"cause", cause}, {"reason", std::move(reason)}}};
}

}  // namespace

std::vector<Method> HandMethods::methods() {
  return {methodOf(this, "io.hapticd.Control.MoveHand", &HandMethods::moveHand,
                   {{"targetMInWorld", isVector, MethodParameter::required}})};
}

Answer HandMethods::moveHand(const Call& call, const Caller& caller) {
  const config::HandleSettings& handle = context_.box.settings().handle;
  const config::HandleDriver& driver = config::driverOf(handle);
  if (!driver.follows_person(handle)) {
    return refused("not_allowed",
                   fmt::format("the handle {} follows no person (only a simulated one does, started with "
                               "simulated_handle.follows_person)",
                               driver.word));
  }
  const auto [x, y, z] = requiredNumbers<3>(call, "targetMInWorld");
  const rt::Vec3 target{x, y, z};
  if (!std::isfinite(norm(target)))
    return refused("not_finite", "the target is no place: its distance is not finite (send one in metres)");
  const Clock::time_point now = Clock::now();
  if (std::string other = feed_.refusal(caller, now, kTurn); !other.empty())
    return refused("other_sender", std::move(other));
  if (!feed_.allows(now)) return feed_.limited();
  context_.box.moveHand(target);
  if (feed_.used(caller, now))
    logChange(context_, caller, "leads the simulated hand", config::EventKind::handle, {{"ACTION", "lead"}});
  return Reply{"", Json::object()};
}

}  // namespace hapticd::daemon
