#include "tools/hapticctl/error_text.h"

#include <fmt/format.h>

#include <cstdio>
#include <string_view>

#include "tools/hapticctl/reply_reader.h"

namespace hapticd::tools {
namespace {

std::string problemLines(const Json& problems) {
  std::string lines;
  for (const Json& problem : problems) {
    lines += fmt::format("\n  {}: {}", textAt(problem, "parameter"), textAt(problem, "reason"));
  }
  return lines;
}

std::string restartText(const Json& parameters) {
  std::string text = "nothing was changed: these parameters take effect at the next start only";
  for (const Json& name : listAt(parameters, "parameters")) text += "\n  " + valueText(name);
  return text + "\nset them in hapticd's configuration file, then 'systemctl restart hapticd'";
}

std::string replyText(const ClientError& error) {
  const std::string_view name = error.what;
  if (name == "io.hapticd.Control.InvalidValue") {
    return "nothing was changed:" + problemLines(listAt(error.parameters, "problems")) +
           "\n'hapticctl params' shows what is allowed";
  }
  if (name == "io.hapticd.Status.UnknownParameter") {
    return "unknown parameter:" + problemLines(listAt(error.parameters, "problems")) +
           "\n'hapticctl params' lists the names";
  }
  if (name == "io.hapticd.Control.RestartRequired") return restartText(error.parameters);
  if (name == "io.hapticd.Control.Refused") {
    const std::string cause = textAt(error.parameters, "cause");
    if (cause == "inside_surface") {
      return "not engaged: something would be felt at once\n"
             "take the handle out of the surface, or allow it: hapticctl engage --inside";
    }
    return "not engaged: " + cause;
  }
  if (name == "io.hapticd.Control.NotApplied") {
    return "the force loop has not taken over the change in time; it will when it runs again\n"
           "'hapticctl status' shows what holds it up";
  }
  if (name == "org.varlink.service.PermissionDenied") {
    return "this socket is read only\n"
           "use the control socket (--socket /run/hapticd/io.hapticd.Control); members of the group haptic "
           "may";
  }
  const std::string parameters = error.parameters.dump(-1, ' ', false, Json::error_handler_t::replace);
  return fmt::format("hapticd answered {} {}\nis it of another version than hapticctl? See --version",
                     printable(name), printable(parameters));
}

}  // namespace

std::string errorText(const ClientError& error) {
  if (error.kind == ClientError::Kind::error_reply) return replyText(error);
  return error.remedy.empty() ? error.what : error.what + "\n" + error.remedy;
}

int report(const ClientError& error, bool json) {
  const bool reply = error.kind == ClientError::Kind::error_reply;
  if (json && reply) {
    const Json document = {
        {"error", error.what}, {"parameters", error.parameters}, {"message", errorText(error)}};
    fmt::print(stderr, "{}\n", document.dump(-1, ' ', false, Json::error_handler_t::replace));
  } else {
    fmt::print(stderr, "hapticctl: {}\n", errorText(error));
  }
  return reply ? kErrorReply : kNoConnection;
}

}  // namespace hapticd::tools
