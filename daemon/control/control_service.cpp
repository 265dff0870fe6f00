#include "daemon/control/control_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "config/parameter_table.h"
#include "daemon/control/interface_texts.h"
#include "daemon/control/names.h"
#include "daemon/control/parameter_json.h"
#include "daemon/control/status_json.h"

namespace hapticd::daemon {
namespace {

constexpr std::int64_t kShortestIntervalMs = 20;
constexpr std::int64_t kLongestIntervalMs = 60'000;
constexpr std::int64_t kDefaultIntervalMs = 200;

struct Interface {
  std::string_view name;
  std::string_view text;
};

const std::array<Interface, 3>& interfaces() {
  static const std::array<Interface, 3> all{{{"org.varlink.service", kServiceInterfaceText},
                                             {"io.hapticd.Status", kStatusInterfaceText},
                                             {"io.hapticd.Control", kControlInterfaceText}}};
  return all;
}

const Interface* findInterface(std::string_view name) {
  const auto found = std::ranges::find(interfaces(), name, &Interface::name);
  return found == interfaces().end() ? nullptr : &*found;
}

Reply invalidParameter(std::string_view field) {
  return {"org.varlink.service.InvalidParameter", {{"parameter", field}}};
}

/// Which error an unknown method is: the interface may be the unknown part.
Reply unknownMethod(const std::string& method) {
  const std::size_t dot = method.rfind('.');
  const std::string interface = method.substr(0, dot == std::string::npos ? 0 : dot);
  if (dot == std::string::npos || findInterface(interface)) {
    return {"org.varlink.service.MethodNotFound", {{"method", method}}};
  }
  return {"org.varlink.service.InterfaceNotFound", {{"interface", interface}}};
}

/// The field of the call's parameters; null when it is absent or null, which Varlink takes for the same.
const Json* field(const Call& call, const char* name) {
  const auto found = call.parameters.find(name);
  return found == call.parameters.end() || found->is_null() ? nullptr : &*found;
}

/// The first field that the method does not know.
std::optional<std::string> unknownField(const Call& call, const std::vector<std::string_view>& known) {
  for (auto given = call.parameters.begin(); given != call.parameters.end(); ++given) {
    if (std::ranges::find(known, given.key()) == known.end()) return given.key();
  }
  return std::nullopt;
}

/// Milliseconds; nothing when the call's value is not acceptable.
std::optional<std::int64_t> intervalOf(const Call& call) {
  const Json* interval = field(call, "intervalMs");
  if (!interval) return kDefaultIntervalMs;
  if (!interval->is_number_integer()) return std::nullopt;
  const auto milliseconds = interval->get<std::int64_t>();
  if (milliseconds < kShortestIntervalMs || milliseconds > kLongestIntervalMs) return std::nullopt;
  return milliseconds;
}

bool isListOfStrings(const Json& json) {
  return json.is_array() && std::ranges::all_of(json, [](const Json& item) { return item.is_string(); });
}

void addTick(const rt::Tick& tick, WindowSummary& window) {
  const double force_n = rt::norm(tick.command_force_n_in_world);
  const bool first = window.ticks++ == 0;
  if (rt::inContact(tick)) ++window.contact_ticks;
  window.min_force_n = first ? force_n : std::min(window.min_force_n, force_n);
  window.max_force_n = first ? force_n : std::max(window.max_force_n, force_n);
  window.max_wakeup_latency_ns =
      first ? tick.wakeup_latency_ns : std::max(window.max_wakeup_latency_ns, tick.wakeup_latency_ns);
}

}  // namespace

ControlService::ControlService(Box& box, ControlServiceOptions options)
    : box_(box), options_(std::move(options)) {}

const std::vector<ControlService::Method>& ControlService::methods() {
  using enum Access;
  using Self = ControlService;
  static const std::vector<Method> all = {
      {"org.varlink.service.GetInfo", read, false, {}, &Self::getInfo},
      {"org.varlink.service.GetInterfaceDescription",
       read,
       false,
       {"interface"},
       &Self::getInterfaceDescription},
      {"io.hapticd.Status.GetStatus", read, false, {}, &Self::getStatus},
      {"io.hapticd.Status.GetParameters", read, false, {"names"}, &Self::getParameters},
      {"io.hapticd.Status.Monitor", read, true, {"intervalMs"}, &Self::monitor},
      {"io.hapticd.Control.SetParameters", control, false, {"parameters"}, &Self::setParameters},
      {"io.hapticd.Control.Engage", control, false, {"insideSurface"}, &Self::engage},
      {"io.hapticd.Control.Disengage", control, false, {}, &Self::disengage},
  };
  return all;
}

void ControlService::handle(const Call& call, const Caller& caller, Replies& replies) {
  const ConnectionId id = caller.connection;
  const auto method = std::ranges::find(methods(), call.method, &Method::name);
  if (method == methods().end()) return replies.finish(id, unknownMethod(call.method));
  if (method->access == Access::control && caller.access != Access::control) {
    return replies.finish(id, {"org.varlink.service.PermissionDenied"});
  }
  if (call.upgrade) {
    return replies.finish(id, {"org.varlink.service.MethodNotImplemented", {{"method", call.method}}});
  }
  if (method->streams && !call.more) return replies.finish(id, {"org.varlink.service.ExpectedMore"});
  if (const auto unknown = unknownField(call, method->parameters)) {
    return replies.finish(id, invalidParameter(*unknown));
  }
  (this->*method->answer)(call, caller, replies);
}

void ControlService::closed(ConnectionId connection) {
  std::erase_if(waiting_, [=](const Waiting& waiting) { return waiting.connection == connection; });
  std::erase_if(streams_, [=](const Stream& stream) { return stream.connection == connection; });
}

void ControlService::onTick(const rt::Tick& tick) {
  for (Stream& stream : streams_) addTick(tick, stream.window);
}

void ControlService::onEvent(const JournalEntry&) {}

void ControlService::periodic(Replies& replies) {
  answerWaiting(replies);
  feedStreams(replies);
}

void ControlService::getInfo(const Call&, const Caller& caller, Replies& replies) {
  OrderedJson names = OrderedJson::array();
  for (const Interface& interface : interfaces()) names.push_back(interface.name);
  replies.finish(caller.connection, {"",
                                     {{"vendor", "hapticd"},
                                      {"product", "hapticd"},
                                      {"version", kProductVersion},
                                      {"url", kProductUrl},
                                      {"interfaces", std::move(names)}}});
}

void ControlService::getInterfaceDescription(const Call& call, const Caller& caller, Replies& replies) {
  const Json* name = field(call, "interface");
  if (!name || !name->is_string()) return replies.finish(caller.connection, invalidParameter("interface"));
  const Interface* interface = findInterface(name->get<std::string>());
  if (!interface) {
    return replies.finish(caller.connection, {"org.varlink.service.InterfaceNotFound",
                                              {{"interface", name->get<std::string>()}}});
  }
  replies.finish(caller.connection, {"", {{"description", interface->text}}});
}

void ControlService::getStatus(const Call&, const Caller& caller, Replies& replies) {
  replies.finish(caller.connection, {"", {{"status", statusJson(box_.status())}}});
}

void ControlService::getParameters(const Call& call, const Caller& caller, Replies& replies) {
  const Json* names = field(call, "names");
  OrderedJson rows = OrderedJson::array();
  if (!names) {
    for (const config::Parameter& row : config::parameterTable())
      rows.push_back(parameterJson(row, box_.settings()));
    return replies.finish(caller.connection, {"", {{"parameters", std::move(rows)}}});
  }
  // More names than rows are repetitions, which nobody needs and which would make the reply arbitrarily long.
  if (!isListOfStrings(*names) || names->size() > config::parameterTable().size()) {
    return replies.finish(caller.connection, invalidParameter("names"));
  }
  OrderedJson problems = OrderedJson::array();
  for (const Json& item : *names) {
    const auto name = item.get<std::string>();
    if (const config::Parameter* row = config::findParameter(name)) {
      rows.push_back(parameterJson(*row, box_.settings()));
    } else {
      problems.push_back({{"parameter", name}, {"reason", reasonOf(config::unknownParameter(name))}});
    }
  }
  if (problems.empty()) return replies.finish(caller.connection, {"", {{"parameters", std::move(rows)}}});
  replies.finish(caller.connection,
                 {"io.hapticd.Status.UnknownParameter", {{"problems", std::move(problems)}}});
}

void ControlService::monitor(const Call& call, const Caller& caller, Replies& replies) {
  const auto interval = intervalOf(call);
  if (!interval) return replies.finish(caller.connection, invalidParameter("intervalMs"));
  const std::chrono::milliseconds period(*interval);
  streams_.push_back({caller.connection, period, Clock::now() + period, WindowSummary{}, 0});
  replies.offer(caller.connection, streamReply(streams_.back(), statusJson(box_.status())));
}

void ControlService::setParameters(const Call& call, const Caller& caller, Replies& replies) {
  const Json* changes = field(call, "parameters");
  if (!changes || !changes->is_object())
    return replies.finish(caller.connection, invalidParameter("parameters"));
  const auto settings = changedSettings(box_.settings(), *changes);
  if (!settings) return replies.finish(caller.connection, settings.error());

  for (auto change = changes->begin(); change != changes->end(); ++change) {
    const config::Parameter& parameter = *config::findParameter(change.key());
    const std::string old_value = config::toText(parameter.get(box_.settings()));
    const std::string new_value = config::toText(parameter.get(*settings));
    log(caller, fmt::format("sets {} from {} to {}", change.key(), old_value, new_value),
        {{"EVENT", "parameter"}, {"PARAMETER", change.key()}, {"OLD", old_value}, {"NEW", new_value}});
  }
  answerWhenApplied(call, caller, replies, box_.apply(*settings), Awaited::generation);
}

void ControlService::engage(const Call& call, const Caller& caller, Replies& replies) {
  const Json* inside = field(call, "insideSurface");
  if (inside && !inside->is_boolean()) {
    return replies.finish(caller.connection, invalidParameter("insideSurface"));
  }
  const bool anywhere = inside && inside->get<bool>();
  log(caller, anywhere ? "engages, inside a surface too" : "engages", {{"EVENT", "engage"}});
  answerWhenApplied(call, caller, replies, box_.engage(true, anywhere), Awaited::engaged);
}

void ControlService::disengage(const Call& call, const Caller& caller, Replies& replies) {
  log(caller, "disengages", {{"EVENT", "disengage"}});
  answerWhenApplied(call, caller, replies, box_.engage(false, false), Awaited::mode);
}

void ControlService::answerWhenApplied(const Call& call, const Caller& caller, Replies& replies,
                                       std::uint64_t generation, Awaited awaited) {
  if (call.oneway) return;
  waiting_.push_back({caller.connection, generation, Clock::now() + options_.apply_timeout, awaited});
  answerWaiting(replies);
}

void ControlService::answerWaiting(Replies& replies) {
  if (waiting_.empty()) return;
  const std::uint64_t applied = box_.acknowledgedGeneration();
  const Clock::time_point now = Clock::now();
  std::erase_if(waiting_, [&](const Waiting& waiting) {
    if (applied >= waiting.generation) {
      replies.finish(waiting.connection, appliedReply(waiting));
    } else if (now >= waiting.deadline) {
      replies.finish(waiting.connection,
                     {"io.hapticd.Control.NotApplied", {{"generation", waiting.generation}}});
    } else {
      return false;
    }
    return true;
  });
}

Reply ControlService::appliedReply(const Waiting& waiting) {
  if (waiting.awaited == Awaited::generation) return {"", {{"generation", waiting.generation}}};
  const rt::Tick tick = box_.status().loop.tick;
  if (waiting.awaited == Awaited::engaged && tick.mode == rt::Mode::idle) {
    return {"io.hapticd.Control.Refused", {{"cause", nameOf(tick.cause)}}};
  }
  return {"", {{"mode", nameOf(tick.mode)}, {"cause", nameOf(tick.cause)}}};
}

void ControlService::log(const Caller& caller, const std::string& change, JournalFields fields) const {
  if (!options_.log) return;
  fields.emplace_back("UID", fmt::to_string(caller.uid));
  fields.emplace_back("PID", fmt::to_string(caller.pid));
  options_.log({JournalEntry::Priority::notice,
                fmt::format("uid {} (pid {}) {}", caller.uid, caller.pid, change), std::move(fields)});
}

void ControlService::feedStreams(Replies& replies) {
  const Clock::time_point now = Clock::now();
  std::optional<OrderedJson> status;  // one for all streams that are due
  for (Stream& stream : streams_) {
    if (now < stream.due) continue;
    stream.due += (now - stream.due) / stream.interval * stream.interval + stream.interval;
    if (!status) status = statusJson(box_.status());
    if (replies.offer(stream.connection, streamReply(stream, *status))) {
      stream.window = WindowSummary{};
    } else {
      ++stream.dropped;  // the window goes on until somebody has read it
    }
  }
}

Reply ControlService::streamReply(const Stream& stream, const OrderedJson& status) {
  return {"",
          {{"status", status}, {"window", windowJson(stream.window)}, {"droppedCount", stream.dropped}},
          true};
}

}  // namespace hapticd::daemon
