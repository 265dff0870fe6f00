// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/foxglove/make_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <random>

#include "rt/clock.h"
#include "tools/hapticd-view/foxglove/foxglove_session.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

/// Both mean the same messages here.
constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// A number of its own for each run of the server.
const std::string& sessionId() {
  static const std::string id = [] {
    std::random_device random;
    return fmt::format("{:08x}{:08x}", random(), random());
  }();
  return id;
}

/// A recording brings the offset of its clocks; a box runs by those of this computer.
FoxgloveSession::Offset offsetOf(const Json& hello) {
  const Json* recorded = fieldAt(hello, "trace.realtimeOffsetNs");
  if (recorded != nullptr && recorded->is_number_integer()) {
    return [offset_ns = recorded->get<std::int64_t>()] { return offset_ns; };
  }
  return [] { return rt::realtimeNow_ns() - rt::monotonicNow_ns(); };
}

}  // namespace

std::unique_ptr<Session> makeFoxgloveSession(Source& source, MessageSink& sink,
                                             std::string_view subprotocol) {
  if (std::ranges::find(kSubprotocols, subprotocol) == kSubprotocols.end()) return nullptr;
  const Json hello = source.hello();
  return std::make_unique<FoxgloveSession>(
      source, sink,
      FoxgloveSession::Identity{fmt::format("hapticd {}", textAt(hello, "version")), sessionId()},
      offsetOf(hello));
}

}  // namespace hapticd::tools::view
