// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/depth_streams.h"

#include <functional>

#include "daemon/control/call_fields.h"
#include "drivers/depth_region/depth_region.h"

namespace hapticd::daemon {

std::vector<Method> DepthStreams::methods() {
  return {{.name = "io.hapticd.Status.ShareDepth",
           .streams = true,
           .shows_depth = true,
           .answer = std::bind_front(&DepthStreams::shareDepth, this)}};
}

void DepthStreams::shareDepth(const Call&, const Caller& caller, Replies& replies) {
  if (streams_.size() == kMostStreams) {
    return replies.finish(caller.connection, {"io.hapticd.Status.TooManyStreams", {{"limit", kMostStreams}}});
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
