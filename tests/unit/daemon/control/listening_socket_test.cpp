// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/server/listening_socket.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <filesystem>
#include <fstream>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

ListenerOptions at(const std::string& path, mode_t mode = 0660) {
  return {.access = Access::read, .path = path, .mode = mode, .group = "", .descriptor = -1};
}

/// A bound socket, listening or not.
base::Descriptor boundSocket(const std::string& path, bool listening) {
  base::Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  EXPECT_EQ(0, ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address));
  if (listening) {
    EXPECT_EQ(0, ::listen(socket.get(), 4));
  }
  return socket;
}

mode_t modeOf(const std::string& path) {
  struct stat file {};
  EXPECT_EQ(0, ::stat(path.c_str(), &file));
  return file.st_mode & 07777;
}

bool exists(const std::string& path) {
  return std::filesystem::exists(std::filesystem::symlink_status(path));
}

TEST(ListeningSocket, HasItsModeWhateverTheUmask) {
  const TemporaryFolder folder;
  for (const mode_t umask : {0000U, 0022U, 0777U}) {
    const mode_t before = ::umask(umask);
    const auto status = ListeningSocket::open(at(folder.path("Status"), 0666));
    const auto control = ListeningSocket::open(at(folder.path("Control"), 0660));
    ::umask(before);
    ASSERT_TRUE(status && control);
    EXPECT_EQ(0666U, modeOf(folder.path("Status")));
    EXPECT_EQ(0660U, modeOf(folder.path("Control")));
  }
}

TEST(ListeningSocket, RemovesItsFileAtTheEnd) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s");
  {
    const auto socket = ListeningSocket::open(at(path));
    ASSERT_TRUE(socket);
    EXPECT_TRUE(exists(path));
  }
  EXPECT_FALSE(exists(path));
}

TEST(ListeningSocket, LeavesAFileAloneThatIsNoLongerItsOwn) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s");
  base::Descriptor successor;
  {
    const auto socket = ListeningSocket::open(at(path));
    ASSERT_TRUE(socket);
    std::filesystem::rename(path, folder.path("moved"));
    successor = boundSocket(path, true);
  }
  EXPECT_TRUE(exists(path));
}

TEST(ListeningSocket, TakesThePlaceOfADeadDaemon) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s");
  boundSocket(path, true).close();
  ASSERT_TRUE(exists(path));
  const auto socket = ListeningSocket::open(at(path));
  ASSERT_TRUE(socket) << socket.error().text();
  const RawClient client(path);  // connects, or the test fails
}

TEST(ListeningSocket, RefusesThePlaceOfALiveDaemon) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s");
  const base::Descriptor live = boundSocket(path, true);
  const auto socket = ListeningSocket::open(at(path));
  ASSERT_FALSE(socket);
  EXPECT_EQ(path, socket.error().where);
  EXPECT_EQ("another daemon listens there", socket.error().what);
  EXPECT_TRUE(exists(path));
}

TEST(ListeningSocket, RefusesAPathWithAnOrdinaryFileAndKeepsTheFile) {
  const TemporaryFolder folder;
  const std::string path = folder.path("precious");
  std::ofstream(path) << "data";
  const auto socket = ListeningSocket::open(at(path));
  ASSERT_FALSE(socket);
  EXPECT_EQ("there is a file that is not a socket", socket.error().what);
  std::string content;
  std::ifstream(path) >> content;
  EXPECT_EQ("data", content);
}

TEST(ListeningSocket, DoesNotFollowALinkAtItsPath) {
  const TemporaryFolder folder;
  const base::Descriptor other = boundSocket(folder.path("other"), false);
  std::filesystem::create_symlink(folder.path("other"), folder.path("link"));
  const auto socket = ListeningSocket::open(at(folder.path("link")));
  ASSERT_FALSE(socket);
  EXPECT_EQ("there is a file that is not a socket", socket.error().what);
  EXPECT_TRUE(exists(folder.path("other")));
}

TEST(ListeningSocket, NamesTheFolderThatIsMissing) {
  const TemporaryFolder folder;
  const auto socket = ListeningSocket::open(at(folder.path("missing/s")));
  ASSERT_FALSE(socket);
  EXPECT_EQ("the folder " + folder.path("missing") + " does not exist", socket.error().what);
}

TEST(ListeningSocket, RefusesAPathThatDoesNotFitIntoAnAddress) {
  // sizeof(sockaddr_un::sun_path) is 108, one byte of it is the NUL.
  const auto socket = ListeningSocket::open(at("/" + std::string(107, 'x')));
  ASSERT_FALSE(socket);
  EXPECT_EQ("the path has 108 bytes, at most 107 are possible", socket.error().what);
}

TEST(ListeningSocket, TakesOverAnOpenDescriptorAndLeavesItsFile) {
  const TemporaryFolder folder;
  const std::string path = folder.path("activated");
  const base::Descriptor systemds = boundSocket(path, true);
  {
    ListenerOptions options = at("");
    options.descriptor = ::dup(systemds.get());
    const auto socket = ListeningSocket::open(options);
    ASSERT_TRUE(socket) << socket.error().text();
    EXPECT_EQ(options.descriptor, socket->descriptor());
  }
  EXPECT_TRUE(exists(path));
}

TEST(ListeningSocket, RefusesADescriptorThatDoesNotListen) {
  const TemporaryFolder folder;
  const base::Descriptor bound = boundSocket(folder.path("s"), false);
  ListenerOptions options = at("");
  options.descriptor = bound.get();
  const auto socket = ListeningSocket::open(options);
  ASSERT_FALSE(socket);
  EXPECT_EQ("is not a listening Unix socket", socket.error().what);
}

}  // namespace
}  // namespace hapticd::daemon::test
