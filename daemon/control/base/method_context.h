// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cmath>
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

/// A method of an interface, and the function that answers it.
struct Method {
  std::string_view name;  ///< with the interface, "io.hapticd.Status.GetStatus"
  Access access = Access::read;
  bool streams = false;                           ///< whether it must be called with the flag "more"
  bool shows_depth = false;                       ///< whether it needs Caller::sees_depth
  std::vector<std::string_view> parameters = {};  ///< names of the parameters that it knows
  std::function<void(const Call&, const Caller&, Replies&)> answer;
};

/// The error org.varlink.service.InvalidParameter for that field.
Reply invalidParameter(std::string_view field);
/// An error whose field `reason` holds a text for people.
Reply failed(std::string_view error, std::string reason);

/// The error where the shape of a fixture is not in memory.
inline constexpr const char* kFixtureMissing = "io.hapticd.Control.FixtureMissing";

/// A field of the call's parameters; a null pointer if it is absent or null, which Varlink treats alike.
const Json* field(const Call& call, const char* name);

/// A field that may be absent. Errors: InvalidParameter if it has another type.
template <typename T>
using Field = std::expected<std::optional<T>, Reply>;
Field<std::string> textField(const Call& call, const char* name);
Field<bool> flagField(const Call& call, const char* name);
/// A list of texts. Errors: InvalidParameter, also for more than `most` texts.
Field<std::vector<std::string>> textsField(const Call& call, const char* name, std::size_t most);
/// Errors: InvalidParameter, also for a number that is not finite.
Field<double> numberField(const Call& call, const char* name);
/// When something was measured or computed, CLOCK_MONOTONIC: its member timeNs, or now less its member ageS,
/// or now. Errors: InvalidParameter, also for both.
std::expected<std::int64_t, Reply> timeField(const Call& call, std::int64_t now_ns);
/// A list of so many finite numbers; nothing if it is absent. Errors: InvalidParameter.
template <std::size_t kCount>
Field<std::array<double, kCount>> numbersField(const Call& call, const char* name) {
  const Json* const json = field(call, name);
  if (!json) return std::nullopt;
  if (!json->is_array() || json->size() != kCount) return std::unexpected(invalidParameter(name));
  std::array<double, kCount> numbers{};
  for (std::size_t i = 0; i < kCount; ++i) {
    const Json& number = (*json)[i];
    if (!number.is_number() || !std::isfinite(number.get<double>()))
      return std::unexpected(invalidParameter(name));
    numbers[i] = number.get<double>();
  }
  return numbers;
}
/// A required field. Errors: InvalidParameter, also if it is absent.
std::expected<std::string, Reply> requiredText(const Call& call, const char* name);

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
