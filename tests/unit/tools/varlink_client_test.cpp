// SPDX-License-Identifier: Apache-2.0
// The client against a service that closes the connection early.

#include "tools/lib/client/varlink_client.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <string_view>

#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

/// Accepts one connection, sends something and closes it.
class CurtService {
 public:
  explicit CurtService(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(socket_, 1), 0);
  }
  ~CurtService() { ::close(socket_); }

  void sayAndClose(std::string_view text) const {
    const int connection = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
    EXPECT_EQ(::send(connection, text.data(), text.size(), MSG_NOSIGNAL), static_cast<ssize_t>(text.size()));
    ::close(connection);
  }

 private:
  int socket_;
};

struct VarlinkClientTest : testing::Test {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "socket").string();
  const CurtService service{path};
};

constexpr std::string_view kRefusal{
    "{\"error\":\"io.hapticd.Status.TooManyConnections\",\"parameters\":{\"limit\":40,\"perUser\":true}}\0",
    90};
static_assert(kRefusal.back() == '\0');

TEST_F(VarlinkClientTest, ReportsWhyItWasRefusedThoughTheConnectionIsClosedBeforeItsCall) {
  auto called = tools::VarlinkClient::connect(path);
  ASSERT_TRUE(called);
  service.sayAndClose(kRefusal);
  const auto reply = called->call("io.hapticd.Control.Disengage");
  ASSERT_FALSE(reply);
  EXPECT_EQ(reply.error().kind, tools::ClientError::Kind::error_reply);
  EXPECT_EQ(reply.error().what, "io.hapticd.Status.TooManyConnections");
  EXPECT_EQ(reply.error().parameters["limit"], 40);

  auto subscribed = tools::VarlinkClient::connect(path);
  ASSERT_TRUE(subscribed);
  service.sayAndClose(kRefusal);
  ASSERT_TRUE(subscribed->subscribe("io.hapticd.Status.Monitor", tools::Json::object()));
  const auto first = subscribed->next(tools::VarlinkClient::kTimeLimit);
  ASSERT_FALSE(first);
  EXPECT_EQ(first.error().what, "io.hapticd.Status.TooManyConnections");
}

}  // namespace
}  // namespace hapticd
