// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/live_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <variant>

#include "rt/base/words.h"
#include "rt/laws/law_table.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

namespace {

std::optional<ClientMessage> fixtureRequest(const Json& message) {
  const auto add = message.find("add");
  const auto remove = message.find("remove");
  if (add != message.end() && add->is_object()) return FixtureRequest{.add = *add};
  if (remove != message.end() && remove->is_string()) return FixtureRequest{.remove = *remove};
  return std::nullopt;
}

std::optional<ClientMessage> handTarget(const Json& message) {
  const auto target = message.find("target");
  if (target == message.end() || !target->is_array() || target->size() != 3) return std::nullopt;
  if (!std::ranges::all_of(*target, [](const Json& one) { return one.is_number(); })) return std::nullopt;
  const rt::Vec3 place{(*target)[0], (*target)[1], (*target)[2]};
  return std::isfinite(rt::norm(place)) ? std::optional<ClientMessage>(HandTarget{place}) : std::nullopt;
}

}  // namespace

std::string nameIn(const FixtureRequest& request) {
  if (request.add.is_null()) return request.remove;
  const auto name = request.add.find("name");
  return name != request.add.end() && name->is_string() ? name->get<std::string>() : "";
}

void Source::changeFixture(Viewer& viewer, const FixtureRequest& request) {
  viewer.onFixtureAnswer(
      nameIn(request),
      "nothing was changed: hapticd-view may not change the box (start it with --add-fixtures)");
}

void Source::moveHand(Viewer& viewer, const rt::Vec3& /*target_m_in_world*/) {
  viewer.onHandAnswer("hapticd-view may not move the hand (start it with --move-hand)");
}

std::optional<ClientMessage> parseClientMessage(std::string_view text) {
  constexpr double kFastestDepthHz = 1000;
  // depth is bounded by the length of a message, which is bounded by Session::longestMessage()
  const Json message = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!message.is_object()) return std::nullopt;
  const auto type = message.find("type");
  if (type == message.end()) return std::nullopt;
  if (*type == "drawn") return Drawn{};
  if (*type == "fixture") return fixtureRequest(message);
  if (*type == "hand") return handTarget(message);
  const auto max_hz = message.find("maxHz");
  if (*type != "depth" || max_hz == message.end() || !max_hz->is_number()) return std::nullopt;
  const double hz = max_hz->get<double>();
  return hz >= 0 && hz <= kFastestDepthHz ? std::optional<ClientMessage>(DepthRate{hz}) : std::nullopt;
}

namespace {

std::string numberText(double number) {
  return std::isfinite(number) ? fmt::format("{}", number) : "null";  // the shortest that reads back
}

std::string vectorText(const rt::Vec3& vector) {
  return fmt::format("[{},{},{}]", numberText(vector.x), numberText(vector.y), numberText(vector.z));
}

/// "[x,y,z,w]"; null: not measured.
std::string orientationText(const rt::HandleState& handle) {
  if (!handle.has_orientation) return "null";
  const rt::Quaternion& q = handle.orientation_in_world;
  return fmt::format("[{},{},{},{}]", numberText(q.x), numberText(q.y), numberText(q.z), numberText(q.w));
}

/// Share of the forces of fixtures that is exerted: none while the box is not engaged. The stiffness limit,
/// which is in Tick::gain too, is in these forces already.
double fixtureShare(const rt::Tick& tick) {
  return tick.stiffness_gain > 0 ? tick.gain / tick.stiffness_gain : 0;
}

}  // namespace

void TickSummary::add(const rt::Tick& tick) {
  const double force_n = rt::norm(tick.command_force_n_in_world);
  if (force_n > max_force_n_) max_force_n_ = force_n;  // not of a value that is not a number
  if (rt::rowOf(tick.law).has_proxy) {
    const double penetration_m = rt::norm(tick.proxy_m_in_world - tick.hip_m_in_world);
    if (penetration_m > max_penetration_m_) max_penetration_m_ = penetration_m;
    has_penetration_ = true;
  }
  max_scene_age_ns_ = std::max(max_scene_age_ns_, tick.scene_age_ns);
  max_wakeup_latency_ns_ = std::max(max_wakeup_latency_ns_, tick.wakeup_latency_ns);
  if (rt::inContact(tick)) ++contact_ticks_;
  if (fixtureShare(tick) > 0) fixture_contacts_ |= tick.fixtures_in_contact;
  ++ticks_;
  newest_ = tick;
}

std::string TickSummary::message() const {
  const bool has_proxy = rt::rowOf(newest_.law).has_proxy;
  const double fixture_share = fixtureShare(newest_);
  const bool held_back = newest_.fixture_proxy_m_in_world != newest_.hip_m_in_world;
  return fmt::format(
      R"({{"type":"window","ticks":{},"lost":{},"number":{},"timeNs":{},"hip":{},"orientation":{},"proxy":{},"force":{},)"
      R"("forceMaxN":{},"penetrationMaxM":{},"sceneAgeMaxNs":{},"wakeupLatencyMaxNs":{},"contact":{},)"
      R"("contactTicks":{},"gain":{},"law":"{}","sceneFrame":{},"fixtureContacts":{},"nearestFixture":{},)"
      R"("fixtureDistanceM":{},"fixtureProxy":{},"fixtureForce":{},"guidanceForce":{},"tissueRegion":{}}})",
      ticks_, lost_, newest_.number, newest_.planned_ns, vectorText(newest_.hip_m_in_world),
      orientationText(newest_.handle), has_proxy ? vectorText(newest_.proxy_m_in_world) : "null",
      vectorText(newest_.command_force_n_in_world), numberText(max_force_n_),
      has_penetration_ ? numberText(max_penetration_m_) : "null", max_scene_age_ns_, max_wakeup_latency_ns_,
      has_proxy ? fmt::format("\"{}\"", rt::wordOf(newest_.contact)) : "null", contact_ticks_,
      numberText(newest_.gain), rt::wordOf(newest_.law), newest_.scene_frame, fixture_contacts_,
      newest_.nearest_fixture, numberText(newest_.fixture_distance_m),
      held_back ? vectorText(newest_.fixture_proxy_m_in_world) : "null",
      vectorText(fixture_share * newest_.fixture_force_n_in_world),
      vectorText(fixture_share * newest_.guidance_force_n_in_world), newest_.tissue_region);
}

namespace {

using Clock = LiveSession::Clock;

/// The keys of what a newer message replaces.
enum Key : std::uint64_t {
  kBox = 1,
  kDepthState,
  kParameters,
  kAdditions,
  kSolids,
  kState,
  kWindow,
  kDepth,
  kHand
};

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

LiveSession::LiveSession(Source& source, MessageSink& sink, Now now,
                         std::function<void(const std::string& problem)> on_refused)
    : source_(source), sink_(sink), now_(std::move(now)), on_refused_(std::move(on_refused)) {
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

void LiveSession::onSolids(const Json& shapes) {
  sink_.send(textMessage(textOf({{"type", "solids"}, {"solids", shapes}})), key(kSolids));
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

void LiveSession::onFixtureAnswer(const std::string& name, const std::string& problem) {
  if (!problem.empty() && on_refused_) on_refused_(problem);
  sink_.send(textMessage(textOf({{"type", "fixture"}, {"name", name}, {"problem", problem}})),
             MessageKey::queued);
}

void LiveSession::onHandAnswer(const std::string& problem) {
  sink_.send(textMessage(textOf({{"type", "hand"}, {"problem", problem}})), key(kHand));
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
  if (const auto* fixture = std::get_if<FixtureRequest>(&*request))
    return source_.changeFixture(*this, *fixture);
  if (const auto* hand = std::get_if<HandTarget>(&*request))
    return source_.moveHand(*this, hand->target_m_in_world);
  depth_max_hz_ = std::get<DepthRate>(*request).max_hz;
  source_.wantsChanged();
}

}  // namespace hapticd::tools::view
