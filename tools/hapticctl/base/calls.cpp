// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/calls.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>

#include "config/settings/settings.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {

ClientResult<VarlinkClient> connectTo(const CommandOptions& options, bool may_change) {
  if (!options.socket.empty()) return VarlinkClient::connect(options.socket);
  const char* environment = std::getenv("HAPTICD_SOCKET");
  if (environment && *environment) return VarlinkClient::connect(environment);

  const config::ControlSettings defaults;
  auto client = VarlinkClient::connect(defaults.control_socket);
  if (client || may_change) return client;
  auto status_client = VarlinkClient::connect(defaults.status_socket);
  const bool control_is_missing = client.error().system_error == ENOENT;
  const bool both_are_missing =
      control_is_missing && !status_client && status_client.error().system_error == ENOENT;
  return status_client || (control_is_missing && !both_are_missing) ? std::move(status_client)
                                                                    : std::move(client);
}

ClientResult<Json> callOnce(const CommandOptions& options, const Call& call) {
  auto client = connectTo(options, call.may_change);
  if (!client) return std::unexpected(client.error());
  return client->call(call.method, call.parameters, call.limit, call.descriptor);
}

void printJson(const Json& document) {
  fmt::print("{}\n", document.dump(2, ' ', false, Json::error_handler_t::replace));
}

void printJsonLine(const Json& document) {
  fmt::print("{}\n", document.dump(-1, ' ', false, Json::error_handler_t::replace));
}

void showNames(const Json& document, const std::string& list, bool json) {
  if (!json) {
    fmt::print("{}", namesText(document, list.c_str()));
    return;
  }
  Json names = Json::array();
  for (const Json& item : listAt(document, list.c_str())) names.push_back(textAt(item, "name"));
  printJson(names);
}

int printNames(const CommandOptions& options, const Call& call, const std::string& list) {
  const auto reply = callOnce(options, call);
  if (!reply) return report(reply.error(), options.json);
  showNames(*reply, list, options.json);
  return kOk;
}

int callAndPrint(const CommandOptions& options, const Call& call,
                 const std::function<std::string(const Json& reply)>& text, const Json& said) {
  auto reply = callOnce(options, call);
  if (!reply) return report(reply.error(), options.json);
  if (options.json) {
    reply->update(said);
    printJson(*reply);
  } else {
    fmt::print("{}", fitted(text(*reply), terminalSize().columns));
  }
  return kOk;
}

bool mayPass(const ClientError& error) {
  using Kind = ClientError::Kind;
  if (error.kind != Kind::error_reply) return true;
  return error.what == "io.hapticd.Status.TooManyConnections";
}

bool Reconnection::waited(std::chrono::milliseconds wait) const {
  const Clock::time_point end = Clock::now() + wait;
  if (end > deadline_) return false;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0) return true;
    pollfd signal{signals_, POLLIN, 0};
    if (::poll(&signal, 1, static_cast<int>(left.count())) > 0 && !goesOn_()) return false;
  }
}

int takeSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGWINCH, SIGTSTP}) sigaddset(&signals, number);
  ::sigprocmask(SIG_BLOCK, &signals, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
  return ::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
}

int nextSignal(int descriptor) {
  signalfd_siginfo signal{};
  return ::read(descriptor, &signal, sizeof signal) == sizeof signal ? static_cast<int>(signal.ssi_signo) : 0;
}

}  // namespace hapticd::tools
