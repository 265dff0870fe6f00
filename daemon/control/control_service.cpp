// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/control_service.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "daemon/control/call_fields.h"
#include "daemon/control/service_methods.h"

namespace hapticd::daemon {
namespace {

/// The first field of the call that the method does not know.
std::optional<std::string> unknownField(const Call& call, const std::vector<std::string_view>& known) {
  for (auto given = call.parameters.begin(); given != call.parameters.end(); ++given) {
    if (std::ranges::find(known, given.key()) == known.end()) return given.key();
  }
  return std::nullopt;
}

}  // namespace

ControlService::ControlService(Box& box, const ControlServiceOptions& options)
    : context_{box, options.apply_timeout, options.log},
      monitors_(box),
      snapshots_(box),
      depth_(box),
      parameters_(context_),
      additions_(context_),
      traces_(context_),
      profiles_(context_, worker_),
      calibration_(context_, worker_, options.calibration),
      reloads_(context_, options.reloads) {
  for (auto&& theme : {serviceMethods(), monitors_.methods(), ticks_.methods(), events_.methods(),
                       snapshots_.methods(), depth_.methods(), parameters_.methods(), additions_.methods(),
                       traces_.methods(), profiles_.methods(), calibration_.methods(), reloads_.methods()}) {
    methods_.insert(methods_.end(), theme.begin(), theme.end());
  }
}

void ControlService::handle(const Call& call, const Caller& caller, Replies& replies) {
  const ConnectionId id = caller.connection;
  const auto method = std::ranges::find(methods_, call.method, &Method::name);
  if (method == methods_.end()) return replies.finish(id, unknownMethod(call.method));
  // Nobody receives what a oneway call reads, so it is not carried out.
  if (call.oneway && method->access == Access::read) return;
  if (!mayCall(*method, caller)) return replies.finish(id, {"org.varlink.service.PermissionDenied"});
  if (call.upgrade) {
    return replies.finish(id, {"org.varlink.service.MethodNotImplemented", {{"method", call.method}}});
  }
  if (method->streams && !call.more) return replies.finish(id, {"org.varlink.service.ExpectedMore"});
  if (const auto unknown = unknownField(call, method->parameters)) {
    return replies.finish(id, invalidParameter(*unknown));
  }
  method->answer(call, caller, replies);
}

bool ControlService::mayCall(const Method& method, const Caller& caller) const {
  if (method.access == Access::control && caller.access != Access::control) return false;
  return !method.shows_depth || caller.sees_depth || context_.box.settings().control.depth_for_everyone;
}

void ControlService::closed(ConnectionId connection) {
  context_.pending.closed(connection);
  monitors_.closed(connection);
  ticks_.closed(connection);
  events_.closed(connection);
  snapshots_.closed(connection);
  depth_.closed(connection);
}

void ControlService::periodic(Replies& replies) {
  additions_.periodic();
  context_.pending.answer(replies);
  snapshots_.feed(replies);
  depth_.feed(replies);
  events_.feed(replies);
  monitors_.feed(replies);
  ticks_.feed(replies);
}

}  // namespace hapticd::daemon
