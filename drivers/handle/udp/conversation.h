// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/handle/handle.h"
#include "drivers/handle/udp/packet.h"
#include "rt/latency_histogram.h"

namespace hapticd::drivers::udp {

/// A packet that does not show that its sender heard from us within that time says nothing about now.
inline constexpr std::int64_t kFreshNs = 100'000'000;

/// A number that the other side cannot have from an earlier start of ours; never 0.
std::uint64_t randomSession();

/// One side of an exchange as protocol.md describes it: numbers what is sent, and tells of what is heard
/// whether it is new, made by a sender that runs now, and how long the way there and back takes. Both sides
/// use it. Thread: one.  Progress: wait-free.
class Conversation {
 public:
  enum class Verdict {
    fresh,     ///< to be taken over
    greeting,  ///< of a sender that has not heard us; to be answered, nothing else
    unproven,  ///< echoes an earlier session of ours, or a packet too old: replayed, held up, or our answers
               ///< do not arrive; to be answered, nothing else
    duplicated,  ///< has been here before
    reordered,   ///< older than one that was taken over
  };

  explicit Conversation(std::uint64_t session = randomSession()) : session_(session) {}

  /// The header of the next packet to send; it echoes the newest packet that was taken over.
  Header next(std::int64_t now_ns);

  /// The same, but echoes `heard`, which arrived now and has not been taken over.
  Header answerTo(const Header& heard, std::int64_t now_ns);

  /// Judges and counts a packet of the other side that arrived at `now_ns`, CLOCK_MONOTONIC.
  Verdict hear(const Header& header, std::int64_t now_ns);

  /// Counts what arrived and was refused before it could be heard.
  void countRejected() {
    ++counts_.received;
    ++counts_.rejected;
  }

  std::uint64_t session() const { return session_; }
  /// Of the other side; 0 before the first fresh packet.
  std::uint64_t peerSession() const { return peer_session_; }

  /// From sending a packet to hearing its echo, with what the other side waited in between, of the packet
  /// heard last.
  std::int64_t loopNs() const { return loop_ns_; }

  /// `received` counts all that arrived: the fresh, the greetings, and what the other counts name.
  LinkStatus link() const;

 private:
  /// Where the sequence number stands among those that were taken over; it is not kept yet.
  Verdict order(std::uint64_t sequence) const;
  /// From sending the echoed packet until now; nothing: it is not of this session, not sent yet, or sent
  /// longer ago than kFreshNs.
  std::optional<std::int64_t> loopNsOf(const Echo& echo, std::int64_t now_ns) const;
  void takeOver(const Header& header, std::int64_t now_ns);
  Verdict judge(const Header& header, std::int64_t now_ns);
  Header numbered(std::int64_t now_ns);

  static constexpr std::size_t kRememberedSends = 1024;  // more than are sent within kFreshNs
  static constexpr std::uint64_t kWindow = 64;           // bits of seen_

  std::uint64_t session_;
  std::uint64_t sent_ = 0;
  std::array<std::int64_t, kRememberedSends> sent_ns_{};

  std::uint64_t peer_session_ = 0;
  std::uint64_t newest_ = 0;  // sequence number taken over
  std::uint64_t seen_ = 0;    // bit n: newest_ - n has been taken over or counted as reordered
  std::int64_t newest_arrived_ns_ = 0;
  std::uint64_t newest_echo_ = 0;     // sequence number of ours
  std::uint64_t unproven_since_ = 0;  // of this session, since the newest: they are not lost
  std::int64_t loop_ns_ = 0;

  LinkStatus counts_;
  rt::LatencyHistogram round_trip_;
};

}  // namespace hapticd::drivers::udp
