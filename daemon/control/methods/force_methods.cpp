// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <utility>

#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/methods/methods.h"
#include "rt/base/clock.h"
#include "rt/channels/external_force.h"

namespace hapticd::daemon {
namespace {

/// A connection that has fed a force within this time is the only one that may.
constexpr std::chrono::milliseconds kTurn{100};
constexpr double kLife_s = static_cast<double>(rt::kExternalForceLife_ns) * 1e-9;

Reply refused(const char* cause, std::string reason) {
  return {"io.hapticd.Control.ForceRefused", {{"cause", cause}, {"reason", std::move(reason)}}};
}

}  // namespace

std::vector<Method> ForceMethods::methods() {
  return {methodOf(
      this, "io.hapticd.Control.FeedForce", &ForceMethods::feedForce,
      {{"forceNInWorld", isVector, MethodParameter::required}, {"timeNs", isWhole}, {"ageS", isNumber}})};
}

Answer ForceMethods::feedForce(const Call& call, const Caller& caller) {
  const auto time_ns = timeField(call, rt::monotonicNow_ns());
  if (!time_ns) return time_ns.error();
  const auto [x, y, z] = requiredNumbers<3>(call, "forceNInWorld");
  return take({{x, y, z}, *time_ns}, caller);
}

Reply ForceMethods::take(const rt::ExternalForce& force, const Caller& caller) {
  const rt::SafetyParameters& safety = context_.box.settings().live.safety;
  const char* const zero = !(safety.max_external_force_n > 0)   ? "safety.max_external_force_n"
                           : !(safety.max_external_power_w > 0) ? "safety.max_external_power_w"
                                                                : nullptr;
  if (zero != nullptr) {
    return refused("not_allowed", fmt::format("{} is 0, which allows no external force (set it "
                                              "to the most that other programs may add)",
                                              zero));
  }
  if (!std::isfinite(norm(force.force_n_in_world)))
    return refused("not_finite", "the length of the force is no finite number");
  const std::int64_t now_ns = rt::monotonicNow_ns();
  if (force.time_ns > now_ns || force.time_ns <= now_ns - rt::kExternalForceLife_ns) {
    return refused(
        "age",
        fmt::format("the force is {} s old, and one acts for {} s from when it was computed",
                    (static_cast<double>(now_ns) - static_cast<double>(force.time_ns)) * 1e-9, kLife_s));
  }
  const Clock::time_point now = Clock::now();
  if (std::string other = feed_.refusal(caller, now, kTurn); !other.empty())
    return refused("other_sender", std::move(other));
  if (!feed_.allows(now)) return feed_.limited();
  if (!context_.box.feedForce(force))
    return refused("not_engaged", "the box is not engaged, and exerts no force (engage it)");
  if (feed_.used(caller, now))
    logChange(context_, caller, "feeds forces", config::EventKind::force, {{"ACTION", "feed"}});
  return {};
}

}  // namespace hapticd::daemon
