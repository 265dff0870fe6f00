// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/error.h"
#include "rt/handle_channel.h"
#include "rt/latency_histogram.h"
#include "rt/words.h"

namespace hapticd::drivers {

/// The two channels between a handle's thread and the force thread.
struct HandleChannels {
  rt::HandleStateChannel state;      ///< handle thread writes
  rt::HandleCommandChannel command;  ///< handle thread reads
};

enum class HandlePresence {
  absent,       ///< not found yet; the driver keeps looking
  calibrating,  ///< there, but it does not know yet where it is; `detail` says what the person has to do
  present,      ///< measures and exerts
  lost,         ///< was there; the driver keeps trying to get it back
};
constexpr auto wordsOf(HandlePresence) {
  return rt::words<HandlePresence>("absent", "calibrating", "present", "lost");
}

/// What is measured continuously of a handle's connection. Counts are since the start.
struct LinkStatus {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  std::uint64_t lost = 0;        ///< of the other side's, by their sequence numbers
  std::uint64_t duplicated = 0;  ///< came twice; refused
  std::uint64_t reordered = 0;   ///< came after a newer one; refused
  std::uint64_t rejected = 0;    ///< damaged, forged, from a stranger, or with values out of range
  std::uint64_t round_trip_p50_ns = 0;
  std::uint64_t round_trip_p99_ns = 0;
  std::uint64_t round_trip_p999_ns = 0;
  std::uint64_t round_trip_max_ns = 0;
};

/// How a handle's thread is scheduled.
struct HandleScheduling {
  int wanted_priority = 0;  ///< SCHED_FIFO; 0: as all other threads
  int priority = 0;         ///< what this process may have of it
};

struct HandleStatus {
  HandlePresence state = HandlePresence::absent;
  std::string detail;              ///< for people: why it is absent or lost, and what to do
  std::string identity;            ///< driver and serial number
  std::uint64_t measurements = 0;  ///< taken over since the start
  std::uint64_t rejected = 0;      ///< measurements that could not be trusted, since the start
  bool exerts_force = true;        ///< false: an input device, forces are discarded
  std::string advice = {};         ///< for people: what is doubtful about a handle that works; may be empty
  std::optional<LinkStatus> link = {};
  HandleScheduling scheduling = {};
  /// From the writing of a command by the force thread to its sending to the device, or that of a newer one
  /// in its place; nothing: none was sent.
  std::optional<rt::LatencySummary> last_hop = {};
};

/// A haptic handle with a thread of its own: it publishes measurements and exerts the newest command.
///
/// Absence or loss of the device is a state that the driver recovers from by itself, never an error of the
/// process. Each time that the device is opened or comes back a new session begins
/// (rt::HandleState::session), and the force loop exerts nothing in it before it has been asked to engage
/// again. A driver publishes a measurement only when it has one: without them the force loop takes the handle
/// for stale.
class Handle {
 public:
  virtual ~Handle() = default;
  /// Starts the driver's thread. `channels` outlive stop().
  /// Errors: permanent ones only (settings that describe no device, a thread that cannot be started).
  virtual config::Result<void> start(HandleChannels& channels) = 0;
  /// Exerts zero force, then ends the thread. Harmless when not started.
  virtual void stop() = 0;
  /// Thread: any.
  virtual HandleStatus status() const = 0;
};

}  // namespace hapticd::drivers
