// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/service_methods.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "daemon/control/call_fields.h"
#include "daemon/control/interface_texts.h"

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

void getInfo(const Call&, const Caller& caller, Replies& replies) {
  OrderedJson names = OrderedJson::array();
  for (const Interface& interface : interfaces()) names.push_back(interface.name);
  replies.finish(caller.connection, {"",
                                     {{"vendor", "hapticd"},
                                      {"product", "hapticd"},
                                      {"version", kProductVersion},
                                      {"url", kProductUrl},
                                      {"interfaces", std::move(names)}}});
}

void getInterfaceDescription(const Call& call, const Caller& caller, Replies& replies) {
  const auto name = requiredText(call, "interface");
  if (!name) return replies.finish(caller.connection, name.error());
  const Interface* interface = findInterface(*name);
  if (!interface) return replies.finish(caller.connection, interfaceNotFound(*name));
  replies.finish(caller.connection, {"", {{"description", interface->text}}});
}

}  // namespace

std::vector<Method> serviceMethods() {
  return {{.name = "org.varlink.service.GetInfo", .answer = getInfo},
          {.name = "org.varlink.service.GetInterfaceDescription",
           .parameters = {"interface"},
           .answer = getInterfaceDescription}};
}

Reply unknownMethod(const std::string& method) {
  const std::size_t dot = method.rfind('.');
  const std::string interface = method.substr(0, dot == std::string::npos ? 0 : dot);
  if (dot == std::string::npos || findInterface(interface)) {
    return {"org.varlink.service.MethodNotFound", {{"method", method}}};
  }
  return interfaceNotFound(interface);
}

}  // namespace hapticd::daemon
