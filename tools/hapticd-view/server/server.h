// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstddef>
#include <functional>
#include <list>
#include <string>

#include "tools/hapticd-view/live/source.h"
#include "tools/hapticd-view/server/access.h"
#include "tools/hapticd-view/server/outbox.h"
#include "tools/hapticd-view/server/page_files.h"
#include "tools/hapticd-view/server/server_log.h"

namespace hapticd::tools::view {

/// A client with a WebSocket, as the rest of the program sees it.
class ConnectedClient {
 public:
  virtual ~ConnectedClient() = default;
  /// Says goodbye, because the program ends.
  virtual void goAway() = 0;
};

/// What all connections share. Outlives them.  Thread: the io_context's.
struct Server {
  static constexpr std::size_t kMostClients = 8;       ///< WebSockets
  static constexpr std::size_t kMostConnections = 64;  ///< of any kind; those beyond are closed unheard

  boost::asio::io_context& context;
  Source& source;
  AccessRules rules;  ///< local_address: of no connection
  PageFiles page;
  /// Asks whether the box shows its depth image to everybody, so that no token is needed; the answer comes
  /// later, and is false where the box does not answer.
  std::function<void(std::function<void(bool)>)> ask_open_to_everybody;
  ServerLog log = {};

  std::list<ConnectedClient*> clients = {};  ///< each adds and removes itself
  Outbox::All outboxes = {};                 ///< of the clients
  std::size_t connections = 0;
  bool stopping = false;
  std::chrono::steady_clock::time_point last_use = std::chrono::steady_clock::now();
};

}  // namespace hapticd::tools::view
