// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/live_session.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>
#include <variant>

#include "tools/hapticd-view/live/client_message.h"

namespace hapticd::tools::view {
namespace {

using Clock = LiveSession::Clock;

/// The keys of what a newer message replaces.
enum Key : std::uint64_t { kBox = 1, kDepthState, kParameters, kAdditions, kState, kWindow, kDepth };

MessageKey key(Key value) {
  return static_cast<MessageKey>(value);
}

/// The first byte of a binary message, before what it holds.
constexpr char kDepthFrame = 1;
/// Bytes before the header: kDepthFrame and zeros, so that the header's numbers are aligned.
constexpr std::size_t kPrefixBytes = 8;

/// Bytes that are not UTF-8 become U+FFFD: a text message must be valid.
std::string textOf(const Json& message) {
  return message.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Whether the next of `per_second` events may happen, and if so, when the one after it may. A late one does
/// not delay those after it, so that the mean rate is reached with a source of about the same rate.
bool isDue(Clock::time_point& next, Clock::time_point now, double per_second) {
  if (now < next) return false;
  const auto period =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / per_second));
  next = std::max(next, now - period) + period;
  return true;
}

}  // namespace

LiveSession::LiveSession(Source& source, MessageSink& sink, Now now)
    : source_(source), sink_(sink), now_(std::move(now)) {
  sink_.send(textMessage(textOf(source_.hello())), MessageKey::queued);
}

void LiveSession::onBatchEnd() {
  // while the client has not taken the previous window, this one goes on growing
  if (summary_.empty() || sink_.waits(key(kWindow)) || !isDue(next_window_, now_(), kWindowsPerSecond))
    return;
  sink_.send(textMessage(summary_.message()), key(kWindow));
  summary_.clear();
}

void LiveSession::onStatus(const Json& status) {
  sink_.send(textMessage(textOf({{"type", "state"}, {"ageMs", 0}, {"status", status}})), key(kState));
}

void LiveSession::onParameters(const Json& parameters) {
  sink_.send(textMessage(textOf({{"type", "parameters"}, {"parameters", parameters}})), key(kParameters));
}

void LiveSession::onAdditions(const Json& additions) {
  Json message = additions;
  message["type"] = "additions";
  sink_.send(textMessage(textOf(message)), key(kAdditions));
}

void LiveSession::onEvent(const Json& event) {
  sink_.send(textMessage(textOf({{"type", "event"}, {"event", event}})), MessageKey::queued);
}

void LiveSession::onDepth(const std::shared_ptr<const DepthPicture>& picture) {
  if (depth_max_hz_ <= 0 || !isDue(next_depth_, now_(), depth_max_hz_)) return;
  // A frame on its way cannot be taken back: one more would wait in the buffers of the network and grow old.
  if (reports_drawn_ && drawing_) {
    next_picture_ = picture;
  } else {
    sendPicture(picture);
  }
}

void LiveSession::sendPicture(const std::shared_ptr<const DepthPicture>& picture) {
  drawing_ = true;
  std::string head(kPrefixBytes + sizeof picture->header, '\0');
  head.front() = kDepthFrame;
  std::memcpy(head.data() + kPrefixBytes, &picture->header, sizeof picture->header);
  sink_.send({.is_text = false, .head = std::move(head), .body = picture->image, .owner = picture},
             key(kDepth));
}

void LiveSession::onDepthState(bool available, const std::string& reason) {
  sink_.send(textMessage(textOf({{"type", "depth"}, {"available", available}, {"reason", reason}})),
             key(kDepthState));
}

void LiveSession::onBox(bool reachable, const std::string& reason) {
  sink_.send(textMessage(textOf({{"type", "box"}, {"reachable", reachable}, {"reason", reason}})), key(kBox));
}

void LiveSession::onText(std::string_view message) {
  const auto request = parseClientMessage(message);
  if (!request) return;
  if (std::holds_alternative<Drawn>(*request)) {
    reports_drawn_ = true;
    drawing_ = false;
    if (const auto picture = std::exchange(next_picture_, nullptr)) sendPicture(picture);
    return;
  }
  depth_max_hz_ = std::get<DepthRate>(*request).max_hz;
  source_.wantsChanged();
}

}  // namespace hapticd::tools::view
