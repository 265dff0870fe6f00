// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "config/additions/addition_json.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/methods/methods.h"
#include "rt/base/clock.h"
#include "rt/fixtures/moving_frame.h"

namespace hapticd::daemon {
namespace {

rt::FramePose poseOf(const Call& call, std::int64_t time_ns) {
  const auto [x, y, z] = requiredNumbers<3>(call, "positionM");
  const auto [qx, qy, qz, qw] = requiredNumbers<4>(call, "orientationXyzw");
  rt::FramePose pose{.T_world_frame = {{x, y, z}, {qx, qy, qz, qw}}, .time_ns = time_ns};
  if (field(call, "velocityMPerS")) {
    const auto [vx, vy, vz] = requiredNumbers<3>(call, "velocityMPerS");
    pose.has_velocity = true;
    pose.velocity_m_per_s_in_world = {vx, vy, vz};
  }
  return pose;
}

Reply refused(const std::string& frame, std::string_view cause, std::string_view reason) {
  return {"io.hapticd.Control.PoseRefused", {{"frame", frame}, {"cause", cause}, {"reason", reason}}};
}

Reply unknownFrame(const std::string& name, const std::vector<config::FrameSettings>& frames) {
  OrderedJson names = OrderedJson::array();
  for (const config::FrameSettings& frame : frames) names.push_back(frame.name);
  return {"io.hapticd.Control.UnknownFrame", {{"frame", name}, {"frames", std::move(names)}}};
}

Reply trackedFrame(const config::FrameSettings& frame) {
  return refused(frame.name, "tracked",
                 fmt::format("the depth camera tracks this frame by the fixture {} (remove tracks from the "
                             "frame in the configuration to feed poses)",
                             frame.tracks));
}

}  // namespace

std::vector<Method> FrameMethods::methods() {
  using enum MethodParameter::Need;
  using Self = FrameMethods;
  return {methodOf(this, "io.hapticd.Status.ListFrames", &Self::listFrames),
          methodOf(this, "io.hapticd.Control.FeedPose", &Self::feedPose,
                   {{"frame", isText, required},
                    {"positionM", isVector, required},
                    {"orientationXyzw", isQuaternion, required},
                    {"timeNs", isWhole},
                    {"ageS", isNumber},
                    {"velocityMPerS", isVector}})};
}

void FrameMethods::closed(ConnectionId connection) {
  for (auto& [name, stream] : streams_) stream.feed.closed(connection);
}

void FrameMethods::addWarnings(std::vector<std::string>& list) const {
  for (const auto& [name, stream] : streams_) stream.feed.addWarnings(Clock::now(), list);
}

Answer FrameMethods::listFrames(const Call&, const Caller&) {
  const BoxStatus status = context_.box.status();
  OrderedJson entries = OrderedJson::array();
  const config::SceneAdditions& additions = context_.box.additions();
  for (const config::FrameSettings& frame : additions.frames) {
    OrderedJson fixtures = OrderedJson::array();
    for (const config::FixtureSettings& fixture : additions.fixtures) {
      if (fixture.frame == frame.name) fixtures.push_back(fixture.name);
    }
    const auto found = std::ranges::find(status.frames, frame.name, &FrameStatus::name);
    const FrameStatus now = found == status.frames.end() ? FrameStatus{} : *found;
    const auto shownIf = [](bool known, const OrderedJson& json) { return known ? json : OrderedJson(); };
    const bool placed = now.state != rt::FrameState::none;
    const bool tracks = now.tracking.has_value();
    const rt::Vec3& p = now.position_m_in_world;
    const rt::Quaternion& q = now.orientation;
    entries.push_back({{"name", frame.name},
                       {"origin", nameOf(frame.origin.value)},
                       {"definition", config::definitionOf<OrderedJson>(frame)},
                       {"fixtures", std::move(fixtures)},
                       {"state", nameOf(now.state)},
                       {"refusal", now.refusal ? OrderedJson(rt::wordOf(*now.refusal)) : OrderedJson()},
                       {"ageS", shownIf(placed, now.age_s)},
                       {"lagM", shownIf(placed, now.lag_m)},
                       {"tracking", tracks ? OrderedJson(rt::wordOf(*now.tracking)) : OrderedJson()},
                       {"trackingErrorM", shownIf(tracks, now.tracking_error_m)},
                       {"trackingShare", shownIf(tracks, now.tracking_share)},
                       {"positionM", shownIf(placed, OrderedJson::array({p.x, p.y, p.z}))},
                       {"orientationXyzw", shownIf(placed, OrderedJson::array({q.x, q.y, q.z, q.w}))}});
  }
  return Reply{"", {{"frames", std::move(entries)}}};
}

Answer FrameMethods::feedPose(const Call& call, const Caller& caller) {
  const auto time_ns = timeField(call, rt::monotonicNow_ns());
  if (!time_ns) return time_ns.error();
  rt::FramePose pose = poseOf(call, *time_ns);
  const std::string name = requiredText(call, "frame");
  const std::vector<config::FrameSettings>& frames = context_.box.additions().frames;
  const auto frame = std::ranges::find(frames, name, &config::FrameSettings::name);
  if (frame == frames.end()) return unknownFrame(name, frames);
  if (!frame->tracks.empty()) return trackedFrame(*frame);

  const Clock::time_point now = Clock::now();
  auto [found, is_new] = streams_.try_emplace(name, Feed("poses of frame " + name, kMaxPerSecond));
  auto& [feed, judge] = found->second;
  // of one that sends changes only, silence is no end
  const auto patience =
      frame->keepalive
          ? std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(frame->timeout_s))
          : Clock::duration::max();
  if (const std::string other = feed.refusal(caller, now, patience); !other.empty())
    return refused(name, "other_sender", other);
  pose.frame = config::frameIdentity(name);
  if (!feed.allows(now) || !context_.box.feedPose(pose)) {
    ++limited_[name];
    return feed.limited();
  }
  const rt::PoseFault fault = judge.take(pose, config::rulesOf(*frame), rt::monotonicNow_ns());
  if (fault != rt::PoseFault::none) return refused(name, rt::wordOf(fault), reasonOf(fault));
  if (feed.used(caller, now)) {
    logChange(context_, caller, "feeds " + feed.what(), config::EventKind::frame,
              {{"FRAME", name}, {"ACTION", "feed"}});
  }
  return Reply{"", {{"timeNs", pose.time_ns}}};
}

}  // namespace hapticd::daemon
