// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "drivers/handle/handle.h"
#include "drivers/handle/udp/packet.h"
#include "rt/base/latency_histogram.h"

namespace hapticd::drivers::udp {

/// Converts times of the other computer's monotonic clock to this one's, assuming for every packet the
/// smallest latency of the last one to two seconds. A delayed packet therefore shows as age, and the spacing
/// of the measurements is preserved. The window follows clock drift.
/// Thread: one.  Progress: wait-free.  RT: safe.
class PeerClock {
 public:
  /// Returns when the packet was made, by our clock; never after `arrived_ns`. The difference of the two
  /// times must not overflow.
  std::int64_t ourTimeNs(std::int64_t their_ns, std::int64_t arrived_ns) {
    const std::int64_t difference_ns = arrived_ns - their_ns;
    if (arrived_ns - window_began_ns_ >= kWindowNs) {
      before_ns_ = window_began_ns_ == 0 ? difference_ns : current_ns_;
      current_ns_ = difference_ns;
      window_began_ns_ = arrived_ns;
    }
    current_ns_ = std::min(current_ns_, difference_ns);
    return their_ns + std::min(current_ns_, before_ns_);
  }

  void reset() { *this = {}; }

 private:
  static constexpr std::int64_t kWindowNs = 1'000'000'000;

  std::int64_t window_began_ns_ = 0;
  std::int64_t current_ns_ = std::numeric_limits<std::int64_t>::max();  // smallest difference in this window
  // Smallest difference in the previous window.
  std::int64_t before_ns_ = std::numeric_limits<std::int64_t>::max();
};

/// The delay that the force loop must assume: the 95th percentile of the last kSamples delays. A median would
/// permit a stiffness for which every other force is too late; a maximum would let one late packet soften the
/// contact.
/// Thread: one.  Progress: wait-free.  RT: safe.
class DelayEstimate {
 public:
  static constexpr std::size_t kSamples = 256;

  void add(std::int64_t delay_ns) {
    samples_[next_] = delay_ns;
    next_ = (next_ + 1) % kSamples;
    count_ = std::min(count_ + 1, kSamples);
  }

  /// Returns the 95th percentile in nanoseconds; 0 without samples.
  std::int64_t ninetyFifthPercentileNs() const {
    if (count_ == 0) return 0;
    std::array<std::int64_t, kSamples> sorted = samples_;
    const auto rank = sorted.begin() + static_cast<std::ptrdiff_t>((count_ - 1) * 95 / 100);
    std::nth_element(sorted.begin(), rank, sorted.begin() + static_cast<std::ptrdiff_t>(count_));
    return *rank;
  }

  void reset() { next_ = count_ = 0; }

 private:
  std::array<std::int64_t, kSamples> samples_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

/// Age limit of an echo: an older one does not prove that the sender is active now.
inline constexpr std::int64_t kFreshNs = 100'000'000;

/// Returns a random session number, which the peer cannot know from an earlier start of ours; never 0.
std::uint64_t randomSession();

/// One side of an exchange as described in protocol.md; used by both sides. It numbers packets to send and
/// determines for received packets whether they are new and from a sender active now, and how long the round
/// trip takes.
/// Thread: one.  Progress: wait-free.
class Conversation {
 public:
  /// Result of checking a received packet.
  enum class Verdict {
    fresh,     ///< valid; to be processed
    greeting,  ///< from a sender that has not received anything from us; to be answered only
    /// Echoes an earlier session of ours or a packet that is too old, or has a number that is too old:
    /// replayed, delayed, or our replies do not arrive; to be answered only.
    unproven,
    duplicated,  ///< received before
    reordered,   ///< older than a packet already processed
  };

  /// `version`: of the packets that are sent until one of the peer was processed; then it is that one's.
  explicit Conversation(std::uint64_t session = randomSession(), std::uint8_t version = kVersion)
      : session_(session), version_(version) {}

  /// Returns the header of the next packet to send; it echoes the newest processed packet.
  Header next(std::int64_t now_ns);

  /// Returns the header of a packet that echoes `heard`, which has just arrived and was not processed.
  Header answerTo(const Header& heard, std::int64_t now_ns);

  /// Checks and counts a packet of the peer that arrived at `now_ns`, CLOCK_MONOTONIC.
  Verdict hear(const Header& header, std::int64_t now_ns);

  /// Counts a packet that was rejected before hear().
  void countRejected() {
    ++counts_.received;
    ++counts_.rejected;
  }

  std::uint64_t session() const { return session_; }
  /// Returns the session of the peer; 0 before the first fresh packet.
  std::uint64_t peerSession() const { return peer_session_; }

  /// Returns the time from sending a packet to receiving its echo, including the peer's waiting time, for the
  /// last packet received.
  std::int64_t loopNs() const { return loop_ns_; }

  /// Returns the statistics; `received` counts everything that arrived: fresh packets, greetings, and those
  /// in the other counters.
  LinkStatus link() const;

 private:
  /// Returns the position of a sequence number relative to those processed, without recording it.
  Verdict order(std::uint64_t sequence) const;
  /// Returns the time since the echoed packet was sent; nothing if it is not of this session, not sent yet,
  /// or was sent longer ago than kFreshNs.
  std::optional<std::int64_t> loopNsOf(const Echo& echo, std::int64_t now_ns) const;
  void takeOver(const Header& header, std::int64_t now_ns);
  Verdict judge(const Header& header, std::int64_t now_ns);
  Header numbered(std::int64_t now_ns);

  static constexpr std::size_t kRememberedSends = 1024;  // more than are sent within kFreshNs
  static constexpr std::uint64_t kWindow = 64;           // bits of seen_

  std::uint64_t session_;
  std::uint8_t version_;
  std::uint64_t sent_ = 0;
  std::array<std::int64_t, kRememberedSends> sent_ns_{};

  std::uint64_t peer_session_ = 0;
  std::uint64_t newest_ = 0;  // newest sequence number processed
  std::uint64_t seen_ = 0;    // bit n: newest_ - n has been processed or counted as reordered
  std::int64_t newest_arrived_ns_ = 0;
  std::uint64_t newest_echo_ = 0;     // sequence number of ours
  std::uint64_t unproven_since_ = 0;  // in this session, since the newest one; they are not lost
  std::int64_t loop_ns_ = 0;

  LinkStatus counts_;
  rt::LatencyHistogram round_trip_;
};

}  // namespace hapticd::drivers::udp
