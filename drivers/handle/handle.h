// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>

#include "config/base/error.h"
#include "rt/base/fields.h"
#include "rt/base/latency_histogram.h"
#include "rt/base/words.h"
#include "rt/channels/handle_channel.h"

namespace hapticd::drivers {

/// The channels of a handle's thread: two between it and the force thread, and one to it from the control
/// thread.
struct HandleChannels {
  rt::HandleStateChannel state;      ///< written by the handle thread
  rt::HandleCommandChannel command;  ///< read by the handle thread
  /// To which a person leads the hand of a simulated handle; other drivers ignore it.
  rt::TripleBuffer<rt::Vec3> hand_target_m_in_world;
};

/// Connection state of a handle.
enum class HandlePresence {
  absent,       ///< not found yet; the driver keeps searching
  calibrating,  ///< connected, but its position is unknown; `detail` describes what the person must do
  present,      ///< measuring and exerting
  lost,         ///< was connected; the driver keeps trying to reconnect
};
constexpr auto wordsOf(HandlePresence) {
  return rt::words<HandlePresence>("absent", "calibrating", "present", "lost");
}

/// Statistics of a handle's connection. Counts are since the start.
struct LinkStatus {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t reordered = 0;
  std::uint64_t rejected = 0;
  rt::LatencySummary round_trip = {};
};
template <std::same_as<LinkStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(sent, "Messages sent to the handle").counter("link_sent_messages"),
      HAPTICD_FIELD(received, "Messages received from the handle").counter("link_received_messages"),
      HAPTICD_FIELD(lost, "Messages of the other side that never arrived").counter("link_lost_messages"),
      HAPTICD_FIELD(duplicated, "Messages received twice").counter("link_duplicated_messages"),
      HAPTICD_FIELD(reordered, "Messages received after a newer one").counter("link_reordered_messages"),
      HAPTICD_FIELD(rejected, "Messages that were damaged, forged, from another sender, or out of range")
          .counter("link_rejected_messages"),
      HAPTICD_FIELD(round_trip, "From sending a message to its reply").summary("link_round_trip_seconds")};
}

/// Scheduling of a handle's thread.
struct HandleScheduling {
  int requested_priority = 0;  ///< requested SCHED_FIFO priority; 0: normal scheduling
  int priority = 0;            ///< granted priority
};

/// State of a handle as shown to people and to clients of the control API.
struct HandleStatus {
  HandlePresence state = HandlePresence::absent;
  std::string detail;
  std::string identity;
  std::uint64_t measurements = 0;
  std::uint64_t rejected = 0;
  bool exerts_force = true;
  std::string advice = {};
  std::optional<LinkStatus> link = {};
  HandleScheduling scheduling = {};
  std::optional<rt::LatencySummary> last_hop = {};
};
template <std::same_as<HandleStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(state, "State of the haptic handle").states("handle_state"),
      HAPTICD_FIELD(state, "Whether it is connected and calibrated")
          .named("present")
          .shownAs([](const auto& handle) { return handle.state == HandlePresence::present; }),
      HAPTICD_FIELD(detail, "Why it is not, and what to do; may be empty"),
      HAPTICD_FIELD(identity, "Driver and serial number"),
      HAPTICD_FIELD(measurements, "Measurements of the handle").counter("handle_measurements"),
      HAPTICD_FIELD(rejected, "Measurements of the handle that could not be trusted")
          .counter("handle_rejected"),
      HAPTICD_FIELD(exerts_force, "Whether it exerts forces; an input device does not"),
      HAPTICD_FIELD(advice, "A likely problem of a handle that works, and what to do; may be empty"),
      HAPTICD_FIELD(link, "Statistics of its connection; null: none"),
      HAPTICD_FIELD(scheduling.priority,
                    "SCHED_FIFO priority of the thread of the handle; 0: normal scheduling")
          .named("threadPriority")
          .gauge("handle_thread_priority"),
      HAPTICD_FIELD(scheduling.requested_priority, "The priority requested for its thread")
          .named("wantedThreadPriority"),
      HAPTICD_FIELD(last_hop,
                    "Time from the writing of a command by the force loop until it, or a newer one in its "
                    "place, was sent to the device; null: none was sent")
          .summary("handle_last_hop_seconds")};
}

/// A haptic handle with a thread of its own, which publishes measurements and exerts the newest command.
///
/// Absence or loss of the device is a state from which the driver recovers by itself, never an error of the
/// process. Each time the device is opened or reconnected a new session begins (rt::HandleState::session),
/// and the force loop exerts no force in it before it is engaged again. A driver publishes a measurement only
/// when it has one; without them the force loop treats the handle as stale.
class Handle {
 public:
  virtual ~Handle() = default;
  /// Refuses settings, and files that they name, for the reasons for which start() does; starts nothing.
  virtual base::Result<void> check() const { return {}; }
  /// Starts the driver's thread. `channels` must outlive stop().
  /// Errors: permanent ones only (settings that describe no device, a thread that cannot be started).
  virtual base::Result<void> start(HandleChannels& channels) = 0;
  /// Exerts zero force, then ends the thread. Does nothing if not started.
  virtual void stop() = 0;
  /// Returns the current state.  Thread: any.
  virtual HandleStatus status() const = 0;
};

}  // namespace hapticd::drivers
