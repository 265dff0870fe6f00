// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/methods/methods.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "config/settings/parameter_table.h"
#include "daemon/control/base/addition_change.h"
#include "daemon/control/base/method_context.h"

namespace hapticd::daemon {
namespace {

using Unawaited = PendingAnswers::Unawaited;

constexpr const char* kFailed = "io.hapticd.Control.ProfileFailed";

Reply listReply(const base::Result<std::vector<ProfileEntry>>& entries) {
  if (!entries) return failed("io.hapticd.Status.ListFailed", entries.error().text());
  OrderedJson profiles = OrderedJson::array();
  for (const auto& [name, boot, time_ns] : *entries) {
    profiles.push_back({{"name", name}, {"boot", boot}, {"timeNs", time_ns}});
  }
  return {"", {{"profiles", std::move(profiles)}}};
}

std::string namesOf(const auto& additions) {
  std::vector<std::string> names;
  for (const auto& addition : additions) names.push_back(addition.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

/// "name=value, name=value" of the parameters and lists in `some` whose values in `others` differ or are
/// absent; empty for a profile that could not be read.
std::string differences(const ProfileMethods::Loaded& some, const ProfileMethods::Loaded& others) {
  std::vector<std::string> texts;
  if (!some) return {};
  for (const auto& [parameter, value] : some->assignments) {
    const auto alike = [&](const config::Assignment& other) {
      return other.parameter == parameter && other.value == value;
    };
    if (others && std::ranges::any_of(others->assignments, alike)) continue;
    texts.push_back(fmt::format("{}={}", parameter->name, config::toText(value)));
  }
  const config::AdditionLists none;
  const config::AdditionLists& mine = some->additions;
  const config::AdditionLists& theirs = others ? others->additions : none;
  config::forEachList(
      [&texts](const auto& my, const auto& their) {
        if (my && my != their)
          texts.push_back(fmt::format("{}=[{}]", config::AdditionSpan(*my).type().list, namesOf(*my)));
      },
      mine, theirs);
  if (mine.label_image && mine.label_image != theirs.label_image) {
    texts.push_back(fmt::format("label_image={}", *mine.label_image));
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

JournalFields oldAndNew(std::string before, std::string after) {
  return {{"OLD", std::move(before)}, {"NEW", std::move(after)}};
}

JournalFields oldAndNew(const ProfileMethods::Loaded& before, const ProfileMethods::Loaded& after) {
  return oldAndNew(differences(before, after), differences(after, before));
}

}  // namespace

ProfileMethods::ProfileMethods(MethodContext& context, StateWorker& worker)
    : context_(context), worker_(worker), folder_(context.box.settings().state.folder) {}

std::vector<Method> ProfileMethods::methods() {
  using enum MethodParameter::Need;
  using Self = ProfileMethods;
  return {
      methodOf(this, "io.hapticd.Status.ListProfiles", &Self::listProfiles),
      methodOf(this, "io.hapticd.Control.SaveProfile", &Self::saveProfile,
               {{"name", isText, required}, {"replace", isFlag}}),
      methodOf(this, "io.hapticd.Control.LoadProfile", &Self::loadProfile, {{"name", isText, required}}),
      methodOf(this, "io.hapticd.Control.DeleteProfile", &Self::deleteProfile, {{"name", isText, required}}),
      methodOf(this, "io.hapticd.Control.SetBootProfile", &Self::setBootProfile, {{"name", isText}})};
}

Answer ProfileMethods::listProfiles(const Call&, const Caller&) {
  if (context_.pending.full(Access::read)) {
    return failed("io.hapticd.Status.ListFailed", PendingAnswers::kFullReason);
  }
  using Entries = base::Result<std::vector<ProfileEntry>>;
  return Later{Unawaited::finish,
               whenReady<Entries>(worker_.run([folder = folder_] { return folder.list(); }), listReply)};
}

Answer ProfileMethods::saveProfile(const Call& call, const Caller& caller) {
  const auto replace = optionalFlag(call, "replace");
  const auto name = requiredText(call, "name");
  const auto if_exists = replace.value_or(true) ? base::IfExists::replace : base::IfExists::refuse;
  return answerWhenDone(caller,
                        [folder = folder_, name, settings = context_.box.settings(), if_exists]() -> Done {
                          const Loaded before = folder.load(name);
                          if (auto saved = folder.save(name, settings, if_exists); !saved) {
                            return std::unexpected(saved.error());
                          }
                          return oldAndNew(before, folder.load(name));
                        },
                        "saves profile " + name, {{"ACTION", "save"}, {"PROFILE", name}}, {{"name", name}});
}

Answer ProfileMethods::deleteProfile(const Call& call, const Caller& caller) {
  const auto name = requiredText(call, "name");
  return answerWhenDone(caller,
                        [folder = folder_, name]() -> Done {
                          const Loaded before = folder.load(name);
                          if (auto removed = folder.remove(name); !removed)
                            return std::unexpected(removed.error());
                          return oldAndNew(before, Loaded());
                        },
                        "deletes profile " + name, {{"ACTION", "delete"}, {"PROFILE", name}});
}

Answer ProfileMethods::setBootProfile(const Call& call, const Caller& caller) {
  const auto name = optionalText(call, "name");
  return answerWhenDone(caller,
                        [folder = folder_, name]() -> Done {
                          const auto before = folder.boot();
                          if (auto set = folder.setBoot(name); !set) return std::unexpected(set.error());
                          return oldAndNew(before ? before->value_or("") : "", name.value_or(""));
                        },
                        name ? "makes " + *name + " the boot profile" : "wants no boot profile",
                        {{"ACTION", "boot"}, {"PROFILE", name.value_or("")}});
}

Answer ProfileMethods::answerWhenDone(const Caller& caller, std::function<Done()> job,
                                      const std::string& change, const JournalFields& fields,
                                      const OrderedJson& parameters) {
  if (context_.pending.full(Access::control)) return failed(kFailed, PendingAnswers::kFullReason);
  const auto reply = [this, caller, change, fields, parameters](const Done& done) {
    if (!done) return failed(kFailed, done.error().text());
    JournalFields all = fields;
    std::ranges::copy(*done, std::back_inserter(all));
    logChange(context_, caller, change, config::EventKind::profile, all);
    return Reply{"", parameters};
  };
  return Later{Unawaited::finish, whenReady<Done>(worker_.run(std::move(job)), reply)};
}

Answer ProfileMethods::loadProfile(const Call& call, const Caller& caller) {
  const auto name = requiredText(call, "name");
  if (context_.pending.full(Access::control)) return failed(kFailed, PendingAnswers::kFullReason);
  auto loading = worker_.run([folder = folder_, name] { return folder.load(name); });
  // It waits for the file first, then for the force loop.
  auto poll = [this, caller, name, loading = std::move(loading),
               applied = PendingAnswers::Poll()]() mutable -> std::optional<Reply> {
    if (applied) return applied();
    if (!isReady(loading)) return std::nullopt;
    auto waiting = apply(caller, name, loading.get());
    if (!waiting) return waiting.error();
    applied = std::move(*waiting);
    return applied();
  };
  return Later{Unawaited::finish, std::move(poll)};
}

std::expected<PendingAnswers::Poll, Reply> ProfileMethods::apply(const Caller& caller,
                                                                 const std::string& name,
                                                                 const Loaded& loaded) {
  if (!loaded) return std::unexpected(failed(kFailed, textOf(loaded.error())));
  config::Settings settings = context_.box.settings();
  for (const auto& [parameter, value] : loaded->assignments) parameter->set(settings, value);
  loaded->additions.applyTo(settings.additions, config::Origin::profile);
  if (const auto errors = config::checkTogether(settings); !errors.empty()) {
    return std::unexpected(failed(kFailed, textOf(errors)));
  }
  if (const auto missing = missingSolids(context_.box, settings.additions); !missing.empty())
    return std::unexpected(failed(kFailed, missing.front().error.text()));
  std::vector<std::string> changed =
      logParameters(context_, caller, fmt::format("by profile {},", name), context_.box.settings(), settings);
  logAdditions(context_, caller, fmt::format("by profile {}", name), context_.box.additions(),
               settings.additions);
  logChange(context_, caller, fmt::format("loads profile {}: {} parameters changed", name, changed.size()),
            config::EventKind::profile, {{"ACTION", "load"}, {"PROFILE", name}});
  const config::SceneAdditions before = context_.box.additions();
  config::forEachList(
      [&changed](const auto& was, const auto& now) {
        if (was != now) changed.emplace_back(config::AdditionSpan(now).type().list);
      },
      before, settings.additions);
  context_.history.record(context_.box.settings(), settings);
  const std::uint64_t generation = context_.box.apply(settings);
  return whenApplied(
      context_, generation,
      [generation, changed] {
        return Reply{"", {{"generation", generation}, {"changed", OrderedJson(changed)}}};
      },
      &before.fixtures);
}

}  // namespace hapticd::daemon
