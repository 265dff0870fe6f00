// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>

#include "tools/hapticd-view/live/message_sink.h"
#include "tools/hapticd-view/live/source.h"

namespace hapticd::tools::view {

/// Returns the session of a client that has agreed on `subprotocol` ("foxglove.sdk.v1" or
/// "foxglove.websocket.v1"), or null where that protocol is not offered. The caller adds it to the source
/// after this call and removes it before it dies; `source` and `sink` outlive the session. The session may
/// send from the constructor on (serverInfo).
std::unique_ptr<Session> makeFoxgloveSession(Source& source, MessageSink& sink, std::string_view subprotocol);

}  // namespace hapticd::tools::view
