// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/control_service.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/control/base/interface_texts.h"
#include "daemon/control/base/method_context.h"

namespace hapticd::daemon {
namespace {

struct Interface {
  std::string_view name;
  std::string_view text;
};

const std::array<Interface, 3>& interfaces() {
  static const std::array<Interface, 3> all{{{"org.varlink.service", kServiceInterfaceText},
                                             {"io.hapticd.Status", kStatusInterfaceText},
                                             {"io.hapticd.Control", kControlInterfaceText}}};
  return all;
}

const Interface* findInterface(std::string_view name) {
  const auto found = std::ranges::find(interfaces(), name, &Interface::name);
  return found == interfaces().end() ? nullptr : &*found;
}

Reply interfaceNotFound(std::string_view name) {
  return {"org.varlink.service.InterfaceNotFound", {{"interface", name}}};
}

Answer getInfo(const Call&, const Caller&) {
  OrderedJson names = OrderedJson::array();
  for (const Interface& interface : interfaces()) names.push_back(interface.name);
  return Reply{"",
               {{"vendor", "hapticd"},
                {"product", "hapticd"},
                {"version", kProductVersion},
                {"url", kProductUrl},
                {"interfaces", std::move(names)}}};
}

Answer getInterfaceDescription(const Call& call, const Caller&) {
  const std::string name = requiredText(call, "interface");
  const Interface* const interface = findInterface(name);
  if (!interface) return interfaceNotFound(name);
  return Reply{"", {{"description", interface->text}}};
}

/// The methods of org.varlink.service.
std::vector<Method> serviceMethods() {
  return {{.name = "org.varlink.service.GetInfo", .answer = getInfo},
          {.name = "org.varlink.service.GetInterfaceDescription",
           .parameters = {{"interface", isText, MethodParameter::required}},
           .answer = getInterfaceDescription}};
}

/// The error for a call of an unknown method; its interface may be what is unknown.
Reply unknownMethod(const std::string& method) {
  const std::size_t dot = method.rfind('.');
  const std::string interface = method.substr(0, dot == std::string::npos ? 0 : dot);
  if (dot == std::string::npos || findInterface(interface)) {
    return {"org.varlink.service.MethodNotFound", {{"method", method}}};
  }
  return interfaceNotFound(interface);
}

}  // namespace

ControlService::ControlService(Box& box, const ControlServiceOptions& options)
    : context_{box, options.apply_timeout, options.log},
      monitors_(box),
      snapshots_(box),
      depth_(box),
      parameters_(context_),
      additions_(context_),
      frames_(context_),
      forces_(context_),
      hand_(context_),
      traces_(context_),
      profiles_(context_, worker_),
      calibration_(context_, worker_, options.calibration),
      reloads_(context_, options.reloads),
      solids_(context_, worker_),
      undo_(context_) {
  for (auto&& theme :
       {serviceMethods(), monitors_.methods(), ticks_.methods(), events_.methods(), snapshots_.methods(),
        depth_.methods(), parameters_.methods(), additions_.methods(), frames_.methods(), forces_.methods(),
        hand_.methods(), traces_.methods(), profiles_.methods(), calibration_.methods(), reloads_.methods(),
        solids_.methods(), undo_.methods()}) {
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
  if (const auto refusal = refusalOf(*method, call)) return replies.finish(id, *refusal);
  if (method->stream) return method->stream(call, caller, replies);
  Answer answer = method->answer(call, caller);
  if (auto* const later = std::get_if<Later>(&answer)) {
    context_.pending.add(call, caller, replies, later->unawaited, std::move(later->poll));
  } else {
    replies.finish(id, std::get<Reply>(answer));
  }
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
  frames_.closed(connection);
  forces_.closed(connection);
  hand_.closed(connection);
}

std::vector<std::string> ControlService::warnings() const {
  std::vector<std::string> list = calibration_.warnings();
  frames_.addWarnings(list);
  forces_.addWarnings(list);
  hand_.addWarnings(list);
  return list;
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
