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

/// After this long without a pose of a frame the next one begins a feed, which is logged.
constexpr std::chrono::seconds kPause{10};

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

std::string reasonOf(rt::PoseFault fault, const rt::FramePose& pose) {
  if (fault == rt::PoseFault::not_finite)
    return "the position must be within 10 m of the world's origin, in metres";
  return fmt::format("the quaternion has the length {:.4g}, and a rotation has the length 1",
                     std::sqrt(dot(pose.T_world_frame.orientation, pose.T_world_frame.orientation)));
}

Reply unknownFrame(const std::string& name, const std::vector<config::FrameSettings>& frames) {
  OrderedJson names = OrderedJson::array();
  for (const config::FrameSettings& frame : frames) names.push_back(frame.name);
  return {"io.hapticd.Control.UnknownFrame", {{"frame", name}, {"frames", std::move(names)}}};
}

Reply trackedFrame(const config::FrameSettings& frame) {
  return {
      "io.hapticd.Control.PoseRefused",
      {{"frame", frame.name},
       {"cause", "tracked"},
       {"reason", fmt::format("the depth camera tracks this frame by the fixture {} (remove tracks from the "
                              "frame in the configuration to feed poses)",
                              frame.tracks)}}};
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
  Stream& stream = streams_[*name];
  pose->frame = config::frameIdentity(*name);
  if (!stream.rate.allows(now) || !context_.box.feedPose(*pose)) {
    ++limited_[*name];
    return replies.finish(caller.connection, {"io.hapticd.Control.FeedLimited", {{"limit", kMaxPerSecond}}});
  }
  if (now - std::exchange(stream.newest, now) >= kPause) {
    logChange(context_, caller, "feeds poses of frame " + *name, config::EventKind::frame,
              {{"FRAME", *name}, {"ACTION", "feed"}});
  }
  // The force loop has it too, and counts why it drops it.
  if (const rt::PoseFault fault = rt::faultOf(*pose); fault != rt::PoseFault::none) {
    return replies.finish(
        caller.connection,
        {"io.hapticd.Control.PoseRefused",
         {{"frame", *name}, {"cause", rt::wordOf(fault)}, {"reason", reasonOf(fault, *pose)}}});
  }
  replies.finish(caller.connection, {"", {{"timeNs", pose->time_ns}}});
}

}  // namespace hapticd::daemon
