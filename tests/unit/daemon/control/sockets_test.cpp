// SPDX-License-Identifier: Apache-2.0
// The socket files, and which of the users who can open them may change something.

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numeric>

#include "control_fixture.h"
#include "daemon/control/server/listening_socket.h"

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

// Which of the users who can open the control socket may change something through it.

constexpr uid_t kOther = 65534;
constexpr gid_t kGroup = 4242;
constexpr gid_t kAnotherGroup = 4243;
constexpr gid_t kViewGroup = 4244;
constexpr const char* kEngage = R"({"method":"io.hapticd.Control.Engage"})";
constexpr const char* kDenied = R"({"error":"org.varlink.service.PermissionDenied","parameters":{}})";
constexpr const char* kEngaged = R"({"parameters":{"mode":"engaged","cause":"requested","already":false}})";
constexpr const char* kEngagedAlready =
    R"({"parameters":{"mode":"engaged","cause":"requested","already":true}})";
constexpr const char* kDepthImage = R"({"method":"io.hapticd.Status.GetSnapshot","more":true})";

TEST(MayControl, IsTrueOfRootTheOwnUserAndMembersOfTheGroup) {
  const uid_t stranger = ::geteuid() + 1;
  EXPECT_TRUE(mayControl({0, 1, {5}}, kGroup));
  EXPECT_TRUE(mayControl({::geteuid(), 1, {5}}, kGroup));
  EXPECT_TRUE(mayControl({stranger, 1, {5, kGroup}}, kGroup));
  EXPECT_FALSE(mayControl({stranger, 1, {5, kAnotherGroup}}, kGroup));
  EXPECT_FALSE(mayControl({stranger, 1, {}}, kGroup));
  EXPECT_FALSE(mayControl({stranger, 1, {5}}, std::nullopt));
}

/// The control socket's file belongs to kGroup, and anybody can open it.
class PrivilegesTest : public ControlFixture {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "needs root to connect as other users";
    // What is created in a folder with the set-group-ID bit belongs to the folder's group.
    ASSERT_EQ(0, ::chown(folder.path("").c_str(), static_cast<uid_t>(-1), kGroup));
    std::filesystem::permissions(folder.path(""), std::filesystem::perms(02711));
    server_options.view_group = kViewGroup;
    start();
    std::filesystem::permissions(controlPath(), std::filesystem::perms(0666));
  }

  /// The reply to a call on the control socket by another user.
  std::string askAs(uid_t user, gid_t group, const std::vector<gid_t>& groups, const std::string& call) {
    return askAs(user, group, groups, call, controlPath());
  }
  std::string askAs(uid_t user, gid_t group, const std::vector<gid_t>& groups, const std::string& call,
                    const std::string& path) {
    int ends[2];
    if (::pipe(ends) != 0) return "no pipe";
    const pid_t child = ::fork();
    if (child == 0) {
      if (::setgroups(groups.size(), groups.data()) != 0 || ::setgid(group) != 0 || ::setuid(user) != 0)
        ::_exit(2);
      RawClient client(path);
      client.call(call);
      const std::string reply = client.reply();
      ::_exit(::write(ends[1], reply.data(), reply.size()) < 0 ? 3 : 0);
    }
    ::close(ends[1]);
    std::string reply;
    char chunk[4096];
    for (ssize_t count = 0; (count = ::read(ends[0], chunk, sizeof chunk)) > 0;) {
      reply.append(chunk, static_cast<std::size_t>(count));
    }
    ::close(ends[0]);
    int status = -1;
    EXPECT_EQ(child, ::waitpid(child, &status, 0));
    EXPECT_EQ(0, status);
    return reply;
  }
};

TEST_F(PrivilegesTest, LetsOthersReadButChangeNothingThoughTheyGotIn) {
  EXPECT_EQ(kDenied, askAs(kOther, kAnotherGroup, {}, kEngage));
  EXPECT_EQ(kDenied, askAs(kOther, kAnotherGroup, {kAnotherGroup}, kEngage));
  const std::string info = askAs(kOther, kAnotherGroup, {}, R"({"method":"org.varlink.service.GetInfo"})");
  EXPECT_NE(std::string::npos, info.find("hapticd")) << info;
  EXPECT_EQ(0U, box.changes());
  EXPECT_TRUE(log().empty());
}

TEST_F(PrivilegesTest, LetsMembersOfTheSocketsGroupChangeAndLogsWhoItWas) {
  EXPECT_EQ(kEngaged, askAs(kOther, kGroup, {}, kEngage));
  EXPECT_EQ(kEngagedAlready, askAs(kOther, kAnotherGroup, {kAnotherGroup, kGroup}, kEngage));
  const auto entries = logged(config::EventKind::engage);
  ASSERT_EQ(2U, entries.size());
  EXPECT_EQ(std::to_string(kOther), entries[0].at("UID"));
  EXPECT_NE(std::to_string(::getpid()), entries[0].at("PID"));
}

TEST_F(PrivilegesTest, FindsTheGroupAmongManyOthers) {
  std::vector<gid_t> groups(300);
  std::iota(groups.begin(), groups.end(), 5000U);
  EXPECT_EQ(kDenied, askAs(kOther, kAnotherGroup, groups, kEngage));
  groups.back() = kGroup;
  EXPECT_EQ(kEngaged, askAs(kOther, kAnotherGroup, groups, kEngage));
}

TEST_F(PrivilegesTest, ShowsTheDepthImageToTheGroupsForControlAndForViewingOnly) {
  for (const std::string& path : {statusPath(), controlPath()}) {
    EXPECT_EQ(kDenied, askAs(kOther, kAnotherGroup, {}, kDepthImage, path));
    EXPECT_EQ(kDenied, askAs(kOther, kAnotherGroup, {kAnotherGroup}, kDepthImage, path));
    for (const gid_t group : {kGroup, kViewGroup}) {
      EXPECT_EQ(0U,
                askAs(kOther, kAnotherGroup, {group}, kDepthImage, path).find(R"({"parameters":{"header")"));
    }
    EXPECT_EQ(0U, askAs(0, kAnotherGroup, {}, kDepthImage, path).find(R"({"parameters":{"header")"));
  }
}

TEST_F(PrivilegesTest, LetsTheGroupForViewingChangeNothing) {
  EXPECT_EQ(kDenied, askAs(kOther, kViewGroup, {kViewGroup}, kEngage));
  EXPECT_EQ(0U, box.changes());
}

TEST_F(PrivilegesTest, ShowsTheDepthImageToEverybodyWhereTheConfigurationSaysSo) {
  stop();
  config::Settings settings = box.settings();
  settings.control.depth_for_everyone = true;
  box.setSettings(settings);
  start();
  EXPECT_EQ(0U,
            askAs(kOther, kAnotherGroup, {}, kDepthImage, statusPath()).find(R"({"parameters":{"header")"));
}

TEST_F(PrivilegesTest, LetsRootChangeWithoutTheGroup) {
  EXPECT_EQ(kEngaged, askAs(0, kAnotherGroup, {}, kEngage));
}

}  // namespace
}  // namespace hapticd::daemon::test
