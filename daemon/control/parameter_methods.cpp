// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/parameter_methods.h"

#include <functional>
#include <utility>

#include "config/parameter_table.h"
#include "daemon/base/names.h"
#include "daemon/control/call_fields.h"
#include "daemon/control/parameter_json.h"

namespace hapticd::daemon {

std::vector<Method> ParameterMethods::methods() {
  using enum Access;
  using Self = ParameterMethods;
  return {{.name = "io.hapticd.Status.GetParameters",
           .parameters = {"names"},
           .answer = std::bind_front(&Self::getParameters, this)},
          {.name = "io.hapticd.Control.SetParameters",
           .access = control,
           .parameters = {"parameters"},
           .answer = std::bind_front(&Self::setParameters, this)},
          {.name = "io.hapticd.Control.Engage",
           .access = control,
           .parameters = {"insideSurface"},
           .answer = std::bind_front(&Self::engage, this)},
          {.name = "io.hapticd.Control.Disengage",
           .access = control,
           .answer = std::bind_front(&Self::disengage, this)},
          {.name = "io.hapticd.Control.ClearFault",
           .access = control,
           .answer = std::bind_front(&Self::clearFault, this)}};
}

void ParameterMethods::getParameters(const Call& call, const Caller& caller, Replies& replies) {
  // More names than there are parameters must be repetitions, which would make the reply arbitrarily long.
  const auto names = textsField(call, "names", config::parameterTable().size());
  if (!names) return replies.finish(caller.connection, names.error());
  OrderedJson rows = OrderedJson::array();
  if (!*names) {
    for (const config::Parameter& row : config::parameterTable())
      rows.push_back(parameterJson(row, context_.box.settings()));
    return replies.finish(caller.connection, {"", {{"parameters", std::move(rows)}}});
  }
  OrderedJson problems = OrderedJson::array();
  for (const std::string& name : **names) {
    if (const config::Parameter* row = config::findParameter(name)) {
      rows.push_back(parameterJson(*row, context_.box.settings()));
    } else {
      problems.push_back({{"parameter", name}, {"reason", reasonOf(config::unknownParameter(name))}});
    }
  }
  if (problems.empty()) return replies.finish(caller.connection, {"", {{"parameters", std::move(rows)}}});
  replies.finish(caller.connection,
                 {"io.hapticd.Status.UnknownParameter", {{"problems", std::move(problems)}}});
}

void ParameterMethods::setParameters(const Call& call, const Caller& caller, Replies& replies) {
  const Json* changes = field(call, "parameters");
  if (!changes || !changes->is_object())
    return replies.finish(caller.connection, invalidParameter("parameters"));
  const auto settings = changedSettings(context_.box.settings(), *changes);
  if (!settings) return replies.finish(caller.connection, settings.error());
  logParameters(context_, caller, "sets", context_.box.settings(), *settings);
  const std::uint64_t generation = context_.box.apply(*settings);
  answerWhenApplied(call, caller, replies, generation, [generation] {
    return Reply{"", {{"generation", generation}}};
  });
}

void ParameterMethods::engage(const Call& call, const Caller& caller, Replies& replies) {
  const auto inside = flagField(call, "insideSurface");
  if (!inside) return replies.finish(caller.connection, inside.error());
  const bool anywhere = inside->value_or(false);
  const rt::Mode before = context_.box.status().loop.tick.mode;
  const bool already = before == rt::Mode::engaged || before == rt::Mode::holding;
  logChange(context_, caller, anywhere ? "engages, inside a surface too" : "engages",
            config::EventKind::engage, {});
  answerWhenApplied(call, caller, replies, context_.box.engage(true, anywhere), [this, already] {
    Reply reply = modeReply(true);
    if (reply.error.empty()) reply.parameters["already"] = already;
    return reply;
  });
}

void ParameterMethods::disengage(const Call& call, const Caller& caller, Replies& replies) {
  logChange(context_, caller, "disengages", config::EventKind::disengage, {});
  answerWhenApplied(call, caller, replies, context_.box.engage(false, false),
                    [this] { return modeReply(false); });
}

void ParameterMethods::clearFault(const Call& call, const Caller& caller, Replies& replies) {
  const rt::Tick tick = context_.box.status().loop.tick;
  if (tick.mode != rt::Mode::faulted) {
    return replies.finish(caller.connection, {"io.hapticd.Control.NotFaulted"});
  }
  logChange(context_, caller, std::string("clears the fault ") + nameOf(tick.cause),
            config::EventKind::clear_fault, {{"CAUSE", nameOf(tick.cause)}});
  answerWhenApplied(call, caller, replies, context_.box.engage(false, false),
                    [this] { return modeReply(false); });
}

void ParameterMethods::answerWhenApplied(const Call& call, const Caller& caller, Replies& replies,
                                         std::uint64_t generation, std::move_only_function<Reply()> reply) {
  context_.pending.add(call, caller, replies, PendingAnswers::Unawaited::forget,
                       whenApplied(context_, generation, std::move(reply)));
}

Reply ParameterMethods::modeReply(bool engaged) {
  const rt::Tick tick = context_.box.status().loop.tick;
  if (engaged && tick.mode == rt::Mode::idle) {
    return {"io.hapticd.Control.Refused", {{"cause", nameOf(tick.cause)}}};
  }
  return {"", {{"mode", nameOf(tick.mode)}, {"cause", nameOf(tick.cause)}}};
}

}  // namespace hapticd::daemon
