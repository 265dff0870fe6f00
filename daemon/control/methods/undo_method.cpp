// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <utility>

#include "config/conflicts.h"
#include "config/settings/parameter_table.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/methods/methods.h"

namespace hapticd::daemon {
namespace {

Reply nothingToUndo(const ChangeHistory& history, const config::Settings& now) {
  const char* const reason =
      history.isOutdated(now)
          ? "the configuration has been reloaded since the last change (set the values by hand, or edit the "
            "configuration and reload it again)"
          : "no change of parameters, fixtures or regions by a client is left (the last 16 are remembered "
            "while the daemon runs)";
  return failed("io.hapticd.Control.NothingToUndo", reason);
}

/// Refuses what would loosen a limit while a force may act; nothing if that is not so.
std::optional<Reply> wouldLoosen(const config::Settings& now, const config::Settings& target) {
  const auto loosenings = config::looseningsOf(now, target);
  if (loosenings.empty()) return std::nullopt;
  OrderedJson texts = OrderedJson::array();
  for (const config::Loosening& loosening : loosenings) texts.push_back(loosening.text);
  return Reply{"io.hapticd.Control.WouldLoosen", {{"loosens", std::move(texts)}}};
}

/// A profile or an older fixture may no longer fit what else is set now.
std::optional<Reply> conflictReply(const config::Settings& target) {
  std::vector<base::Error> errors = config::checkTogether(target);
  for (const config::AdditionError& error : config::checkTogether(target.additions))
    errors.push_back(error.error);
  if (errors.empty()) return std::nullopt;
  return failed("io.hapticd.Control.NothingToUndo", "the last change cannot be undone: " + textOf(errors));
}

}  // namespace

std::vector<Method> UndoMethod::methods() {
  return {methodOf(this, "io.hapticd.Control.Undo", &UndoMethod::undo,
                   {{"preview", isFlag}, {"loosen", isFlag}})};
}

Answer UndoMethod::undo(const Call& call, const Caller& caller) {
  const config::Settings now = context_.box.settings();
  const auto target = context_.history.undone(now);
  if (!target) return nothingToUndo(context_.history, now);
  OrderedJson changes(textsOfDifferences(now, *target));
  if (optionalFlag(call, "preview").value_or(false)) {
    return Reply{"",
                 {{"generation", context_.box.acknowledgedGeneration()},
                  {"changes", std::move(changes)},
                  {"remaining", context_.history.size()}}};
  }
  if (const auto conflict = conflictReply(*target)) return *conflict;
  if (context_.box.engaged() && !optionalFlag(call, "loosen").value_or(false)) {
    if (const auto refused = wouldLoosen(now, *target)) return *refused;
  }
  logParameters(context_, caller, "undoes a change:", now, *target);
  logAdditions(context_, caller, "undoes a change:", now.additions, target->additions);
  const std::uint64_t generation = context_.box.apply(*target);
  context_.history.dropLast();
  return Later{
      PendingAnswers::Unawaited::forget,
      whenApplied(
          context_, generation,
          [generation, changes = std::move(changes), remaining = context_.history.size()]() mutable {
            return Reply{
                "", {{"generation", generation}, {"changes", std::move(changes)}, {"remaining", remaining}}};
          },
          &now.additions.fixtures)};
}

}  // namespace hapticd::daemon
