// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ip/tcp.hpp>

#include <string>

#include "tools/hapticd-view/server/server.h"

namespace hapticd::tools::view {

/// An IPv4 address that came in at a socket for IPv6 as what it is.  Thread: any.
boost::asio::ip::address plainAddress(const boost::asio::ip::address& any);

/// Who is at the other end of a TCP connection: "user 1000" for a process of this computer, by what the
/// kernel knows of its socket, else the remote address.  Thread: any.
std::string connectionOwner(const boost::asio::ip::tcp::endpoint& remote,
                            const boost::asio::ip::tcp::endpoint& local);

/// Serves one connection: reads the header of a request (at most 8 KiB within 5 s), decides whether it is
/// answered, and sends a file of the page or goes over to a WebSocket. One request per connection. Where
/// there are too many connections, one that has sent no request yet is closed before, or the new one unheard.
/// Thread: the io_context's.
void serveConnection(boost::asio::ip::tcp::socket socket, Server& server);

}  // namespace hapticd::tools::view
