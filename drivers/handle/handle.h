// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/base/error.h"
#include "rt/base/latency_histogram.h"
#include "rt/base/words.h"
#include "rt/channels/handle_channel.h"

namespace hapticd::drivers {

/// The two channels between a handle's thread and the force thread.
struct HandleChannels {
  rt::HandleStateChannel state;      ///< written by the handle thread
  rt::HandleCommandChannel command;  ///< read by the handle thread
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
  std::uint64_t lost = 0;        ///< of the other side's packets, by their sequence numbers
  std::uint64_t duplicated = 0;  ///< received twice; rejected
  std::uint64_t reordered = 0;   ///< received after a newer one; rejected
  std::uint64_t rejected = 0;    ///< damaged, forged, from an unknown peer, or with values out of range
  rt::LatencySummary round_trip = {};
};

/// Scheduling of a handle's thread.
struct HandleScheduling {
  int requested_priority = 0;  ///< requested SCHED_FIFO priority; 0: normal scheduling
  int priority = 0;            ///< granted priority
};

/// State of a handle as shown to people and to clients of the control API.
struct HandleStatus {
  HandlePresence state = HandlePresence::absent;
  std::string detail;              ///< for people: why it is absent or lost, and what to do
  std::string identity;            ///< driver name and serial number
  std::uint64_t measurements = 0;  ///< accepted since the start
  std::uint64_t rejected = 0;      ///< measurements rejected as implausible since the start
  bool exerts_force = true;        ///< false: an input device; forces are discarded
  std::string advice = {};         ///< for people: a likely problem of a working handle; may be empty
  std::optional<LinkStatus> link = {};
  HandleScheduling scheduling = {};
  /// Time from the writing of a command by the force thread until it, or a newer one in its place, was sent
  /// to the device; nothing: none sent.
  std::optional<rt::LatencySummary> last_hop = {};
};

/// A haptic handle with a thread of its own, which publishes measurements and exerts the newest command.
///
/// Absence or loss of the device is a state from which the driver recovers by itself, never an error of the
/// process. Each time the device is opened or reconnected a new session begins (rt::HandleState::session),
/// and the force loop exerts no force in it before it is engaged again. A driver publishes a measurement only
/// when it has one; without them the force loop treats the handle as stale.
class Handle {
 public:
  virtual ~Handle() = default;
  /// Starts the driver's thread. `channels` must outlive stop().
  /// Errors: permanent ones only (settings that describe no device, a thread that cannot be started).
  virtual base::Result<void> start(HandleChannels& channels) = 0;
  /// Exerts zero force, then ends the thread. Does nothing if not started.
  virtual void stop() = 0;
  /// Returns the current state.  Thread: any.
  virtual HandleStatus status() const = 0;
};

}  // namespace hapticd::drivers
