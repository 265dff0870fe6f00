// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/control_socket.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "tests/support/temporary_folder.h"

namespace hapticd::test::usbip {
namespace {

/// Serves a control socket in a thread; answers each line with itself in brackets.
class Server {
 public:
  explicit Server(const std::filesystem::path& path) : control_(*ControlSocket::listen(path)) {
    thread_ = std::thread([this] {
      while (!done_) {
        pollfd waiting{control_->readable(), POLLIN, 0};
        if (::poll(&waiting, 1, 5) == 0) continue;
        control_->serve([](std::string_view line) { return "[" + std::string(line) + "]"; });
      }
    });
  }
  ~Server() {
    done_ = true;
    thread_.join();
  }

 private:
  std::unique_ptr<ControlSocket> control_;
  std::atomic<bool> done_ = false;
  std::thread thread_;
};

/// A socket in the file system on which nobody listens any more.
void leaveSocket(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(socket);
}

TEST(ControlSocket, AnswersOneClientAfterTheOther) {
  const TemporaryFolder folder;
  const Server server(folder.path() / "control");
  for (const std::string command : {"status", "lose 3", ""}) {
    const auto answer = tell(folder.path() / "control", command);
    ASSERT_TRUE(answer) << answer.error().text();
    EXPECT_EQ(*answer, "[" + command + "]");
  }
}

TEST(ControlSocket, RemovesItsFile) {
  const TemporaryFolder folder;
  { const Server server(folder.path() / "control"); }
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "control"));
}

TEST(ControlSocket, TakesThePlaceOfADeadOne) {
  const TemporaryFolder folder;
  leaveSocket(folder.path() / "control");
  EXPECT_TRUE(ControlSocket::listen(folder.path() / "control"));
}

TEST(ControlSocket, LeavesALivingOneAlone) {
  const TemporaryFolder folder;
  const Server server(folder.path() / "control");
  const auto second = ControlSocket::listen(folder.path() / "control");
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().text().find("listens there already"), std::string::npos) << second.error().text();
  EXPECT_TRUE(tell(folder.path() / "control", "x"));
}

TEST(ControlSocket, LeavesAFileAlone) {
  const TemporaryFolder folder;
  folder.write("control", "precious");
  EXPECT_FALSE(ControlSocket::listen(folder.path() / "control"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "control"));
}

TEST(ControlSocket, NamesTheLongestPath) {
  const auto control = ControlSocket::listen("/tmp/" + std::string(200, 'x'));
  ASSERT_FALSE(control);
  EXPECT_NE(control.error().text().find("205 characters, allowed are 1 to 107"), std::string::npos)
      << control.error().text();
}

TEST(ControlSocket, ReportsThatNobodyListens) {
  const TemporaryFolder folder;
  const auto answer = tell(folder.path() / "control", "status");
  ASSERT_FALSE(answer);
  EXPECT_NE(answer.error().text().find("start the emulator"), std::string::npos) << answer.error().text();
}

}  // namespace
}  // namespace hapticd::test::usbip
