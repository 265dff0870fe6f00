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
  if (mine.frames && mine.frames != theirs.frames) {
    texts.push_back(fmt::format("frames=[{}]", namesOf(*mine.frames)));
  }
  if (mine.fixtures && mine.fixtures != theirs.fixtures) {
    texts.push_back(fmt::format("fixtures=[{}]", namesOf(*mine.fixtures)));
  }
  if (mine.regions && mine.regions != theirs.regions) {
    texts.push_back(fmt::format("regions=[{}]", namesOf(*mine.regions)));
  }
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
  using enum Access;
  using Self = ProfileMethods;
  return {{.name = "io.hapticd.Status.ListProfiles", .answer = std::bind_front(&Self::listProfiles, this)},
          {.name = "io.hapticd.Control.SaveProfile",
           .access = control,
           .parameters = {"name", "replace"},
           .answer = std::bind_front(&Self::saveProfile, this)},
          {.name = "io.hapticd.Control.LoadProfile",
           .access = control,
           .parameters = {"name"},
           .answer = std::bind_front(&Self::loadProfile, this)},
          {.name = "io.hapticd.Control.DeleteProfile",
           .access = control,
           .parameters = {"name"},
           .answer = std::bind_front(&Self::deleteProfile, this)},
          {.name = "io.hapticd.Control.SetBootProfile",
           .access = control,
           .parameters = {"name"},
           .answer = std::bind_front(&Self::setBootProfile, this)}};
}

bool ProfileMethods::refused(const Caller& caller, Replies& replies) {
  if (!context_.pending.full(Access::control)) return false;
  replies.finish(caller.connection, failed(kFailed, PendingAnswers::kFullReason));
  return true;
}

void ProfileMethods::listProfiles(const Call& call, const Caller& caller, Replies& replies) {
  if (context_.pending.full(Access::read)) {
    return replies.finish(caller.connection,
                          failed("io.hapticd.Status.ListFailed", PendingAnswers::kFullReason));
  }
  using Entries = base::Result<std::vector<ProfileEntry>>;
  context_.pending.add(
      call, caller, replies, Unawaited::finish,
      whenReady<Entries>(worker_.run([folder = folder_] { return folder.list(); }), listReply));
}

void ProfileMethods::saveProfile(const Call& call, const Caller& caller, Replies& replies) {
  const auto replace = flagField(call, "replace");
  if (!replace) return replies.finish(caller.connection, replace.error());
  const auto name = requiredText(call, "name");
  if (!name) return replies.finish(caller.connection, name.error());
  const auto if_exists = replace->value_or(true) ? base::IfExists::replace : base::IfExists::refuse;
  answerWhenDone(call, caller, replies,
                 [folder = folder_, name = *name, settings = context_.box.settings(), if_exists]() -> Done {
                   const Loaded before = folder.load(name);
                   if (auto saved = folder.save(name, settings, if_exists); !saved) {
                     return std::unexpected(saved.error());
                   }
                   return oldAndNew(before, folder.load(name));
                 },
                 "saves profile " + *name, {{"ACTION", "save"}, {"PROFILE", *name}}, {{"name", *name}});
}

void ProfileMethods::deleteProfile(const Call& call, const Caller& caller, Replies& replies) {
  const auto name = requiredText(call, "name");
  if (!name) return replies.finish(caller.connection, name.error());
  answerWhenDone(call, caller, replies,
                 [folder = folder_, name = *name]() -> Done {
                   const Loaded before = folder.load(name);
                   if (auto removed = folder.remove(name); !removed) return std::unexpected(removed.error());
                   return oldAndNew(before, Loaded());
                 },
                 "deletes profile " + *name, {{"ACTION", "delete"}, {"PROFILE", *name}});
}

void ProfileMethods::setBootProfile(const Call& call, const Caller& caller, Replies& replies) {
  const auto name = textField(call, "name");
  if (!name) return replies.finish(caller.connection, name.error());
  answerWhenDone(call, caller, replies,
                 [folder = folder_, name = *name]() -> Done {
                   const auto before = folder.boot();
                   if (auto set = folder.setBoot(name); !set) return std::unexpected(set.error());
                   return oldAndNew(before ? before->value_or("") : "", name.value_or(""));
                 },
                 *name ? "makes " + **name + " the boot profile" : "wants no boot profile",
                 {{"ACTION", "boot"}, {"PROFILE", name->value_or("")}});
}

void ProfileMethods::answerWhenDone(const Call& call, const Caller& caller, Replies& replies,
                                    std::function<Done()> job, const std::string& change,
                                    const JournalFields& fields, const OrderedJson& parameters) {
  if (refused(caller, replies)) return;
  const auto reply = [this, caller, change, fields, parameters](const Done& done) {
    if (!done) return failed(kFailed, done.error().text());
    JournalFields all = fields;
    std::ranges::copy(*done, std::back_inserter(all));
    logChange(context_, caller, change, config::EventKind::profile, all);
    return Reply{"", parameters};
  };
  context_.pending.add(call, caller, replies, Unawaited::finish,
                       whenReady<Done>(worker_.run(std::move(job)), reply));
}

void ProfileMethods::loadProfile(const Call& call, const Caller& caller, Replies& replies) {
  const auto name = requiredText(call, "name");
  if (!name) return replies.finish(caller.connection, name.error());
  if (refused(caller, replies)) return;
  auto loading = worker_.run([folder = folder_, name = *name] { return folder.load(name); });
  // It waits for the file first, then for the force loop.
  auto poll = [this, caller, name = *name, loading = std::move(loading),
               applied = PendingAnswers::Poll()]() mutable -> std::optional<Reply> {
    if (applied) return applied();
    if (!isReady(loading)) return std::nullopt;
    auto waiting = apply(caller, name, loading.get());
    if (!waiting) return waiting.error();
    applied = std::move(*waiting);
    return applied();
  };
  context_.pending.add(call, caller, replies, Unawaited::finish, std::move(poll));
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
  if (before.frames != settings.additions.frames) changed.emplace_back("frames");
  if (before.fixtures != settings.additions.fixtures) changed.emplace_back("fixtures");
  if (before.regions != settings.additions.regions) changed.emplace_back("regions");
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
