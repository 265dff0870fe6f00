// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/methods/methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "config/additions/addition_json.h"
#include "config/settings/parameter_table.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "rt/fixtures/fixture.h"
#include "rt/tissue/tissue.h"

namespace hapticd::daemon {
namespace {

OrderedJson problemJson(const char* name_field, const config::AdditionError& error) {
  return {{name_field, error.name},
          {"field", error.field.empty() ? OrderedJson() : OrderedJson(error.field)},
          {"reason", error.error.what},
          {"remedy", error.error.remedy}};
}

/// `errors`: at least one.
Reply refusal(AdditionList list, const std::vector<config::AdditionError>& errors) {
  constexpr std::size_t kMaxProblems = 100;
  const bool fixture = list == AdditionList::fixtures;
  OrderedJson parameters = problemJson(fixture ? "fixture" : "region", errors.front());
  OrderedJson& problems = parameters["problems"] = OrderedJson::array();
  for (std::size_t i = 0; i < std::min(errors.size(), kMaxProblems); ++i)
    problems.push_back(problemJson("name", errors[i]));
  return {fixture ? "io.hapticd.Control.FixtureRefused" : "io.hapticd.Control.RegionRefused",
          std::move(parameters)};
}

/// How a box or solid is turned, for clients that reckon with quaternions.
OrderedJson orientationJson(bool is_turned, const rt::Vec3& rotation_deg) {
  if (!is_turned) return {};
  const auto [x, y, z, w] = config::orientationOf(rotation_deg);
  return OrderedJson::array({x, y, z, w});
}

/// A list, whose elements are not checked; empty if it is absent. Errors: InvalidParameter.
std::expected<std::vector<Json>, Reply> listField(const Call& call, const char* name) {
  const Json* const json = field(call, name);
  if (!json) return std::vector<Json>();
  if (!json->is_array()) return std::unexpected(invalidParameter(name));
  return json->get<std::vector<Json>>();
}

std::expected<double, Reply> requiredNumber(const Call& call, const char* name) {
  const auto number = numberField(call, name);
  if (!number) return std::unexpected(number.error());
  if (!*number) return std::unexpected(invalidParameter(name));
  return **number;
}

std::expected<AdditionChange, Reply> changeOf(const Call& call) {
  auto remove = listField(call, "remove");
  if (!remove) return std::unexpected(remove.error());
  auto change = listField(call, "change");
  if (!change) return std::unexpected(change.error());
  auto add = listField(call, "add");
  if (!add) return std::unexpected(add.error());
  return AdditionChange{std::move(*remove), std::move(*change), std::move(*add)};
}

/// InvalidParameter for the first of these fields that is there and no finite number.
std::optional<Reply> wrongNumber(const Call& call, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (const auto number = numberField(call, name); !number) return number.error();
  }
  return std::nullopt;
}

std::expected<StiffnessFeed::Sample, Reply> sampleOf(const Call& call) {
  // A wrong type is named before what is missing, as for every method.
  if (const auto wrong = wrongNumber(call, {"xM", "yM", "zM", "stiffnessNPerM", "dampingNSPerM", "weight"}))
    return std::unexpected(*wrong);
  StiffnessFeed::Sample sample;
  const std::pair<const char*, double*> required[] = {{"xM", &sample.position_m_in_world.x},
                                                      {"yM", &sample.position_m_in_world.y},
                                                      {"zM", &sample.position_m_in_world.z},
                                                      {"stiffnessNPerM", &sample.stiffness_n_per_m}};
  for (const auto& [name, value] : required) {
    const auto number = requiredNumber(call, name);
    if (!number) return std::unexpected(number.error());
    *value = *number;
  }
  const auto damping = numberField(call, "dampingNSPerM");
  if (!damping) return std::unexpected(damping.error());
  sample.damping_n_s_per_m = *damping;
  const auto weight = numberField(call, "weight");
  if (!weight) return std::unexpected(weight.error());
  sample.weight = weight->value_or(1);
  if (sample.weight <= 0 || sample.weight > StiffnessFeed::kMaxPastWeight)
    return std::unexpected(invalidParameter("weight"));
  return sample;
}

Reply refusal(const StiffnessFeed::Refusal& refused) {
  return std::visit(
      config::Overloaded{
          [](const StiffnessFeed::TooFast&) {
            return Reply{"io.hapticd.Control.FeedLimited", {{"limit", StiffnessFeed::kMaxPerSecond}}};
          },
          [](const StiffnessFeed::Outside&) { return Reply{"io.hapticd.Control.OutsideRegions"}; },
          [](const config::AdditionError& error) { return refusal(AdditionList::regions, {error}); }},
      refused);
}

}  // namespace

std::vector<Method> AdditionMethods::methods() {
  using enum Access;
  using Self = AdditionMethods;
  return {{.name = "io.hapticd.Status.ListFixtures", .answer = std::bind_front(&Self::listFixtures, this)},
          {.name = "io.hapticd.Status.ListRegions", .answer = std::bind_front(&Self::listRegions, this)},
          {.name = "io.hapticd.Control.ChangeFixtures",
           .access = control,
           .parameters = {"remove", "add", "change", "generation"},
           .answer = std::bind_front(&Self::changeList, this, AdditionList::fixtures)},
          {.name = "io.hapticd.Control.ChangeRegions",
           .access = control,
           .parameters = {"remove", "add", "change", "generation"},
           .answer = std::bind_front(&Self::changeList, this, AdditionList::regions)},
          {.name = "io.hapticd.Control.SetStiffness",
           .access = control,
           .parameters = {"region", "stiffnessNPerM", "dampingNSPerM"},
           .answer = std::bind_front(&Self::setStiffness, this)},
          {.name = "io.hapticd.Control.FeedStiffness",
           .access = control,
           .parameters = {"xM", "yM", "zM", "stiffnessNPerM", "dampingNSPerM", "weight"},
           .answer = std::bind_front(&Self::feedStiffness, this)}};
}

std::uint64_t AdditionMethods::generationOf(AdditionList list) const {
  const AdditionGenerations generations = context_.box.additionGenerations();
  return list == AdditionList::fixtures ? generations.fixtures : generations.regions;
}

void AdditionMethods::listFixtures(const Call&, const Caller& caller, Replies& replies) {
  const FixtureStatus status = context_.box.status().fixtures;
  const AdditionGenerations generations = context_.box.additionGenerations();
  OrderedJson entries = OrderedJson::array();
  for (const config::FixtureSettings& fixture : context_.box.additions().fixtures) {
    const auto conduct = std::ranges::find(status.each, fixture.name, &FixtureConduct::name);
    const bool known = conduct != status.each.end();
    const bool is_turned = fixture.kind == rt::FixtureKind::box || fixture.kind == rt::FixtureKind::solid;
    entries.push_back(
        {{"name", fixture.name},
         {"origin", nameOf(fixture.origin.value)},
         {"definition", config::definitionOf<OrderedJson>(fixture)},
         {"enabled", fixture.enabled},
         {"definedIn", generations.each_fixture.at(entries.size())},
         {"inContact", std::ranges::find(status.in_contact, fixture.name) != status.in_contact.end()},
         {"nearest", fixture.name == status.nearest},
         {"distanceM",
          known && std::isfinite(conduct->distance_m) ? OrderedJson(conduct->distance_m) : OrderedJson()},
         {"forceN", known ? OrderedJson(conduct->force_n) : OrderedJson()},
         {"stiffnessNPerM", known ? OrderedJson(conduct->stiffness_n_per_m) : OrderedJson()},
         {"stage", known && conduct->stage ? OrderedJson(rt::wordOf(*conduct->stage)) : OrderedJson()},
         {"warnings", known ? OrderedJson(conduct->warnings) : OrderedJson()},
         {"lagM", known ? OrderedJson(conduct->lag_m) : OrderedJson()},
         {"breaches", known ? OrderedJson(conduct->breach.number) : OrderedJson()},
         {"breachedS", known ? OrderedJson(conduct->breaches.duration_s) : OrderedJson()},
         {"deepestBreachM", known ? OrderedJson(conduct->breaches.depth_m) : OrderedJson()},
         {"onCameraLoss", rt::wordOf(config::effectiveOnCameraLoss(fixture))},
         {"orientationXyzw", orientationJson(is_turned, fixture.rotation_deg)}});
  }
  replies.finish(caller.connection,
                 {"", {{"generation", generations.fixtures}, {"fixtures", std::move(entries)}}});
}

void AdditionMethods::listRegions(const Call&, const Caller& caller, Replies& replies) {
  const TissueStatus status = context_.box.status().tissue;
  OrderedJson entries = OrderedJson::array();
  for (const config::RegionSettings& region : context_.box.additions().regions) {
    const bool is_box = region.place == rt::TissuePlace::shape && region.shape == rt::ShapeKind::box;
    entries.push_back({{"name", region.name},
                       {"origin", nameOf(region.origin.value)},
                       {"definition", config::definitionOf<OrderedJson>(region)},
                       {"inContact", region.name == status.in_contact},
                       {"orientationXyzw", orientationJson(is_box, region.rotation_deg)}});
  }
  replies.finish(
      caller.connection,
      {"", {{"generation", generationOf(AdditionList::regions)}, {"regions", std::move(entries)}}});
}

void AdditionMethods::changeList(AdditionList list, const Call& call, const Caller& caller,
                                 Replies& replies) {
  const auto change = changeOf(call);
  if (!change) return replies.finish(caller.connection, change.error());
  if (const Json* generation = field(call, "generation")) {
    if (!generation->is_number_integer())
      return replies.finish(caller.connection, invalidParameter("generation"));
    const std::uint64_t current = generationOf(list);
    if (*generation != current) {
      return replies.finish(caller.connection,
                            {"io.hapticd.Control.ChangedMeanwhile", {{"generation", current}}});
    }
  }
  apply(list, *change, call, caller, replies);
}

void AdditionMethods::setStiffness(const Call& call, const Caller& caller, Replies& replies) {
  if (const auto wrong = wrongNumber(call, {"stiffnessNPerM", "dampingNSPerM"}))
    return replies.finish(caller.connection, *wrong);
  const auto name = requiredText(call, "region");
  if (!name) return replies.finish(caller.connection, name.error());
  const auto stiffness = requiredNumber(call, "stiffnessNPerM");
  if (!stiffness) return replies.finish(caller.connection, stiffness.error());
  const auto damping = numberField(call, "dampingNSPerM");
  if (!damping) return replies.finish(caller.connection, damping.error());
  Json members = {{"name", *name}, {"stiffness_n_per_m", *stiffness}};
  if (*damping) members["damping_n_s_per_m"] = **damping;
  apply(AdditionList::regions, {{}, {std::move(members)}, {}}, call, caller, replies);
}

void AdditionMethods::apply(AdditionList list, const AdditionChange& change, const Call& call,
                            const Caller& caller, Replies& replies) {
  feed_.flush();
  const config::SceneAdditions before = context_.box.additions();
  auto after = changedAdditions(before, list, change);
  if (!after) return replies.finish(caller.connection, refusal(list, after.error()));
  if (const auto missing = missingSolids(context_.box, *after); !missing.empty())
    return replies.finish(caller.connection, refusal(list, missing));
  config::Settings settings = context_.box.settings();
  settings.additions = *after;
  if (const auto conflicts = config::checkTogether(settings); !conflicts.empty()) {
    std::vector<config::AdditionError> problems;
    for (const base::Error& conflict : conflicts) problems.push_back({"", "", conflict});
    return replies.finish(caller.connection, refusal(list, problems));
  }
  context_.history.record(context_.box.settings(), settings);
  const std::uint64_t directive = context_.box.applyAdditions(*after);
  logAdditions(context_, caller, "", before, *after);
  context_.pending.add(call, caller, replies, PendingAnswers::Unawaited::forget,
                       whenApplied(
                           context_, directive,
                           [generation = generationOf(list)] {
                             return Reply{"", {{"generation", generation}}};
                           },
                           &before.fixtures));
}

void AdditionMethods::feedStiffness(const Call& call, const Caller& caller, Replies& replies) {
  const auto sample = sampleOf(call);
  if (!sample) return replies.finish(caller.connection, sample.error());
  const auto accepted = feed_.take(*sample, StiffnessFeed::Clock::now());
  if (!accepted) return replies.finish(caller.connection, refusal(accepted.error()));
  const auto& [region, stiffness_n_per_m, begins] = *accepted;
  if (begins) {
    logChange(context_, caller, "feeds measured stiffness into region " + region, config::EventKind::region,
              {{"REGION", region}, {"ACTION", "feed"}, {"NEW", fmt::format("{}", stiffness_n_per_m)}});
  }
  replies.finish(caller.connection, {"", {{"region", region}, {"stiffnessNPerM", stiffness_n_per_m}}});
}

}  // namespace hapticd::daemon
