// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/foxglove_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <utility>

#include "daemon/trace/format/messages.h"
#include "daemon/trace/ros/message_definitions.h"
#include "daemon/trace/ros/message_set.h"
#include "rt/base/clock.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

using Outcome = std::expected<FoxgloveRequest, std::string>;

/// What changes the box or publishes to it; the others ask for information.
constexpr std::array<std::string_view, 2> kChanging{"setParameters", "advertise"};

std::optional<std::uint32_t> idIn(const Json* json) {
  if (json == nullptr || !json->is_number_unsigned()) return std::nullopt;
  const auto id = json->get<std::uint64_t>();
  if (id > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(id);
}

Outcome subscribe(const Json& message) {
  Subscribe request;
  for (const Json& item : listAt(message, "subscriptions")) {
    const auto subscription = idIn(fieldAt(item, "id"));
    const auto channel = idIn(fieldAt(item, "channelId"));
    if (!subscription || !channel)
      return std::unexpected("a subscription needs the numbers id and channelId");
    request.items.push_back({*subscription, *channel});
  }
  return request;
}

Outcome unsubscribe(const Json& message) {
  Unsubscribe request;
  for (const Json& item : listAt(message, "subscriptionIds")) {
    const auto subscription = idIn(&item);
    if (!subscription) return std::unexpected("subscriptionIds must be numbers");
    request.subscriptions.push_back(*subscription);
  }
  return request;
}

Outcome getParameters(const Json& message) {
  GetParameters request;
  for (const Json& name : listAt(message, "parameterNames")) {
    if (!name.is_string()) return std::unexpected("parameterNames must be texts");
    request.names.push_back(name.get<std::string>());
  }
  if (const Json* id = fieldAt(message, "id"); id != nullptr && id->is_string()) {
    request.id = id->get<std::string>();
  }
  return request;
}

}  // namespace

Outcome parseFoxgloveRequest(std::string_view text) {
  const Json message = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (message.is_discarded()) return std::unexpected("the message is not JSON");
  const Json* operation = message.is_object() ? fieldAt(message, "op") : nullptr;
  if (operation == nullptr || !operation->is_string()) {
    return std::unexpected("the message is not an object with the text op");
  }
  const auto op = operation->get<std::string>();
  if (op == "subscribe") return subscribe(message);
  if (op == "unsubscribe") return unsubscribe(message);
  if (op == "getParameters") return getParameters(message);
  if (std::ranges::find(kChanging, op) != kChanging.end()) return Refused{op};
  return Ignored{};
}

namespace {

namespace ros = trace::ros;

/// By the value of FoxgloveChannel.
constexpr std::array<ros::Channel, kFoxgloveChannels> kChannels{
    {{trace::kChannelName<rt::Tick>.topic, ""},
     ros::kSceneChannel,
     ros::kTransformsChannel,
     {"/hapticd/cloud", "sensor_msgs/PointCloud2"},
     ros::kReachCloudChannel,
     {"/hapticd/depth_image", "sensor_msgs/Image"},
     {"/hapticd/camera_calibration", "sensor_msgs/CameraInfo"},
     {"/hapticd/events", "rcl_interfaces/Log"}}};

/// Name and text of the schema of a channel.
std::pair<std::string, std::string> schemaOf(const ros::Channel& channel) {
  if (channel.message.empty())
    return {std::string(trace::kChannelName<rt::Tick>.schema), trace::schemaOf<rt::Tick>()};
  return {ros::fullTypeName(channel.message), ros::completeDefinition(channel.message)};
}

}  // namespace

std::optional<FoxgloveChannel> foxgloveChannelOf(std::uint64_t id) {
  if (id < 1 || id > kFoxgloveChannels) return std::nullopt;
  return static_cast<FoxgloveChannel>(id - 1);
}

Json advertisement() {
  Json channels = Json::array();
  for (std::uint32_t id = 1; id <= kFoxgloveChannels; ++id) {
    const ros::Channel& channel = kChannels[id - 1];
    const auto [name, schema] = schemaOf(channel);
    channels.push_back({{"id", id},
                        {"topic", channel.topic},
                        {"encoding", "cdr"},
                        {"schemaName", name},
                        {"schemaEncoding", "ros2msg"},
                        {"schema", schema}});
  }
  return {{"op", "advertise"}, {"channels", std::move(channels)}};
}

namespace {

using enum FoxgloveChannel;

/// Levels of the message `status`.
constexpr int kInformation = 0, kWarning = 1, kError = 2;

/// Drops are reported this often, in numbers of statuses of the box, which come five times a second.
constexpr int kStatusesPerReport = 10;

/// The key of a subscription's messages; that of a status is its id's hash with the highest bit set.
MessageKey keyOf(std::uint32_t subscription) {
  return static_cast<MessageKey>(std::uint64_t{subscription} + 1);
}
MessageKey keyOfStatus(std::string_view id) {
  constexpr std::uint64_t kMaxBit = std::uint64_t{1} << 63;
  return static_cast<MessageKey>(std::hash<std::string_view>{}(id) | kMaxBit);
}

/// Opcode 1 of the protocol, subscription and time, little-endian.
std::string headOf(std::uint32_t subscription, std::uint64_t realtime_ns) {
  static_assert(std::endian::native == std::endian::little);
  constexpr char kMessageData = 1;
  std::string head(1 + sizeof subscription + sizeof realtime_ns, kMessageData);
  std::memcpy(head.data() + 1, &subscription, sizeof subscription);
  std::memcpy(head.data() + 1 + sizeof subscription, &realtime_ns, sizeof realtime_ns);
  return head;
}

ros::LogLevel levelOf(std::string_view priority) {
  if (priority == "error") return ros::LogLevel::error;
  return priority == "warning" ? ros::LogLevel::warning : ros::LogLevel::info;
}

/// The one with the larger commanded force; of equal ones the newer.
const rt::Tick& largerOf(const rt::Tick& older, const rt::Tick& newer) {
  const double older_n = rt::norm(older.command_force_n_in_world);
  const double newer_n = rt::norm(newer.command_force_n_in_world);
  return newer_n < older_n ? older : newer;
}

}  // namespace

FoxgloveSession::FoxgloveSession(Source& source, MessageSink& sink, const Identity& identity,
                                 Offset offset_ns)
    : source_(source),
      sink_(sink),
      offset_ns_(std::move(offset_ns)),
      window_(rt::kNsPerSecond / kMaxRate_hz) {
  sendText({{"op", "serverInfo"},
            {"name", identity.name},
            {"capabilities", {"parameters"}},
            {"supportedEncodings", Json::array()},
            {"metadata", Json::object()},
            {"sessionId", identity.session}});
  sendText(advertisement());
}

void FoxgloveSession::sendText(const Json& message, MessageKey key) {
  // bytes that are not UTF-8 become U+FFFD: a text message must be valid
  sink_.send(textMessage(message.dump(-1, ' ', false, Json::error_handler_t::replace)), key);
}

void FoxgloveSession::sendStatus(int level, std::string_view id, std::string_view text) {
  sendText({{"op", "status"}, {"level", level}, {"message", text}, {"id", id}}, keyOfStatus(id));
}

void FoxgloveSession::removeStatus(std::string_view id) {
  sendText({{"op", "removeStatus"}, {"statusIds", {id}}}, keyOfStatus(id));
}

void FoxgloveSession::send(std::uint32_t subscription, std::uint64_t realtime_ns, const Payload& payload,
                           MessageKey key) {
  if (key != MessageKey::queued && sink_.waits(key)) ++dropped_;
  sink_.send({.is_text = false,
              .head = headOf(subscription, realtime_ns),
              .body = std::as_bytes(std::span(*payload)),
              .owner = payload},
             key);
}

void FoxgloveSession::publish(FoxgloveChannel channel, std::uint64_t realtime_ns, const Encode& encode) {
  Payload payload;
  for (const auto& [id, subscription] : subscriptions_) {
    if (subscription.channel != channel) continue;
    if (!payload) {
      auto message = std::make_shared<std::string>();
      encode(*message);
      payload = std::move(message);
    }
    send(id, realtime_ns, payload, keyOf(id));
  }
}

bool FoxgloveSession::subscribed(FoxgloveChannel channel) const {
  return std::ranges::any_of(subscriptions_,
                             [channel](const auto& each) { return each.second.channel == channel; });
}

std::uint64_t FoxgloveSession::realtimeOf(std::int64_t monotonic_ns) const {
  return static_cast<std::uint64_t>(monotonic_ns) + static_cast<std::uint64_t>(offset_ns_());
}

bool FoxgloveSession::wantsTicks() const {
  return subscribed(tick) || subscribed(scene) || subscribed(cloud_reach);
}

/// The camera's pose, which does not change while the box runs, comes with any frame.
bool FoxgloveSession::wantsDepth() const {
  return subscribed(cloud) || subscribed(cloud_reach) || subscribed(depth_image) ||
         subscribed(camera_calibration) || (subscribed(transforms) && !camera_);
}

void FoxgloveSession::onTick(const rt::Tick& newest) {
  if (rt::isFinite(newest.hip_m_in_world)) hip_m_in_world_ = newest.hip_m_in_world;
  const std::optional<rt::Tick> ended = window_.add(newest);
  if (!ended) return;
  for (auto& [id, subscription] : subscriptions_) {
    if (subscription.channel == tick || subscription.channel == scene) publishTick(id, subscription, *ended);
  }
}

void FoxgloveSession::publishTick(std::uint32_t id, Subscription& subscription, const rt::Tick& of_window) {
  const rt::Tick shown = subscription.waiting ? largerOf(*subscription.waiting, of_window) : of_window;
  if (subscription.waiting) ++dropped_;
  if (sink_.waits(keyOf(id))) {
    subscription.waiting = shown;
    return;
  }
  subscription.waiting.reset();
  const std::uint64_t realtime_ns = realtimeOf(shown.planned_ns);
  auto message = std::make_shared<std::string>();
  if (subscription.channel == tick) {
    trace::encode(shown, realtime_ns, *message);
  } else {
    ros::encodeScene(realtime_ns, shown, radii_, ball_, *message);
  }
  send(id, realtime_ns, message, keyOf(id));
}

void FoxgloveSession::onStatus(const Json& status) {
  ball_ = {};
  const double radius_m = numberAt(status, "scene.ballRadiusM");
  const rt::Vec3 centre_m{numberAt(status, "scene.ballCentreMInWorld.x"),
                          numberAt(status, "scene.ballCentreMInWorld.y"),
                          numberAt(status, "scene.ballCentreMInWorld.z")};
  if (std::isfinite(radius_m) && rt::isFinite(centre_m)) ball_ = {centre_m, radius_m};
  publishTransforms();
  if (std::exchange(wants_changed_, false)) source_.wantsChanged();
  if (++statuses_ % kStatusesPerReport == 0) reportDropped();
}

void FoxgloveSession::reportDropped() {
  if (dropped_ == dropped_reported_) return;
  dropped_reported_ = dropped_;
  sendStatus(
      kWarning, "dropped",
      fmt::format("{} messages were left out so far, because this client or the link to it is slow (the "
                  "newest is always sent; subscribe to fewer topics)",
                  dropped_));
}

void FoxgloveSession::onParameters(const Json& parameters) {
  parameters_ = parameters;
  for (const auto& [name, value] : parameters.items()) {
    if (value.is_number()) radii_.set(name, value.get<double>());
  }
  unanswered_bytes_ = 0;
  for (const GetParameters& request : std::exchange(unanswered_, {})) answer(request);
}

void FoxgloveSession::onEvent(const Json& event) {
  events_.add(event);
  for (const auto& [id, subscription] : subscriptions_) {
    if (subscription.channel == events) sendEvent(id, event);
  }
}

void FoxgloveSession::sendEvent(std::uint32_t id, const Json& event) {
  const Json* time = fieldAt(event, "timeNs");
  const std::int64_t realtime_ns =
      time != nullptr && time->is_number_integer() ? time->get<std::int64_t>() : 0;
  auto message = std::make_shared<std::string>();
  ros::encodeLog(realtime_ns, levelOf(textAt(event, "priority")), textAt(event, "kind"),
                 textAt(event, "text"), *message);
  send(id, static_cast<std::uint64_t>(realtime_ns), message, MessageKey::queued);
}

void FoxgloveSession::onDepth(const std::shared_ptr<const DepthPicture>& picture) {
  const rt::DepthFrameHeader& header = picture->header;
  const std::uint64_t realtime_ns = realtimeOf(header.arrival_ns);
  const bool camera_known = camera_.has_value();
  camera_ = header;
  if (!camera_known) {
    publishTransforms();
    wants_changed_ = true;
  }
  view_.set(header, picture->image);
  const ros::Header head{static_cast<std::int64_t>(realtime_ns), ros::kOpticalFrame};
  const std::int64_t since_cloud_ns = header.arrival_ns - last_cloud_ns_;
  if (since_cloud_ns >= kCloudPeriod_ns || since_cloud_ns < 0) {  // the box may have started again
    last_cloud_ns_ = header.arrival_ns;
    publish(cloud, realtime_ns, [&](std::string& to) {
      view_.points(xyz_m_, kCloudStep);
      encodePoints(head, xyz_m_, to);
    });
  }
  publish(cloud_reach, realtime_ns, [&](std::string& to) {
    view_.pointsInBall(reach(), xyz_m_);
    encodePoints(head, xyz_m_, to);
  });
  publish(depth_image, realtime_ns, [&](std::string& to) {
    view_.millimetres(image_);
    encodeDepthImage(head, image_, to);
  });
  publish(camera_calibration, realtime_ns,
          [&](std::string& to) { encodeCameraInfo(head, view_.camera(), to); });
}

/// The modelled ball follows the hand, and the newest tick knows better than the status where that is.
ros::ModelledBall FoxgloveSession::reach() const {
  if (!hip_m_in_world_) return ball_;
  return {*hip_m_in_world_, ball_.radius_m > 0 ? ball_.radius_m : kReach_m};
}

void FoxgloveSession::publishTransforms() {
  if (!camera_) return;
  const std::uint64_t realtime_ns = realtimeOf(rt::monotonicNow_ns());
  publish(transforms, realtime_ns,
          [&](std::string& to) { ros::encodeCameraTransforms(realtime_ns, *camera_, to); });
}

void FoxgloveSession::onDepthState(bool available, const std::string& reason) {
  if (available) return removeStatus("depth");
  sendStatus(kWarning, "depth", "no depth: " + reason);
}

void FoxgloveSession::onBox(bool reachable, const std::string& reason) {
  if (!reachable) {
    camera_.reset();  // the box may come back with another one
    hip_m_in_world_.reset();
    wants_changed_ = true;
  }
  if (reason.empty()) return removeStatus("box");
  sendStatus(reachable ? kWarning : kError, "box", reason);
}

void FoxgloveSession::onText(std::string_view message) {
  const auto request = parseFoxgloveRequest(message);
  if (!request) return sendStatus(kError, "request", request.error());
  std::visit([this](const auto& known) { handle(known); }, *request);
}

void FoxgloveSession::handle(const Subscribe& request) {
  for (const auto& [id, channel_id] : request.items) {
    const auto channel = foxgloveChannelOf(channel_id);
    if (!channel) {
      sendStatus(kWarning, "request", fmt::format("there is no channel {}", channel_id));
    } else if (subscriptions_.contains(id)) {
      sendStatus(kWarning, "request", fmt::format("subscription {} is in use already", id));
    } else if (subscriptions_.size() >= kMaxSubscriptions) {
      sendStatus(kWarning, "request", fmt::format("at most {} subscriptions", kMaxSubscriptions));
    } else {
      subscriptions_[id] = {*channel, {}};
      if (*channel == events) {
        events_.forEach([&, id = id](const Json& event) { sendEvent(id, event); });
      }
    }
  }
  publishTransforms();
  source_.wantsChanged();
}

void FoxgloveSession::handle(const Unsubscribe& request) {
  for (const std::uint32_t id : request.subscriptions) {
    if (subscriptions_.erase(id) > 0) sink_.withdraw(keyOf(id));
  }
  source_.wantsChanged();
}

void FoxgloveSession::handle(const GetParameters& request) {
  if (!parameters_.is_null()) return answer(request);
  unanswered_.push_back(request);
  unanswered_bytes_ += unanswered_.back().bytes();
  bool dropped = false;
  while (unanswered_.size() > kMaxWaiting || unanswered_bytes_ > kMaxWaitingBytes) {
    unanswered_bytes_ -= unanswered_.front().bytes();
    unanswered_.pop_front();
    dropped = true;
  }
  if (!dropped) return;
  sendStatus(kWarning, "request",
             "the box does not answer, and too many requests for parameters wait: the oldest is left out");
}

void FoxgloveSession::handle(const Refused& request) {
  sendStatus(
      kWarning, "request",
      fmt::format("{} is refused: this view only shows the box (hapticctl changes it)", request.operation));
}

void FoxgloveSession::answer(const GetParameters& request) {
  Json values = Json::array();
  for (const auto& [name, value] : parameters_.items()) {
    if (!request.names.empty() && std::ranges::find(request.names, name) == request.names.end()) continue;
    Json parameter{{"name", name}, {"value", value}};
    if (value.is_number_float()) parameter["type"] = "float64";
    values.push_back(std::move(parameter));
  }
  Json message{{"op", "parameterValues"}, {"parameters", std::move(values)}};
  if (request.id) message["id"] = *request.id;
  sendText(message);
}

std::unique_ptr<FoxgloveSession> makeFoxgloveSession(Source& source, MessageSink& sink) {
  // a number of its own for each run of the server
  static const std::string run = [] {
    std::random_device random;
    return fmt::format("{:08x}{:08x}", random(), random());
  }();
  return std::make_unique<FoxgloveSession>(
      source, sink,
      FoxgloveSession::Identity{fmt::format("hapticd {}", textAt(source.hello(), "version")), run},
      [] { return rt::realtimeNow_ns() - rt::monotonicNow_ns(); });
}

}  // namespace hapticd::tools::view
