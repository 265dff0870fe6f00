// SPDX-License-Identifier: Apache-2.0
// Data from a client of the control API: any bytes are a call or not, and a call gets at most one final
// reply, which is a message within the size limit.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/control/control_service.h"
#include "daemon/control/server/varlink_message.h"
#include "daemon/running_box.h"
#include "tests/fuzz/seeds.h"

namespace {

using hapticd::daemon::Access;
using hapticd::daemon::Call;
using hapticd::daemon::Caller;
using hapticd::daemon::ConnectionId;
using hapticd::daemon::ControlService;
using hapticd::daemon::Json;
using hapticd::daemon::Reply;

/// Accepts and checks every reply.
class Client final : public hapticd::daemon::Replies {
 public:
  void finish(ConnectionId, const Reply& reply) override {
    if (!open) return;
    check(reply);
    require(!reply.continues);
    open = false;
  }
  bool offer(ConnectionId, const Reply& reply) override {
    if (!open) return false;
    check(reply);
    require(reply.continues && reply.error.empty());
    return true;
  }

  bool open = false;

  static void check(const Reply& reply) {
    const std::string message = hapticd::daemon::serialise(reply);
    require(message.size() <= hapticd::daemon::kMaxReplyBytes && message.back() == '\0');
    require(message.find('\0') == message.size() - 1);
    const Json json = Json::parse(message.begin(), message.end() - 1, nullptr, false);
    require(json.is_object() && json["parameters"].is_object());
  }
};

/// A folder for files that cannot exist.
hapticd::config::Settings settings() {
  hapticd::config::Settings settings;
  settings.state.folder = "/dev/null/none";
  return settings;
}

/// A call as a client sends it. `more`: further members of the message.
std::string call(const std::string& method, const std::string& parameters = "{}",
                 const std::string& more = "") {
  return R"({"method":")" + method + R"(","parameters":)" + parameters + more + "}" + '\0';
}

std::string status(const std::string& method, const std::string& parameters = "{}",
                   const std::string& more = "") {
  return call("io.hapticd.Status." + method, parameters, more);
}

std::string control(const std::string& method, const std::string& parameters = "{}") {
  return call("io.hapticd.Control." + method, parameters);
}

}  // namespace

std::vector<std::string> seeds() {
  return {
      call("org.varlink.service.GetInfo"),
      call("org.varlink.service.GetInterfaceDescription", R"({"interface":"io.hapticd.Status"})"),
      call("io.nobody.Method") + status("Nope") + call("Nope"),
      "{\"method\":\"io.hapticd.Status.\\u0000\\ud83d\\ude00\u00e4\"}",
      status("GetStatus", "null"),
      status("GetStatus", R"({"x":[[[[[[[[[[[[[{}]]]]]]]]]]]]]})"),
      status("GetStatus", "{}", R"(,"upgrade":true)"),
      status("GetStatus", "{}", R"(,"oneway":true)") +
          status("GetStatus", "{}", R"(,"oneway":false,"more":false)"),
      status("Monitor", "{}", R"(,"oneway":true,"more":true)"),
      status("Monitor", R"({"intervalMs":20,"fields":["mode","tick.hipMInWorld.x","handle.link.sent"]})",
             R"(,"more":true)"),
      control("Engage") + status("Events", R"({"kinds":["engage","mode"]})", R"(,"more":true)"),
      status("GetSnapshot", "{}", R"(,"more":true)"),
      status("GetParameters"),
      status("GetParameters", R"({"names":["force.radius_m","force.law"]})"),
      control("SetParameters", R"({"parameters":{"force.stiffness_n_per_m":800,"force.min_points":7,
                                                 "force.law":"proxy"}})"),
      control("SetParameters", R"({"parameters":{"force.radius_m":-1e400,"camera.near_m":0.5,
                                                 "a.b":[null,true,{}],"force.min_points":18446744073709551615}})"),
      control("Engage", R"({"insideSurface":true})") + control("Disengage") + control("ClearFault"),
      status("GetCalibration") +
          control("SetCalibration", R"({"cameraPose":{"xM":1,"yM":-2.5,"zM":1e-3,"rollRad":0,"pitchRad":3.2,
                                                      "yawRad":-1},"residualM":0.001})"),
      control("StartTrace", R"({"label":"a-b_c.d","depth":false})") + control("StopTrace") +
          control("DumpTrace") + control("DeleteTrace", R"({"name":"trace-1"})") + status("ListTraces"),
      status("ListProfiles"),
      status("GetSolid", R"({"solid":"e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"})"),
      control("SaveProfile", R"({"name":"a"})"),
      control("LoadProfile", R"({"name":"../a"})"),
      control("DeleteProfile", R"({"name":"a"})"),
      control("SetBootProfile", R"({"name":null})"),
  };
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static hapticd::daemon::RunningBox box(
      settings());  // without its threads, so that all depends on the bytes
  static ControlService service(box, {});
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const Caller caller{.connection = 2, .access = Access::control, .uid = 1000, .pid = 1, .sees_depth = true};
  Client client;
  std::size_t begin = 0;
  while (begin <= bytes.size()) {  // as over a socket: messages, each ended by a NUL
    const std::size_t end = std::min(bytes.find('\0', begin), bytes.size());
    const auto call = hapticd::daemon::parseCall(bytes.substr(begin, end - begin));
    begin = end + 1;
    if (!call) {
      Client::check(hapticd::daemon::malformedCall(call.error()));
      break;
    }
    require(!(call->oneway && call->more) && call->parameters.is_object());
    client.open = !call->oneway;
    service.handle(*call, caller, client);
    service.periodic(client);
    if (client.open) break;  // a stream or a file: whatever follows it waits
  }
  service.closed(caller.connection);
  client.open = false;
  service.periodic(client);
  return 0;
}
