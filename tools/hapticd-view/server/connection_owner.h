// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <string>

namespace hapticd::tools::view {

/// An IPv4 address that came in at a socket for IPv6 as what it is.  Thread: any.
boost::asio::ip::address plainAddress(const boost::asio::ip::address& any);

/// Who is at the other end of a TCP connection: "user 1000" for a process of this computer, by what the
/// kernel knows of its socket, else the remote address.  Thread: any.
std::string connectionOwner(const boost::asio::ip::tcp::endpoint& remote,
                            const boost::asio::ip::tcp::endpoint& local);

}  // namespace hapticd::tools::view
