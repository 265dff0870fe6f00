// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <expected>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "daemon/trace/ros/depth_view.h"
#include "daemon/trace/ros/scene_picture.h"
#include "tools/hapticd-view/live/message_sink.h"
#include "tools/hapticd-view/live/source.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

/// What a client of the Foxglove protocol may ask for.
struct Subscribe {
  struct Item {
    std::uint32_t subscription = 0;  ///< the client's number for it
    std::uint32_t channel = 0;
  };
  std::vector<Item> items;
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
struct GetParameters {
  std::vector<std::string> names;  ///< empty: all
  std::optional<std::string> id;   ///< to be repeated in the answer

  /// What it takes in memory, at most: short texts take none beside themselves.
  std::size_t bytes() const {
    std::size_t sum = sizeof *this + names.capacity() * sizeof names.front() + (id ? id->capacity() : 0);
    for (const std::string& name : names) sum += name.capacity();
    return sum;
  }
};
/// Something that would change the box.
struct Refused {
  std::string operation;
};
/// An operation that this version does not know or that asks for what is not offered.
struct Ignored {};

using FoxgloveRequest = std::variant<Subscribe, Unsubscribe, GetParameters, Refused, Ignored>;

/// Parses a text message from a client.  Errors: what is wrong with it, for people.  Thread: any.
std::expected<FoxgloveRequest, std::string> parseFoxgloveRequest(std::string_view text);

/// What the Foxglove protocol offers, in the messages of traces. Thread: any.
enum class FoxgloveChannel : std::uint8_t {
  tick,
  scene,
  transforms,
  cloud,
  cloud_reach,
  depth_image,
  camera_calibration,
  events,
};
inline constexpr std::size_t kFoxgloveChannels = 8;

/// Its id in the protocol, from 1 on.
constexpr std::uint32_t idOf(FoxgloveChannel channel) {
  return static_cast<std::uint32_t>(channel) + 1;
}
std::optional<FoxgloveChannel> foxgloveChannelOf(std::uint64_t id);

/// The message `advertise` with all of them.
Json advertisement();

/// One client of the Foxglove WebSocket protocol: Foxglove, Lichtblick, PlotJuggler.
///
/// A message is made only for channels that the client has subscribed to, and only from data that it needs.
/// For a slow client only the newest message of each subscription is kept; the messages that it replaces are
/// counted and reported as a status. A peak of the force is never lost: a tick that the client has not taken
/// yet is replaced only by one with at least as large a force. Read-only: nothing that a client sends changes
/// the box.
class FoxgloveSession final : public Session {
 public:
  /// Ticks and scenes a second. Lichtblick warns beyond 60.
  static constexpr std::int64_t kMaxRate_hz = 60;
  /// Least time between two messages of `cloud`: every third frame of a camera with 30 frames a second.
  static constexpr std::int64_t kCloudPeriod_ns = 95'000'000;
  /// `cloud` has every fourth pixel of every fourth row.
  static constexpr std::uint32_t kCloudStep = 4;
  /// Radius of `cloud_reach` around the HIP where the whole frame is modelled.
  static constexpr double kReach_m = 0.1;
  static constexpr std::size_t kMaxSubscriptions = 64;
  /// Requests for parameters that wait until these are known: number, and memory in bytes.
  static constexpr std::size_t kMaxWaiting = 64;
  static constexpr std::size_t kMaxWaitingBytes = 64 * 1024;

  struct Identity {
    std::string name;     ///< of the server
    std::string session;  ///< changes when the server restarts: clients then forget their state
  };
  /// Returns CLOCK_REALTIME minus CLOCK_MONOTONIC of the times that the source delivers.
  using Offset = std::function<std::int64_t()>;

  /// `source` and `sink` outlive the session, which sends at once what the server says first.
  FoxgloveSession(Source& source, MessageSink& sink, const Identity& identity, Offset offset_ns);

  void onTick(const rt::Tick& tick) override;
  void onStatus(const Json& status) override;
  void onParameters(const Json& parameters) override;
  void onEvent(const Json& event) override;
  void onDepth(const std::shared_ptr<const DepthPicture>& picture) override;
  void onDepthState(bool available, const std::string& reason) override;
  void onBox(bool reachable, const std::string& reason) override;
  bool wantsTicks() const override;
  bool wantsDepth() const override;
  void onText(std::string_view message) override;
  std::size_t longestMessage() const override { return 64 * 1024; }

  /// Messages that were replaced before the client had taken them.
  std::uint64_t dropped() const { return dropped_; }

 private:
  struct Subscription {
    FoxgloveChannel channel = FoxgloveChannel::tick;
    std::optional<rt::Tick> waiting;  ///< not sent yet, because the client has not taken the one before
  };
  using Payload = std::shared_ptr<const std::string>;
  using Encode = std::function<void(std::string& to)>;

  void sendText(const Json& message, MessageKey key = MessageKey::queued);
  void sendStatus(int level, std::string_view id, std::string_view text);
  void removeStatus(std::string_view id);
  void send(std::uint32_t subscription, std::uint64_t realtime_ns, const Payload& payload, MessageKey key);
  /// Encodes a message once, and sends it for each subscription of the channel, in place of those waiting.
  void publish(FoxgloveChannel channel, std::uint64_t realtime_ns, const Encode& encode);
  void publishTick(std::uint32_t id, Subscription& subscription, const rt::Tick& tick);
  void publishTransforms();
  void reportDropped();
  bool subscribed(FoxgloveChannel channel) const;
  trace::ros::ModelledBall reach() const;
  std::uint64_t realtimeOf(std::int64_t monotonic_ns) const;

  void handle(const Subscribe& request);
  void handle(const Unsubscribe& request);
  void handle(const GetParameters& request);
  void handle(const Refused& request);
  void handle(const Ignored&) {}
  void answer(const GetParameters& request);
  void sendEvent(std::uint32_t id, const Json& event);

  Source& source_;
  MessageSink& sink_;
  Offset offset_ns_;
  std::map<std::uint32_t, Subscription> subscriptions_;  ///< by the client's number
  trace::ros::TickDecimator window_;
  trace::ros::SceneRadii radii_;
  trace::ros::ModelledBall ball_;
  std::optional<rt::Vec3> hip_m_in_world_;  ///< of the newest tick
  std::optional<rt::DepthFrameHeader> camera_;
  trace::ros::DepthView view_;
  std::vector<float> xyz_m_;
  trace::ros::DepthImage image_;
  /// The source is to be told with the next status: it must not end the stream of frames while it delivers
  /// one.
  bool wants_changed_ = false;
  std::int64_t last_cloud_ns_ = 0;
  Json parameters_;  ///< null: not known yet
  std::deque<GetParameters> unanswered_;
  std::size_t unanswered_bytes_ = 0;
  RecentEvents events_;  ///< for those who subscribe later
  std::uint64_t dropped_ = 0;
  std::uint64_t dropped_reported_ = 0;
  int statuses_ = 0;
};

/// The session of a client that has agreed on the protocol, with the clocks of this computer.
std::unique_ptr<FoxgloveSession> makeFoxgloveSession(Source& source, MessageSink& sink);

}  // namespace hapticd::tools::view
