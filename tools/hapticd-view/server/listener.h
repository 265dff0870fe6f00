// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include <memory>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/hapticd-view/server/server.h"

/// Sockets that listen, also those of the service manager (sd_listen_fds(3), sd_notify(3)); where there is
/// none nothing happens.
namespace hapticd::tools::view {

/// The listening sockets that the service manager has passed. The caller owns them.
std::vector<int> socketsFromServiceManager();

void notifyReady();
void notifyStopping();

/// Accepts connections on one socket.  Thread: the io_context's.
class Listener {
 public:
  /// Opens a socket at "ADDRESS:PORT", "[IPv6]:PORT"; port 0: any free one.
  static base::Result<Listener> at(Server& server, const std::string& endpoint);
  /// Takes over a socket that the service manager has opened.
  static base::Result<Listener> of(Server& server, int descriptor);

  void start();
  void stop();

  /// "127.0.0.1:8765"
  std::string endpointText() const;
  /// Whether only programs on this computer reach it.
  bool isLoopback() const;

 private:
  using Acceptor = boost::asio::ip::tcp::acceptor;
  struct State {
    explicit State(Server& shared) : server(shared), acceptor(shared.context), pause(shared.context) {}
    Server& server;
    Acceptor acceptor;
    boost::asio::steady_timer pause;
  };

  explicit Listener(Server& server) : state_(std::make_shared<State>(server)) {}
  static void accept(const std::shared_ptr<State>& state);

  std::shared_ptr<State> state_;
};

}  // namespace hapticd::tools::view
