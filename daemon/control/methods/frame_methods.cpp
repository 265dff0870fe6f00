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

std::expected<rt::FramePose, Reply> poseOf(const Call& call, std::int64_t now_ns) {
  // A wrong type is named before what is missing, as for every method.
  const auto position = numbersField<3>(call, "positionM");
  if (!position) return std::unexpected(position.error());
  const auto orientation = numbersField<4>(call, "orientationXyzw");
  if (!orientation) return std::unexpected(orientation.error());
  const auto velocity = numbersField<3>(call, "velocityMPerS");
  if (!velocity) return std::unexpected(velocity.error());
  const auto time_ns = timeField(call, now_ns);
  if (!time_ns) return std::unexpected(time_ns.error());
  if (!field(call, "frame")) return std::unexpected(invalidParameter("frame"));
  if (!*position) return std::unexpected(invalidParameter("positionM"));
  if (!*orientation) return std::unexpected(invalidParameter("orientationXyzw"));
  const auto& [x, y, z] = **position;
  const auto& [qx, qy, qz, qw] = **orientation;
  rt::FramePose pose{.T_world_frame = {{x, y, z}, {qx, qy, qz, qw}}, .time_ns = *time_ns};
  if (*velocity) {
    pose.has_velocity = true;
    pose.velocity_m_per_s_in_world = {(**velocity)[0], (**velocity)[1], (**velocity)[2]};
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
  using enum Access;
  using Self = FrameMethods;
  return {{.name = "io.hapticd.Status.ListFrames", .answer = std::bind_front(&Self::listFrames, this)},
          {.name = "io.hapticd.Control.FeedPose",
           .access = control,
           .parameters = {"frame", "positionM", "orientationXyzw", "timeNs", "ageS", "velocityMPerS"},
           .answer = std::bind_front(&Self::feedPose, this)}};
}

void FrameMethods::closed(ConnectionId connection) {
  for (auto& [name, stream] : streams_) stream.feed.closed(connection);
}

void FrameMethods::addWarnings(std::vector<std::string>& list) const {
  for (const auto& [name, stream] : streams_) stream.feed.addWarnings(Clock::now(), list);
}

void FrameMethods::listFrames(const Call&, const Caller& caller, Replies& replies) {
  const BoxStatus status = context_.box.status();
  OrderedJson entries = OrderedJson::array();
  const config::SceneAdditions& additions = context_.box.additions();
  for (const config::FrameSettings& frame : additions.frames) {
    OrderedJson fixtures = OrderedJson::array();
    for (const config::FixtureSettings& fixture : additions.fixtures) {
      if (fixture.frame == frame.name) fixtures.push_back(fixture.name);
    }
    OrderedJson entry = {{"name", frame.name},
                         {"origin", nameOf(frame.origin.value)},
                         {"definition", config::definitionOf<OrderedJson>(frame)},
                         {"fixtures", std::move(fixtures)}};
    const auto now = std::ranges::find(status.frames, frame.name, &FrameStatus::name);
    const bool placed = now != status.frames.end() && now->state != rt::FrameState::none;
    entry["state"] = nameOf(now == status.frames.end() ? rt::FrameState::none : now->state);
    entry["refusal"] =
        now != status.frames.end() && now->refusal ? OrderedJson(rt::wordOf(*now->refusal)) : OrderedJson();
    entry["ageS"] = placed ? OrderedJson(now->age_s) : OrderedJson();
    entry["lagM"] = placed ? OrderedJson(now->lag_m) : OrderedJson();
    const bool tracks = now != status.frames.end() && now->tracking;
    entry["tracking"] = tracks ? OrderedJson(rt::wordOf(*now->tracking)) : OrderedJson();
    entry["trackingErrorM"] = tracks ? OrderedJson(now->tracking_error_m) : OrderedJson();
    entry["trackingShare"] = tracks ? OrderedJson(now->tracking_share) : OrderedJson();
    entry["positionM"] = OrderedJson();
    entry["orientationXyzw"] = OrderedJson();
    if (placed) {
      const rt::Vec3& p = now->position_m_in_world;
      const rt::Quaternion& q = now->orientation;
      entry["positionM"] = OrderedJson::array({p.x, p.y, p.z});
      entry["orientationXyzw"] = OrderedJson::array({q.x, q.y, q.z, q.w});
    }
    entries.push_back(std::move(entry));
  }
  replies.finish(caller.connection, {"", {{"frames", std::move(entries)}}});
}

void FrameMethods::feedPose(const Call& call, const Caller& caller, Replies& replies) {
  if (const auto type = textField(call, "frame"); !type)
    return replies.finish(caller.connection, type.error());
  auto pose = poseOf(call, rt::monotonicNow_ns());
  if (!pose) return replies.finish(caller.connection, pose.error());
  const auto name = requiredText(call, "frame");
  if (!name) return replies.finish(caller.connection, name.error());
  const std::vector<config::FrameSettings>& frames = context_.box.additions().frames;
  const auto frame = std::ranges::find(frames, *name, &config::FrameSettings::name);
  if (frame == frames.end()) return replies.finish(caller.connection, unknownFrame(*name, frames));
  if (!frame->tracks.empty()) return replies.finish(caller.connection, trackedFrame(*frame));

  const Clock::time_point now = Clock::now();
  auto [found, is_new] = streams_.try_emplace(*name, Feed("poses of frame " + *name, kMaxPerSecond));
  auto& [feed, judge] = found->second;
  // of one that sends changes only, silence is no end
  const auto patience =
      frame->keepalive
          ? std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(frame->timeout_s))
          : Clock::duration::max();
  if (const std::string other = feed.refusal(caller, now, patience); !other.empty())
    return replies.finish(caller.connection, refused(*name, "other_sender", other));
  pose->frame = config::frameIdentity(*name);
  if (!feed.allows(now) || !context_.box.feedPose(*pose)) {
    ++limited_[*name];
    return replies.finish(caller.connection, feed.limited());
  }
  const rt::PoseFault fault = judge.take(*pose, config::rulesOf(*frame), rt::monotonicNow_ns());
  if (fault != rt::PoseFault::none)
    return replies.finish(caller.connection, refused(*name, rt::wordOf(fault), reasonOf(fault)));
  if (feed.used(caller, now)) {
    logChange(context_, caller, "feeds " + feed.what(), config::EventKind::frame,
              {{"FRAME", *name}, {"ACTION", "feed"}});
  }
  replies.finish(caller.connection, {"", {{"timeNs", pose->time_ns}}});
}

}  // namespace hapticd::daemon
