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
#include "daemon/control/base/status_json.h"
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

/// What a list says of each of its items before its state.
OrderedJson entryOf(const auto& item) {
  return {{"name", item.name},
          {"origin", nameOf(item.origin.value)},
          {"definition", config::definitionOf<OrderedJson>(item)}};
}

/// How a box or solid is turned, for clients that reckon with quaternions; null of others.
OrderedJson orientationJson(const auto& item) {
  const config::Addition addition(item);
  const auto turns = [&addition](const config::AdditionField& field) {
    return field.kind == config::Kind::quaternion && addition.has(field);
  };
  if (std::ranges::none_of(addition.fields(), turns)) return {};
  const auto [x, y, z, w] = config::orientationOf(item.rotation_deg);
  return OrderedJson::array({x, y, z, w});
}

/// A list, whose elements are not checked; empty if it is absent.
std::vector<Json> listIn(const Call& call, const char* name) {
  return optionalField<std::vector<Json>>(call, name).value_or(std::vector<Json>());
}

Reply refusal(const StiffnessFeed::Refusal& refused) {
  if (std::holds_alternative<StiffnessFeed::TooFast>(refused))
    return {"io.hapticd.Control.FeedLimited", {{"limit", StiffnessFeed::kMaxPerSecond}}};
  if (const auto* const error = std::get_if<config::AdditionError>(&refused))
    return refusal(AdditionList::regions, {*error});
  return {"io.hapticd.Control.OutsideRegions"};
}

}  // namespace

std::vector<Method> AdditionMethods::methods() {
  using enum Access;
  using enum MethodParameter::Need;
  using Self = AdditionMethods;
  const std::vector<MethodParameter> changes{
      {"remove", isList}, {"add", isList}, {"change", isList}, {"generation", isWhole}};
  return {methodOf(this, "io.hapticd.Status.ListFixtures", &Self::listFixtures),
          methodOf(this, "io.hapticd.Status.ListRegions", &Self::listRegions),
          {.name = "io.hapticd.Control.ChangeFixtures",
           .access = control,
           .parameters = changes,
           .answer = std::bind_front(&Self::changeList, this, AdditionList::fixtures)},
          {.name = "io.hapticd.Control.ChangeRegions",
           .access = control,
           .parameters = changes,
           .answer = std::bind_front(&Self::changeList, this, AdditionList::regions)},
          methodOf(this, "io.hapticd.Control.SetStiffness", &Self::setStiffness,
                   {{"region", isText, required},
                    {"stiffnessNPerM", isNumber, required},
                    {"dampingNSPerM", isNumber}}),
          methodOf(this, "io.hapticd.Control.FeedStiffness", &Self::feedStiffness,
                   {{"xM", isNumber, required},
                    {"yM", isNumber, required},
                    {"zM", isNumber, required},
                    {"stiffnessNPerM", isNumber, required},
                    {"dampingNSPerM", isNumber},
                    {"weight", isNumber}})};
}

std::uint64_t AdditionMethods::generationOf(AdditionList list) const {
  const AdditionGenerations generations = context_.box.additionGenerations();
  return list == AdditionList::fixtures ? generations.fixtures : generations.regions;
}

Answer AdditionMethods::listFixtures(const Call&, const Caller&) {
  const FixtureStatus status = context_.box.status().fixtures;
  const AdditionGenerations generations = context_.box.additionGenerations();
  OrderedJson entries = OrderedJson::array();
  for (const config::FixtureSettings& fixture : context_.box.additions().fixtures) {
    const auto found = std::ranges::find(status.each, fixture.name, &FixtureConduct::name);
    const OrderedJson conduct = found == status.each.end() ? OrderedJson::object() : conductJson(*found);
    OrderedJson entry = entryOf(fixture);
    entry["enabled"] = fixture.enabled;
    entry["definedIn"] = generations.each_fixture.at(entries.size());
    entry["inContact"] = std::ranges::find(status.in_contact, fixture.name) != status.in_contact.end();
    entry["nearest"] = fixture.name == status.nearest;
    for (const char* const member : {"distanceM", "forceN", "stiffnessNPerM", "stage", "warnings", "lagM",
                                     "breaches", "breachedS", "deepestBreachM"})
      entry[member] = conduct.value(member, OrderedJson());
    entry["onCameraLoss"] = rt::wordOf(config::effectiveOnCameraLoss(fixture));
    entry["orientationXyzw"] = orientationJson(fixture);
    entries.push_back(std::move(entry));
  }
  return Reply{"", {{"generation", generations.fixtures}, {"fixtures", std::move(entries)}}};
}

Answer AdditionMethods::listRegions(const Call&, const Caller&) {
  const TissueStatus status = context_.box.status().tissue;
  OrderedJson entries = OrderedJson::array();
  for (const config::RegionSettings& region : context_.box.additions().regions) {
    OrderedJson entry = entryOf(region);
    entry["inContact"] = region.name == status.in_contact;
    entry["orientationXyzw"] = orientationJson(region);
    entries.push_back(std::move(entry));
  }
  return Reply{"", {{"generation", generationOf(AdditionList::regions)}, {"regions", std::move(entries)}}};
}

Answer AdditionMethods::changeList(AdditionList list, const Call& call, const Caller& caller) {
  const Json* const generation = field(call, "generation");
  const std::uint64_t current = generationOf(list);
  if (generation && *generation != current)
    return Reply{"io.hapticd.Control.ChangedMeanwhile", {{"generation", current}}};
  return apply(list, {listIn(call, "remove"), listIn(call, "change"), listIn(call, "add")}, caller);
}

Answer AdditionMethods::setStiffness(const Call& call, const Caller& caller) {
  Json members = {{"name", requiredText(call, "region")},
                  {"stiffness_n_per_m", requiredNumber(call, "stiffnessNPerM")}};
  if (const auto damping = optionalNumber(call, "dampingNSPerM")) members["damping_n_s_per_m"] = *damping;
  return apply(AdditionList::regions, {{}, {std::move(members)}, {}}, caller);
}

Answer AdditionMethods::apply(AdditionList list, const AdditionChange& change, const Caller& caller) {
  feed_.flush();
  const config::SceneAdditions before = context_.box.additions();
  auto after = changedAdditions(before, list, change);
  if (!after) return refusal(list, after.error());
  if (const auto missing = missingSolids(context_.box, *after); !missing.empty())
    return refusal(list, missing);
  config::Settings settings = context_.box.settings();
  settings.additions = *after;
  if (const auto conflicts = config::checkTogether(settings); !conflicts.empty()) {
    std::vector<config::AdditionError> problems;
    for (const base::Error& conflict : conflicts) problems.push_back({"", "", conflict});
    return refusal(list, problems);
  }
  context_.history.record(context_.box.settings(), settings);
  const std::uint64_t directive = context_.box.applyAdditions(*after);
  logAdditions(context_, caller, "", before, *after);
  const auto reply = [generation = generationOf(list)] { return Reply{"", {{"generation", generation}}}; };
  return Later{PendingAnswers::Unawaited::forget, whenApplied(context_, directive, reply, &before.fixtures)};
}

Answer AdditionMethods::feedStiffness(const Call& call, const Caller& caller) {
  const StiffnessFeed::Sample sample{
      .position_m_in_world = {requiredNumber(call, "xM"), requiredNumber(call, "yM"),
                              requiredNumber(call, "zM")},
      .stiffness_n_per_m = requiredNumber(call, "stiffnessNPerM"),
      .damping_n_s_per_m = optionalNumber(call, "dampingNSPerM"),
      .weight = optionalNumber(call, "weight").value_or(1)};
  if (sample.weight <= 0 || sample.weight > StiffnessFeed::kMaxPastWeight) return invalidParameter("weight");
  const auto accepted = feed_.take(sample, StiffnessFeed::Clock::now());
  if (!accepted) return refusal(accepted.error());
  const auto& [region, stiffness_n_per_m, begins] = *accepted;
  if (begins) {
    logChange(context_, caller, "feeds measured stiffness into region " + region, config::EventKind::region,
              {{"REGION", region}, {"ACTION", "feed"}, {"NEW", fmt::format("{}", stiffness_n_per_m)}});
  }
  return Reply{"", {{"region", region}, {"stiffnessNPerM", stiffness_n_per_m}}};
}

}  // namespace hapticd::daemon
