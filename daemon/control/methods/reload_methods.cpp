// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/methods/methods.h"

#include <fmt/format.h>

#include <functional>
#include <optional>
#include <utility>

#include "daemon/control/base/method_context.h"
#include "daemon/control/base/status_json.h"

namespace hapticd::daemon {
namespace {

Reply refused(std::vector<std::string> problems) {
  return {"io.hapticd.Control.ReloadRefused", {{"problems", OrderedJson(std::move(problems))}}};
}

Reply refused(const std::vector<base::Error>& errors) {
  std::vector<std::string> problems;
  for (const base::Error& error : errors) problems.push_back(error.text());
  return refused(std::move(problems));
}

Reply replyTo(const ReloadReport& report, const std::optional<PendingReload>& pending) {
  return {"",
          {{"changes", OrderedJson(report.changes)},
           {"waiting", OrderedJson(report.waiting)},
           {"hidden", OrderedJson(report.hidden)},
           {"pending", pendingReloadJson(pending)}}};
}

}  // namespace

std::vector<Method> ReloadMethods::methods() {
  return {methodOf(this, "io.hapticd.Control.Reload", &ReloadMethods::reload, {{"confirm", isWhole}})};
}

Answer ReloadMethods::reload(const Call& call, const Caller& caller) {
  const Json* const number = field(call, "confirm");
  if (!reloads_ || context_.pending.full(Access::control)) {
    const char* const reason =
        reloads_ ? PendingAnswers::kFullReason : "there is no configuration that could be read again";
    return refused(std::vector<std::string>{reason});
  }
  if (number) return confirm(*number, caller);
  logChange(context_, caller, "reads the configuration again", config::EventKind::reload, {});
  // It waits for the file first, then for the force loop.
  auto poll = [this, ticket = reloads_->request(),
               applied = PendingAnswers::Poll()]() mutable -> std::optional<Reply> {
    if (applied) return applied();
    const auto outcome = reloads_->outcome(ticket);
    if (!outcome) return std::nullopt;
    applied = answerTo(*outcome);
    return applied();
  };
  return Later{PendingAnswers::Unawaited::forget, std::move(poll)};
}

Answer ReloadMethods::confirm(const Json& number, const Caller& caller) {
  const auto& pending = reloads_->pending();
  if (!pending) return Reply{"io.hapticd.Control.NoPendingReload"};
  if (number != pending->number) {
    return Reply{"io.hapticd.Control.ChangedMeanwhile", {{"generation", pending->number}}};
  }
  logChange(context_, caller, "confirms the reload", config::EventKind::reload,
            {{"NUMBER", fmt::to_string(pending->number)}});
  return Later{PendingAnswers::Unawaited::forget, answerTo(reloads_->confirm())};
}

PendingAnswers::Poll ReloadMethods::answerTo(const Reloads::Outcome& outcome) {
  if (!outcome) return [errors = outcome.error()] { return std::optional(refused(errors)); };
  static const std::vector<config::FixtureSettings> kNone;  // every fixture is applied anew
  return whenApplied(
      context_, outcome->generation,
      [this, report = *outcome] { return replyTo(report, reloads_->pending()); }, &kNone);
}

}  // namespace hapticd::daemon
