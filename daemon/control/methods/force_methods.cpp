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

/// After this long without a force the next one begins a feed, which is logged.
constexpr std::chrono::seconds kPause{10};
/// A connection that has fed a force within this time is the only one that may.
constexpr std::chrono::milliseconds kTurn{100};
constexpr double kLife_s = static_cast<double>(rt::kExternalForceLife_ns) * 1e-9;

Reply refused(const char* cause, std::string reason) {
  return {"io.hapticd.Control.ForceRefused", {{"cause", cause}, {"reason", std::move(reason)}}};
}

}  // namespace

std::vector<Method> ForceMethods::methods() {
  return {{.name = "io.hapticd.Control.FeedForce",
           .access = Access::control,
           .parameters = {"forceNInWorld", "timeNs", "ageS"},
           .answer = std::bind_front(&ForceMethods::feedForce, this)}};
}

void ForceMethods::feedForce(const Call& call, const Caller& caller, Replies& replies) {
  const auto force_n = numbersField<3>(call, "forceNInWorld");
  const auto time_ns = timeField(call, rt::monotonicNow_ns());
  if (!time_ns) return replies.finish(caller.connection, time_ns.error());
  if (!force_n) return replies.finish(caller.connection, force_n.error());
  if (!*force_n) return replies.finish(caller.connection, invalidParameter("forceNInWorld"));
  const auto& [x, y, z] = **force_n;
  replies.finish(caller.connection, take({{x, y, z}, *time_ns}, caller));
}

Reply ForceMethods::take(const rt::ExternalForce& force, const Caller& caller) {
  const double most_n = context_.box.settings().live.safety.max_external_force_n;
  if (!(most_n > 0)) {
    return refused("not_allowed",
                   "safety.max_external_force_n is 0, which allows no external force "
                   "(set it to the largest force that other programs may add, in newtons)");
  }
  const std::int64_t now_ns = rt::monotonicNow_ns();
  if (force.time_ns > now_ns || force.time_ns <= now_ns - rt::kExternalForceLife_ns) {
    return refused(
        "age",
        fmt::format("the force is {} s old, and one acts for {} s from when it was computed",
                    (static_cast<double>(now_ns) - static_cast<double>(force.time_ns)) * 1e-9, kLife_s));
  }
  const Clock::time_point now = Clock::now();
  const bool first = now - newest_ >= kPause;
  if (now - newest_ < kTurn && sender_ != caller.connection) {
    return refused("other_sender", "another program feeds forces (end it, or wait until it has ended)");
  }
  if (!rate_.allows(now)) return {"io.hapticd.Control.FeedLimited", {{"limit", kMaxPerSecond}}};
  newest_ = now;
  sender_ = caller.connection;
  if (first) logChange(context_, caller, "feeds forces", config::EventKind::force, {{"ACTION", "feed"}});
  context_.box.feedForce(force);
  return {};
}

}  // namespace hapticd::daemon
