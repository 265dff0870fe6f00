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
#include "tools/hapticd-view/server/admission.h"
#include "tools/hapticd-view/server/outbox.h"
#include "tools/hapticd-view/server/page_files.h"
#include "tools/hapticd-view/server/server_log.h"

namespace hapticd::tools::view {

/// A connection before its WebSocket is open, as the rest of the program sees it.
class WaitingConnection {
 public:
  virtual ~WaitingConnection() = default;
  virtual OpenConnection state() const = 0;
  /// Closes it in favour of another one.
  virtual void giveWay() = 0;
};

/// A client with a WebSocket, as the rest of the program sees it.
class ConnectedClient {
 public:
  virtual ~ConnectedClient() = default;
  /// Who is at the other end (connectionOwner()).
  virtual const std::string& owner() const = 0;
  /// Says goodbye, because the program ends.
  virtual void goAway() = 0;
};

/// What all connections share. Outlives them.  Thread: the io_context's.
struct Server {
  static constexpr ConnectionLimits kClientLimits{.all = 10, .per_owner = 8};       ///< WebSockets
  static constexpr ConnectionLimits kConnectionLimits{.all = 64, .per_owner = 48};  ///< the others

  boost::asio::io_context& context;
  Source& source;
  AccessRules rules;  ///< local_address: of no connection
  PageFiles page;
  /// Asks whether the box shows its depth image to everybody, so that no token is needed; the answer comes
  /// later, and is false where the box does not answer.
  std::function<void(std::function<void(bool)>)> ask_open_to_everybody;
  ServerLog log = {};

  std::list<ConnectedClient*> clients = {};        ///< each adds and removes itself
  Outbox::All outboxes = {};                       ///< of the clients
  std::list<WaitingConnection*> connections = {};  ///< likewise; the oldest first
  bool stopping = false;
  std::chrono::steady_clock::time_point last_use = std::chrono::steady_clock::now();
};

}  // namespace hapticd::tools::view
