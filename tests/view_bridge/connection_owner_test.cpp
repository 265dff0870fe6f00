// SPDX-License-Identifier: Apache-2.0
// Who is at the other end, by the kernel's own tables: with real connections over the loopback network.
#include "tools/hapticd-view/server/connection_owner.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <string>

namespace hapticd::tools::view {
namespace {

using boost::asio::ip::make_address;
using boost::asio::ip::tcp;

/// A connection from a process of `user`, which stays until the object dies; 0: of this one's user.
class Connection {
 public:
  Connection(const std::string& listens_at, const std::string& connects_to, uid_t user = 0)
      : acceptor_(context_, {make_address(listens_at), 0}), socket_(context_) {
    const tcp::endpoint to(make_address(connects_to), acceptor_.local_endpoint().port());
    child_ = ::fork();
    if (child_ == 0) {
      if (user != 0 && ::setuid(user) != 0) ::_exit(1);
      boost::asio::io_context context;
      tcp::socket socket(context);
      boost::system::error_code error;
      socket.connect(to, error);
      for (;;) ::pause();
    }
    acceptor_.accept(socket_);
  }
  ~Connection() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  std::string owner() const { return connectionOwner(socket_.remote_endpoint(), socket_.local_endpoint()); }

 private:
  boost::asio::io_context context_;
  tcp::acceptor acceptor_;
  tcp::socket socket_;
  pid_t child_ = -1;
};

TEST(ConnectionOwner, IsTheUserAtTheOtherEndWhateverTheAddress) {
  const std::string self = "user " + std::to_string(::geteuid());
  EXPECT_EQ(Connection("127.0.0.1", "127.0.0.1").owner(), self);
  EXPECT_EQ(Connection("::1", "::1").owner(), self);
  EXPECT_EQ(Connection("::", "::1").owner(), self);
  EXPECT_EQ(Connection("::", "127.0.0.1").owner(), self) << "an IPv4 address at a socket for IPv6";
}

TEST(ConnectionOwner, DiffersFromUserToUser) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to be several users";
  EXPECT_EQ(Connection("127.0.0.1", "127.0.0.1", 65533).owner(), "user 65533");
  EXPECT_EQ(Connection("::", "127.0.0.1", 65534).owner(), "user 65534");
}

TEST(ConnectionOwner, IsTheAddressWhereNoProcessOfThisComputerHasTheOtherEnd) {
  boost::asio::io_context context;
  const tcp::acceptor listener(context, {make_address("127.0.0.1"), 0});
  const tcp::endpoint local(make_address("127.0.0.1"), listener.local_endpoint().port());
  EXPECT_EQ(connectionOwner({make_address("192.0.2.7"), 1234}, local), "192.0.2.7");
  EXPECT_EQ(connectionOwner({make_address("::ffff:192.0.2.7"), 1234}, local), "192.0.2.7");
  EXPECT_EQ(connectionOwner({make_address("2001:db8::7"), 1234}, local), "2001:db8::7");
  EXPECT_EQ(connectionOwner(local, {make_address("127.0.0.1"), 1234}), "127.0.0.1")
      << "a socket that listens is not the other end";
}

}  // namespace
}  // namespace hapticd::tools::view
