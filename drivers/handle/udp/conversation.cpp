// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/udp/conversation.h"

#include <sys/random.h>

#include <algorithm>
#include <random>

namespace hapticd::drivers::udp {
namespace {

/// How many packets a sender can have sent in that time, by section 4 of protocol.md, at most.
std::uint64_t mostSentWithin(std::int64_t time_ns) {
  constexpr std::uint64_t kMaxPerMs = 5;
  constexpr std::int64_t kNsPerMs = 1'000'000;
  return kMaxPerMs * static_cast<std::uint64_t>(time_ns / kNsPerMs + 1);
}

}  // namespace

std::uint64_t randomSession() {
  std::uint64_t session = 0;
  while (session == 0) {
    // Fails only at boot, before the kernel has gathered entropy.
    if (::getrandom(&session, sizeof session, GRND_NONBLOCK) != sizeof session) {
      std::random_device device;
      session = (std::uint64_t{device()} << 32) | device();
    }
  }
  return session;
}

Header Conversation::numbered(std::int64_t now_ns) {
  Header header;
  header.session = session_;
  header.version = version_;
  header.sequence = ++sent_;
  header.time_ns = now_ns;
  sent_ns_[sent_ % kRememberedSends] = now_ns;
  ++counts_.sent;
  return header;
}

Header Conversation::next(std::int64_t now_ns) {
  Header header = numbered(now_ns);
  if (peer_session_ == 0) return header;
  header.echo = {peer_session_, newest_, static_cast<std::uint64_t>(now_ns - newest_arrived_ns_)};
  return header;
}

Header Conversation::answerTo(const Header& heard, std::int64_t now_ns) {
  Header header = numbered(now_ns);
  header.version = heard.version;
  header.echo = {heard.session, heard.sequence, 0};
  return header;
}

Conversation::Verdict Conversation::hear(const Header& header, std::int64_t now_ns) {
  ++counts_.received;
  const Verdict verdict = judge(header, now_ns);
  switch (verdict) {
    case Verdict::duplicated:
      ++counts_.duplicated;
      break;
    case Verdict::reordered:
      ++counts_.reordered;
      if (counts_.lost > 0) --counts_.lost;  // it was counted as lost when the newer one arrived
      seen_ |= std::uint64_t{1} << (newest_ - header.sequence);
      break;
    case Verdict::unproven:
      ++counts_.rejected;
      if (header.session == peer_session_ && header.sequence > newest_) ++unproven_since_;
      break;
    case Verdict::fresh:
    case Verdict::greeting:
      break;
  }
  return verdict;
}

Conversation::Verdict Conversation::judge(const Header& header, std::int64_t now_ns) {
  const bool followed = header.session == peer_session_;
  const Verdict order_verdict = followed ? order(header.sequence) : Verdict::fresh;
  const bool too_old = order_verdict == Verdict::unproven;
  if (order_verdict != Verdict::fresh && !too_old) return order_verdict;
  if (header.echo.session == 0) return too_old ? Verdict::unproven : Verdict::greeting;
  const auto loop_ns = loopNsOf(header.echo, now_ns);
  if (!loop_ns || header.echo.age_ns > static_cast<std::uint64_t>(*loop_ns)) return Verdict::unproven;
  // Packets of two sessions of the peer may overtake each other; only the later session continues.
  const bool of_later_session = followed || header.echo.sequence > newest_echo_;
  // What answers a packet that was sent after the newest one had arrived is later than that, whatever its
  // number: somebody with the key has numbered ahead.
  const bool in_order = !too_old || *loop_ns <= now_ns - newest_arrived_ns_;
  if (!of_later_session || !in_order) return Verdict::unproven;
  loop_ns_ = *loop_ns;
  round_trip_.add(*loop_ns - static_cast<std::int64_t>(header.echo.age_ns));
  takeOver(header, now_ns);
  return Verdict::fresh;
}

Conversation::Verdict Conversation::order(std::uint64_t sequence) const {
  if (sequence > newest_) return Verdict::fresh;
  const std::uint64_t behind = newest_ - sequence;
  if (behind >= kWindow) return Verdict::unproven;  // too old to know whether it has been received before
  return ((seen_ >> behind) & 1) != 0 ? Verdict::duplicated : Verdict::reordered;
}

std::optional<std::int64_t> Conversation::loopNsOf(const Echo& echo, std::int64_t now_ns) const {
  if (echo.session != session_ || echo.sequence > sent_ || sent_ - echo.sequence >= kRememberedSends) {
    return std::nullopt;
  }
  const std::int64_t loop_ns = now_ns - sent_ns_[echo.sequence % kRememberedSends];
  if (loop_ns < 0 || loop_ns > kFreshNs) return std::nullopt;
  return loop_ns;
}

void Conversation::takeOver(const Header& header, std::int64_t now_ns) {
  if (header.session != peer_session_ || header.sequence < newest_) {
    seen_ = 1;
  } else {
    const std::uint64_t step = header.sequence - newest_;
    const std::uint64_t missing = step - 1;
    // a number farther ahead does not count packets
    const bool possible = missing <= mostSentWithin(now_ns - newest_arrived_ns_ + kFreshNs);
    if (possible) counts_.lost += missing - std::min(missing, unproven_since_);
    seen_ = (step < kWindow ? seen_ << step : 0) | 1;
  }
  version_ = header.version;
  peer_session_ = header.session;
  newest_ = header.sequence;
  newest_arrived_ns_ = now_ns;
  newest_echo_ = std::max(newest_echo_, header.echo.sequence);
  unproven_since_ = 0;
}

LinkStatus Conversation::link() const {
  LinkStatus link = counts_;
  link.round_trip = rt::summaryOf(round_trip_);
  return link;
}

}  // namespace hapticd::drivers::udp
