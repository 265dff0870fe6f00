// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base/method_context.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "daemon/control/base/addition_change.h"

namespace hapticd::daemon {

Reply invalidParameter(std::string_view field) {
  return {"org.varlink.service.InvalidParameter", {{"parameter", field}}};
}

Reply failed(std::string_view error, std::string reason) {
  return {std::string(error), {{"reason", std::move(reason)}}};
}

const Json* field(const Call& call, std::string_view name) {
  const auto found = call.parameters.find(name);
  return found == call.parameters.end() || found->is_null() ? nullptr : &*found;
}

bool isNumber(const Json& json) {
  return json.is_number() && std::isfinite(json.get<double>());
}

namespace {

bool areNumbers(const Json& json, std::size_t count) {
  return json.is_array() && json.size() == count && std::ranges::all_of(json, isNumber);
}

}  // namespace

bool isVector(const Json& json) {
  return areNumbers(json, 3);
}

bool isQuaternion(const Json& json) {
  return areNumbers(json, 4);
}

std::optional<Reply> refusalOf(const Method& method, const Call& call) {
  for (auto given = call.parameters.begin(); given != call.parameters.end(); ++given) {
    if (std::ranges::find(method.parameters, given.key(), &MethodParameter::name) == method.parameters.end())
      return invalidParameter(given.key());
  }
  for (const MethodParameter& parameter : method.parameters) {
    const Json* const json = field(call, parameter.name);
    if (json && parameter.is && !parameter.is(*json)) return invalidParameter(parameter.name);
  }
  for (const MethodParameter& parameter : method.parameters) {
    if (parameter.need == MethodParameter::required && !field(call, parameter.name))
      return invalidParameter(parameter.name);
  }
  return std::nullopt;
}

std::expected<std::int64_t, Reply> timeField(const Call& call, std::int64_t now_ns) {
  constexpr double kMaxAge_s = 1000;  // what is older says nothing about now
  const Json* const time = field(call, "timeNs");
  const Json* const age = field(call, "ageS");
  if (time && age) return std::unexpected(invalidParameter("timeNs"));
  if (time) return time->get<std::int64_t>();
  if (!age) return now_ns;
  if (std::abs(age->get<double>()) > kMaxAge_s) return std::unexpected(invalidParameter("ageS"));
  return now_ns - static_cast<std::int64_t>(age->get<double>() * 1e9);
}

std::expected<std::optional<std::vector<std::string>>, Reply> textsField(const Call& call, const char* name,
                                                                         std::size_t most) {
  const Json* const json = field(call, name);
  if (!json) return std::nullopt;
  const bool texts = json->is_array() && json->size() <= most && std::ranges::all_of(*json, isText);
  if (!texts) return std::unexpected(invalidParameter(name));
  return json->get<std::vector<std::string>>();
}

void PendingAnswers::add(const Call& call, const Caller& caller, Replies& replies, Unawaited unawaited,
                         Poll poll) {
  if (call.oneway && unawaited == Unawaited::forget) return;
  if (auto reply = poll()) return replies.finish(caller.connection, *reply);
  entries_.push_back({call.oneway ? kNoConnection : caller.connection, unawaited, std::move(poll)});
}

void PendingAnswers::answer(Replies& replies) {
  std::erase_if(entries_, [&](Entry& entry) {
    const auto reply = entry.poll();
    if (reply) replies.finish(entry.connection, *reply);
    return reply.has_value();
  });
}

void PendingAnswers::closed(ConnectionId connection) {
  std::erase_if(entries_, [=](Entry& entry) {
    if (entry.connection != connection) return false;
    entry.connection = kNoConnection;
    return entry.unawaited == Unawaited::forget;
  });
}

void logChange(const MethodContext& context, const Caller& caller, const std::string& change,
               config::EventKind event, JournalFields fields) {
  if (!context.log) return;
  fields.emplace_back("UID", fmt::to_string(caller.uid));
  fields.emplace_back("PID", fmt::to_string(caller.pid));
  context.log({JournalEntry::Priority::notice,
               fmt::format("uid {} (pid {}) {}", caller.uid, caller.pid, change), event, std::move(fields)});
}

std::vector<std::string> logParameters(const MethodContext& context, const Caller& caller,
                                       const std::string& change, const config::Settings& before,
                                       const config::Settings& after) {
  std::vector<std::string> changed;
  for (const ParameterDifference& difference : parameterDifferences(before, after)) {
    logChange(context, caller, (change.empty() ? "" : change + " ") + difference.text(),
              config::EventKind::parameter, difference.fields());
    changed.push_back(difference.name);
  }
  return changed;
}

void logAdditions(const MethodContext& context, const Caller& caller, const std::string& change,
                  const config::SceneAdditions& before, const config::SceneAdditions& after) {
  const std::string begin = change.empty() ? "" : change + " ";
  for (const AdditionDifference& difference : differencesOf(before, after)) {
    logChange(context, caller, begin + difference.text(), difference.kind, difference.fields());
  }
}

PendingAnswers::Poll whenApplied(MethodContext& context, std::uint64_t generation,
                                 std::move_only_function<Reply()> reply,
                                 const std::vector<config::FixtureSettings>* before) {
  using Clock = std::chrono::steady_clock;
  std::vector<config::FixtureSettings> changed;
  if (before != nullptr)
    std::ranges::copy_if(
        context.box.additions().fixtures, std::back_inserter(changed),
        [=](const auto& fixture) { return std::ranges::find(*before, fixture) == before->end(); });
  return [&context, generation, waits_for_solids = before != nullptr, changed = std::move(changed),
          deadline = Clock::now() + context.apply_timeout,
          reply = std::move(reply)]() mutable -> std::optional<Reply> {
    const bool complete = !waits_for_solids || !context.box.readsSolids();
    if (complete && context.box.acknowledgedGeneration() >= generation) {
      // a later change may have removed them
      std::erase_if(changed, [&now = context.box.additions().fixtures](const auto& fixture) {
        return std::ranges::find(now, fixture) == now.end();
      });
      std::string problem = context.box.solidProblem(changed);
      return problem.empty() ? reply() : failed(kFixtureMissing, std::move(problem));
    }
    if (Clock::now() < deadline) return std::nullopt;
    return Reply{"io.hapticd.Control.NotApplied", {{"generation", generation}}};
  };
}

OrderedJson poseJson(const rt::PoseParameters& pose) {
  const auto& [position_m, roll_rad, pitch_rad, yaw_rad] = pose;
  return {{"xM", position_m.x},  {"yM", position_m.y},    {"zM", position_m.z},
          {"rollRad", roll_rad}, {"pitchRad", pitch_rad}, {"yawRad", yaw_rad}};
}

std::optional<rt::PoseParameters> poseFrom(const Json& json) {
  rt::PoseParameters pose;
  const std::array<std::pair<const char*, double*>, 6> values{{{"xM", &pose.position_m.x},
                                                               {"yM", &pose.position_m.y},
                                                               {"zM", &pose.position_m.z},
                                                               {"rollRad", &pose.roll_rad},
                                                               {"pitchRad", &pose.pitch_rad},
                                                               {"yawRad", &pose.yaw_rad}}};
  if (!json.is_object() || json.size() != values.size()) return std::nullopt;
  for (const auto& [name, value] : values) {
    const auto found = json.find(name);
    if (found == json.end() || !found->is_number()) return std::nullopt;
    *value = found->get<double>();
  }
  return pose;
}

}  // namespace hapticd::daemon
