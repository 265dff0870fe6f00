// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <expected>
#include <functional>
#include <future>
#include <list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "config/settings/settings.h"
#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/change_history.h"
#include "daemon/control/server/listening_socket.h"
#include "daemon/control/server/varlink_message.h"
#include "daemon/control/server/varlink_server.h"
#include "rt/base/parameters.h"

namespace hapticd::daemon {

/// A parameter of a method. Null is the same as absent.
struct MethodParameter {
  enum Need { optional, required };

  std::string_view name;
  bool (*is)(const Json&) = nullptr;  ///< whether a value is of its type; null: the method looks for itself
  Need need = optional;
};

/// Types of parameters. A number is finite.
inline bool isText(const Json& json) {
  return json.is_string();
}
inline bool isFlag(const Json& json) {
  return json.is_boolean();
}
inline bool isWhole(const Json& json) {
  return json.is_number_integer();
}
inline bool isList(const Json& json) {
  return json.is_array();
}
inline bool isObject(const Json& json) {
  return json.is_object();
}
bool isNumber(const Json& json);
bool isVector(const Json& json);      ///< three numbers
bool isQuaternion(const Json& json);  ///< four

/// The error org.varlink.service.InvalidParameter for that field.
Reply invalidParameter(std::string_view field);
/// An error whose field `reason` holds a text for people.
Reply failed(std::string_view error, std::string reason);

/// The error where the shape of a fixture is not in memory.
inline constexpr const char* kFixtureMissing = "io.hapticd.Control.FixtureMissing";

/// A field of the call's parameters; a null pointer if it is absent or null, which Varlink treats alike.
const Json* field(const Call& call, std::string_view name);

/// A field whose type has been checked; nothing if it is absent.
template <typename T>
std::optional<T> optionalField(const Call& call, const char* name) {
  const Json* const json = field(call, name);
  return json ? std::optional(json->get<T>()) : std::nullopt;
}
inline auto optionalText(const Call& call, const char* name) {
  return optionalField<std::string>(call, name);
}
inline auto optionalFlag(const Call& call, const char* name) {
  return optionalField<bool>(call, name);
}
inline auto optionalNumber(const Call& call, const char* name) {
  return optionalField<double>(call, name);
}
/// One that is there.
inline auto requiredText(const Call& call, const char* name) {
  return call.parameters.at(name).get<std::string>();
}
inline auto requiredNumber(const Call& call, const char* name) {
  return call.parameters.at(name).get<double>();
}
/// As many numbers as its type says.
template <std::size_t kCount>
auto requiredNumbers(const Call& call, const char* name) {
  return call.parameters.at(name).get<std::array<double, kCount>>();
}
/// A list of texts, which may be absent. Errors: InvalidParameter, also for more than `most` texts.
std::expected<std::optional<std::vector<std::string>>, Reply> textsField(const Call& call, const char* name,
                                                                         std::size_t most);
/// When something was measured or computed, CLOCK_MONOTONIC: its member timeNs, or now less its member ageS,
/// or now. Errors: InvalidParameter for both, and for an age beyond 1000 s.
std::expected<std::int64_t, Reply> timeField(const Call& call, std::int64_t now_ns);

template <typename T>
bool isReady(const std::future<T>& future) {
  return future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

/// The calls whose answers are not known yet.
/// Thread: control thread only.
class PendingAnswers {
 public:
  /// Returns the answer, or nothing until it is known. It is called repeatedly, but not again once it
  /// answered.
  using Poll = std::move_only_function<std::optional<Reply>()>;

  /// What to do with a Poll for which nobody waits, because the call was oneway or its client has left.
  enum class Unawaited {
    forget,  ///< drop it: it only reads
    finish,  ///< go on: something has to be done when the answer is known
  };

  /// How many calls may wait; some places are reserved for calls that change something.
  static constexpr std::size_t kMaxReads = 32;
  static constexpr std::size_t kMaxPending = 64;
  /// The reason given to a call that is refused because too many wait.
  static constexpr const char* kFullReason =
      "too many requests wait for the disk or the camera (try again later)";
  /// Whether there is no place for another waiting call.
  bool full(Access access) const noexcept {
    return entries_.size() >= (access == Access::read ? kMaxReads : kMaxPending);
  }

  /// Answers `call` at once, or as soon as it can be.
  void add(const Call& call, const Caller& caller, Replies& replies, Unawaited unawaited, Poll poll);
  /// To be called every few milliseconds.
  void answer(Replies& replies);
  void closed(ConnectionId connection);

 private:
  struct Entry {
    ConnectionId connection;
    Unawaited unawaited;
    Poll poll;
  };

  std::list<Entry> entries_;
};

/// Waits for `future`, then makes the reply from its value.
template <typename T>
PendingAnswers::Poll whenReady(std::future<T> future, std::move_only_function<Reply(T)> replyTo) {
  return [future = std::move(future), replyTo = std::move(replyTo)]() mutable -> std::optional<Reply> {
    if (!isReady(future)) return std::nullopt;
    return replyTo(future.get());
  };
}

/// The answer to a call: at once, or as soon as it is known.
struct Later {
  PendingAnswers::Unawaited unawaited;
  PendingAnswers::Poll poll;
};
using Answer = std::variant<Reply, Later>;

/// A method of an interface, and the function that answers it.
struct Method {
  std::string_view name;  ///< with the interface, "io.hapticd.Status.GetStatus"
  Access access = Access::read;
  bool streams = false;      ///< whether it must be called with the flag "more"
  bool shows_depth = false;  ///< whether it needs Caller::sees_depth
  /// Those that it knows, in the order of the interface text. Wrong ones are refused before it is called.
  std::vector<MethodParameter> parameters = {};
  std::function<Answer(const Call&, const Caller&)> answer = {};
  /// In place of `answer` where it sends replies itself.
  std::function<void(const Call&, const Caller&, Replies&)> stream = {};
};

/// A method that `answer` of `self` answers. Those of io.hapticd.Control are for callers that may control.
template <typename Self>
Method methodOf(Self* self, std::string_view name, Answer (Self::*answer)(const Call&, const Caller&),
                std::vector<MethodParameter> parameters = {}) {
  const bool controls = name.starts_with("io.hapticd.Control.");
  return {.name = name,
          .access = controls ? Access::control : Access::read,
          .parameters = std::move(parameters),
          .answer = std::bind_front(answer, self)};
}

/// InvalidParameter for the first field that the method does not know, else for the first of the wrong type,
/// else for the first one that is missing; nothing: there is none.
std::optional<Reply> refusalOf(const Method& method, const Call& call);

/// Data shared by the methods of all topics.
/// Thread: control thread only.
struct MethodContext {
  Box& box;
  std::chrono::milliseconds apply_timeout{};
  std::function<void(const JournalEntry&)> log = {};  ///< may be empty
  PendingAnswers pending = {};
  ChangeHistory history = {};
};

/// Logs a change as an event; `fields`: of the entry, in addition to those that identify the caller.
void logChange(const MethodContext& context, const Caller& caller, const std::string& change,
               config::EventKind event, JournalFields fields);

/// Logs each live parameter whose value in `after` differs from that in `before`, and returns their names.
/// `change`: stands before the verb of each entry ("by profile soft,"); may be empty.
std::vector<std::string> logParameters(const MethodContext& context, const Caller& caller,
                                       const std::string& change, const config::Settings& before,
                                       const config::Settings& after);

/// Logs each fixture and region that differs. `change`: stands before the verb of each entry ("loads profile
/// soft, which"); may be empty.
void logAdditions(const MethodContext& context, const Caller& caller, const std::string& change,
                  const config::SceneAdditions& before, const config::SceneAdditions& after);

/// Waits until the force loop has taken over `generation`, then answers with `reply()`; after the time-out
/// with io.hapticd.Control.NotApplied. `before`: the fixtures before the change, which are given where it may
/// have changed them: then it waits also until shapes have been read from the disk, and answers with
/// io.hapticd.Control.FixtureMissing where that of a changed fixture cannot be.
PendingAnswers::Poll whenApplied(MethodContext& context, std::uint64_t generation,
                                 std::move_only_function<Reply()> reply,
                                 const std::vector<config::FixtureSettings>* before = nullptr);

/// A pose as the type `Pose` of both interfaces.
OrderedJson poseJson(const rt::PoseParameters& pose);
/// The pose in `json`; nothing if a field is missing, unknown or not a number.
std::optional<rt::PoseParameters> poseFrom(const Json& json);

}  // namespace hapticd::daemon
