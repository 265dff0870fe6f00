// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/error_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include "config/base/program.h"
#include "tools/lib/client/reply_reader.h"

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
  std::string text = "nothing was changed: these parameters take effect only at the next start";
  for (const Json& name : listAt(parameters, "parameters")) text += "\n  " + valueText(name);
  return text + "\nset them in hapticd's configuration file, then 'systemctl restart hapticd'";
}

/// The meaning of errors of the daemon that carry no text of their own.
struct Meaning {
  std::string_view error;
  std::string_view text;
};
constexpr std::array<Meaning, 6> kMeanings{{
    {"io.hapticd.Control.ChangedMeanwhile",
     "nothing was changed: another client has made a change in the meantime\ncheck the new state, then "
     "repeat the command"},
    {"io.hapticd.Control.FeedLimited",
     "refused: more come than the box takes, and the surplus is dropped evenly\nsend at most 500 poses of a "
     "frame, 2000 forces, or 200 samples of stiffness, a second"},
    {"io.hapticd.Control.NotApplied",
     "the force loop has not taken over the change in time; it will when it runs again\n"
     "'hapticctl status' shows why it does not run"},
    {"io.hapticd.Control.NotFaulted",
     "there is no fault to clear\n'hapticctl disengage' ends force, 'hapticctl status' shows the mode"},
    {"io.hapticd.Control.NoPendingReload",
     "no reload waits for confirmation\n'hapticctl reload' reads the configuration again"},
    {"org.varlink.service.PermissionDenied",
     "this socket is read-only\n"
     "use the control socket (--socket /run/hapticd/io.hapticd.Control); members of the group haptic may"},
}};

/// "fixture nerve, radius_m: must be above 0".
std::string additionProblemText(const char* noun, const std::string& name, const Json& problem) {
  const std::string field = textAt(problem, "field");
  return fmt::format("{}{}{}: {}", noun, name.empty() ? "" : " " + name, field == "-" ? "" : ", " + field,
                     textAt(problem, "reason"));
}

/// All problems and what to do about each.
std::string additionText(const char* noun, const Json& parameters) {
  const std::string nothing = "nothing was changed: ";
  const Json& problems = listAt(parameters, "problems");
  const auto remedyOf = [](const Json& problem) {
    const std::string remedy = textAt(problem, "remedy");
    return remedy == "-" ? "" : remedy;
  };
  if (problems.size() < 2) {
    const std::string remedy = remedyOf(parameters);
    return nothing + additionProblemText(noun, textAt(parameters, noun), parameters) +
           (remedy.empty() ? "" : "\n" + remedy);
  }
  std::string text = fmt::format("{}{} problems", nothing, problems.size());
  for (const Json& problem : problems) {
    const std::string remedy = remedyOf(problem);
    text += "\n  " + additionProblemText(noun, textAt(problem, "name"), problem) +
            (remedy.empty() ? "" : " (" + remedy + ")");
  }
  return text;
}

std::string refusalText(const Json& parameters) {
  const std::string cause = textAt(parameters, "cause");
  if (cause == "inside_surface") {
    return "not engaged: the handle would be in contact at once\n"
           "take the handle out of the surface, or allow it: hapticctl engage --inside";
  }
  return "not engaged: " + cause + "\n'hapticctl status' shows what to do about it";
}

std::string connectionsText(const Json& parameters) {
  return fmt::format(
      "too many connections: hapticd serves {} {}at once on this socket\n"
      "end a program that is connected, such as 'hapticctl watch'",
      countAt(parameters, "limit"), flagAt(parameters, "perUser") ? "of each user " : "");
}

/// The error of an older daemon, which lacks methods and fields that this program knows.
std::string olderDaemonText(const std::string& what) {
  return fmt::format(
      "this hapticd does not know {}: it is older than hapticctl\n"
      "install the same version of both and 'systemctl restart hapticd'; 'hapticctl version' "
      "shows them",
      what);
}

std::string replyText(const ClientError& error) {
  if (!error.remedy.empty()) return error.remedy;
  const std::string_view name = error.what;
  const Json& parameters = error.parameters;
  const auto meaning = std::ranges::find(kMeanings, name, &Meaning::error);
  if (meaning != kMeanings.end()) return std::string(meaning->text);
  if (name == "io.hapticd.Control.InvalidValue") {
    return "nothing was changed:" + problemLines(listAt(parameters, "problems")) +
           "\n'hapticctl params' shows what is allowed";
  }
  if (name == "io.hapticd.Status.UnknownParameter") {
    return "unknown parameter:" + problemLines(listAt(parameters, "problems")) +
           "\n'hapticctl params' lists the names";
  }
  if (name == "io.hapticd.Control.ReloadRefused") {
    std::string text = "nothing was changed: the configuration cannot be used";
    for (const Json& problem : listAt(parameters, "problems")) text += "\n  " + valueText(problem);
    return text;
  }
  if (name == "io.hapticd.Control.WouldLoosen") {
    std::string text = "nothing was undone: the box is engaged, and this would loosen";
    for (const Json& loosening : listAt(parameters, "loosens")) text += "\n  " + valueText(loosening);
    return text + "\n'hapticctl undo --loosen' does it all the same, or 'hapticctl disengage' first";
  }
  if (name == "io.hapticd.Control.FixtureRefused") return additionText("fixture", parameters);
  if (name == "io.hapticd.Control.RegionRefused") return additionText("region", parameters);
  if (name == "io.hapticd.Control.RestartRequired") return restartText(parameters);
  if (name == "io.hapticd.Control.Refused") return refusalText(parameters);
  if (name == "io.hapticd.Status.TooManyConnections") return connectionsText(parameters);
  if (name == "io.hapticd.Status.UnknownField") {
    return fmt::format("the status has no field '{}'\n'hapticctl status --json' shows all of them",
                       textAt(parameters, "field"));
  }
  if (name == "org.varlink.service.MethodNotFound") return olderDaemonText(textAt(parameters, "method"));
  if (name == "org.varlink.service.InvalidParameter") {
    return olderDaemonText(fmt::format("the field '{}' of this call", textAt(parameters, "parameter")));
  }
  // NoFrame, MalformedCall, NothingToUndo, TraceFailed, ProfileFailed, CalibrationFailed carry a text of the
  // daemon
  if (fieldAt(parameters, "reason")) return textAt(parameters, "reason");
  const std::string shown = parameters.dump(-1, ' ', false, Json::error_handler_t::replace);
  return fmt::format(
      "hapticd answered {} {}\nis it of another version than hapticctl? See 'hapticctl version'",
      printable(name), printable(shown));
}

/// Prints an error on stderr; with `json` as an object.
void print(const std::string& name, const Json& parameters, const std::string& message, bool json) {
  if (json) {
    const Json document = {{"error", name}, {"parameters", parameters}, {"message", message}};
    fmt::print(stderr, "{}\n", document.dump(-1, ' ', false, Json::error_handler_t::replace));
  } else {
    fmt::print(stderr, "hapticctl: {}\n", message);
  }
}

}  // namespace

std::string errorText(const ClientError& error) {
  if (error.kind == ClientError::Kind::error_reply) return replyText(error);
  return error.remedy.empty() ? error.what : error.what + "\n" + error.remedy;
}

int report(const ClientError& error, bool json) {
  const bool reply = error.kind == ClientError::Kind::error_reply;
  print(reply ? error.what : "NoConnection", reply ? error.parameters : Json::object(), errorText(error),
        json);
  return reply ? kFailed : kNoConnection;
}

int reportUsage(const std::string& command, const std::string& what, bool json) {
  if (json) {
    print("WrongUsage", {{"command", command}}, fmt::format("{}\n'{} --help' shows more", what, command),
          json);
  } else {
    base::printUsageError(command, what);
  }
  return kUsage;
}

int report(const std::vector<base::Error>& errors, bool json) {
  if (!json || errors.size() < 2) {
    for (const base::Error& error : errors) report(error, json);
    return kFailed;
  }
  Json problems = Json::array();
  std::string message;
  for (const base::Error& error : errors) {
    problems.push_back(error.text());
    message += (message.empty() ? "" : "\n") + error.text();
  }
  print("Failed", {{"problems", std::move(problems)}}, message, json);
  return kFailed;
}

int report(const base::Error& error, bool json) {
  print("Failed", Json::object(), json ? error.text() : printable(error.text()), json);
  return kFailed;
}

}  // namespace hapticd::tools
