// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/streams/depth_streams.h"

#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <utility>

#include "config/base/base64.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/base/status_json.h"
#include "drivers/depth_region/depth_region.h"

namespace hapticd::daemon {
namespace {

constexpr const char* kNoFrame = "io.hapticd.Status.NoFrame";
/// Pixels in one reply: as many as take less than 64 KiB in base64.
constexpr int kPixelsAtATime = 38 * 640;
/// The most streams at once; each holds a frame of 2 MB.
constexpr std::size_t kMaxStreams = 8;

OrderedJson depthModelJson(const rt::DepthModelParameters& model) {
  return {{"aPerM", model.a_per_m},
          {"bPerM", model.b_per_m},
          {"fxPx", model.fx_px},
          {"fyPx", model.fy_px},
          {"cxPx", model.cx_px},
          {"cyPx", model.cy_px},
          {"nearM", model.near_m},
          {"farM", model.far_m},
          {"law", rt::wordOf(model.law)},
          {"unitM", model.unit_m},
          {"rawNoMeasurement", model.raw_no_measurement},
          {"rawValues", model.raw_values}};
}

OrderedJson headerJson(const SceneSnapshot& snapshot) {
  return {{"frame", snapshot.frame->sequence},
          {"width", snapshot.depth_model.width_px},
          {"height", snapshot.depth_model.height_px},
          {"depthModel", depthModelJson(snapshot.depth_model)},
          {"cameraPose", poseJson(snapshot.T_world_camera)},
          {"tick", tickJson(snapshot.tick)}};
}

std::string rowsText(const rt::DepthFrame& frame, int first_row, int rows) {
  std::vector<std::uint8_t> bytes;
  const auto width = static_cast<std::size_t>(frame.camera.width_px);
  bytes.reserve(static_cast<std::size_t>(rows) * width * 2);
  for (int row = first_row; row < first_row + rows; ++row) {
    const auto begin = static_cast<std::size_t>(row * rt::strideOf(frame.camera.width_px));
    for (const std::uint16_t raw : frame.image().subspan(begin, width)) {
      bytes.push_back(static_cast<std::uint8_t>(raw & 0xffU));
      bytes.push_back(static_cast<std::uint8_t>(raw >> 8));
    }
  }
  return base::base64(bytes);
}

Reply rowsReply(const SceneSnapshot& snapshot, int first_row, int rows) {
  return {"",
          {{"header", first_row == 0 ? headerJson(snapshot) : OrderedJson()},
           {"firstRow", first_row},
           {"rows", rowsText(*snapshot.frame, first_row, rows)}},
          first_row + rows < snapshot.depth_model.height_px};
}

}  // namespace

std::vector<Method> SnapshotStreams::methods() {
  return {{.name = "io.hapticd.Status.GetSnapshot",
           .streams = true,
           .shows_depth = true,
           .stream = std::bind_front(&SnapshotStreams::getSnapshot, this)}};
}

void SnapshotStreams::getSnapshot(const Call&, const Caller& caller, Replies& replies) {
  if (streams_.size() >= kMaxStreams) {
    return replies.finish(caller.connection,
                          failed(kNoFrame, "others are taking snapshots now (try again later)"));
  }
  streams_.push_back({caller.connection, box_.takeSnapshot(), {}});
  if (feed(streams_.back(), replies)) streams_.pop_back();
}

void SnapshotStreams::feed(Replies& replies) {
  std::erase_if(streams_, [&](Stream& stream) { return feed(stream, replies); });
}

bool SnapshotStreams::feed(Stream& stream, Replies& replies) {
  if (!stream.snapshot) {
    if (!isReady(stream.taking)) return false;
    Taken taken = stream.taking.get();
    if (!taken) {
      replies.finish(stream.connection, failed(kNoFrame, taken.error().text()));
      return true;
    }
    stream.snapshot = std::move(*taken);
  }
  if (stream.connection == kNoConnection) return true;
  for (;;) {
    const rt::DepthModelParameters& camera = stream.snapshot->depth_model;
    const int rows = std::min(kPixelsAtATime / camera.width_px, camera.height_px - stream.next_row);
    const Reply reply = rowsReply(*stream.snapshot, stream.next_row, rows);
    if (!reply.continues) {
      replies.finish(stream.connection, reply);
      return true;
    }
    if (!replies.offer(stream.connection, reply)) return false;
    stream.next_row += rows;
  }
}

void SnapshotStreams::closed(ConnectionId connection) {
  // A stream whose frame is still being taken keeps its place until the frame is there. So a client that
  // calls and hangs up repeatedly uses up these places, but does not fill the box's queue of work.
  for (Stream& stream : streams_) {
    if (stream.connection == connection) stream.connection = kNoConnection;
  }
  std::erase_if(streams_,
                [](const Stream& stream) { return stream.connection == kNoConnection && stream.snapshot; });
}

std::vector<Method> DepthStreams::methods() {
  return {{.name = "io.hapticd.Status.ShareDepth",
           .streams = true,
           .shows_depth = true,
           .stream = std::bind_front(&DepthStreams::shareDepth, this)}};
}

void DepthStreams::shareDepth(const Call&, const Caller& caller, Replies& replies) {
  if (streams_.size() == kMaxStreams) {
    return replies.finish(caller.connection, {"io.hapticd.Status.TooManyStreams", {{"limit", kMaxStreams}}});
  }
  if (streams_.empty()) {
    const auto shared = box_.shareDepth();
    if (!shared) {
      return replies.finish(caller.connection, failed("io.hapticd.Status.NoFrame", shared.error().text()));
    }
    shared_ = *shared;
  }
  streams_.push_back({.connection = caller.connection});
  feed(replies);
}

void DepthStreams::feed(Replies& replies) {
  for (Stream& stream : streams_) {
    if (stream.handed_over) continue;
    Reply reply{"", {{"version", drivers::DepthRegionHead::kVersion}, {"bytes", shared_.bytes}}, true};
    reply.descriptor = shared_.descriptor;
    stream.handed_over = replies.offer(stream.connection, reply);
  }
}

void DepthStreams::closed(ConnectionId connection) {
  const auto gone = [=](const Stream& stream) { return stream.connection == connection; };
  if (std::erase_if(streams_, gone) != 0 && streams_.empty()) box_.hideDepth();
}

}  // namespace hapticd::daemon
