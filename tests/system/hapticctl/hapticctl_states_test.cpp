// SPDX-License-Identifier: Apache-2.0
// Every command of hapticctl against a daemon that runs, is absent, hangs or lets it only read.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <list>
#include <memory>
#include <set>
#include <sstream>
#include <thread>

#include "tests/system/hapticctl/command_table.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/test_sockets.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kNoConnection = 3;

class HapticctlStates : public testing::Test {
 protected:
  HapticctlStates() { writeCommandFiles(home); }

  Command complete(const Command& command) const { return completedCommand(home, command); }

  DaemonHome home;
};

TEST_F(HapticctlStates, AllWorkOneAfterTheOther) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["tick"]["pointsUsed"] == 100; }));
  for (const Call& call : kCalls) {
    const Finished finished = home.control(complete(call.command));
    EXPECT_EQ(finished.ending, exitedWith(kDone)) << textOf(call.command) << ": " << finished.errors;
    const bool waits = finished.errors.starts_with("waiting for ");  // as calibrate does
    EXPECT_TRUE(finished.errors.empty() || waits) << textOf(call.command) << ": " << finished.errors;
    EXPECT_NE(finished.output, "") << textOf(call.command);
  }
  const Finished nothing = home.control({"clear-fault"});
  EXPECT_EQ(nothing.ending, exitedWith(kFailed));
  EXPECT_TRUE(contains(nothing.errors, "there is no fault to clear"));
}

TEST_F(HapticctlStates, AllSayWhichGroupMayWhenPermissionIsMissing) {
  if (::geteuid() != 0) GTEST_SKIP() << "takes root, to become another user";
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  std::filesystem::permissions(home.path(), std::filesystem::perms(0755));
  ASSERT_EQ(::chmod(home.controlSocket().c_str(), 0660), 0);
  for (const Call& call : kCalls) {
    const Finished finished = home.control(complete(call.command), {.user = 65534});
    EXPECT_EQ(finished.ending, exitedWith(kNoConnection)) << textOf(call.command) << ": " << finished.errors;
    EXPECT_TRUE(contains(finished.errors, "members of the group ")) << textOf(call.command);
  }
}

// All at the same time, because each waits for some seconds.
TEST_F(HapticctlStates, AllEndInTimeWhereADaemonHangs) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  daemon.signal(SIGSTOP);
  std::vector<std::unique_ptr<Program>> programs;
  for (const Command& command : {Command{"status"},
                                 {"watch"},
                                 {"events"},
                                 {"metrics"},
                                 {"version"},
                                 {"get"},
                                 {"set", "force.radius_m=0.03"},
                                 {"disengage"},
                                 {"reload"},
                                 {"fixture", "list"},
                                 {"trace", "list"},
                                 {"snapshot"},
                                 {"calibrate"}}) {
    programs.push_back(std::make_unique<Program>(home.controlCommand(command)));
  }
  for (const auto& program : programs) {
    EXPECT_EQ(program->wait(), exitedWith(kNoConnection)) << program->errors();
    EXPECT_TRUE(contains(program->errors(), "hapticd may be starting or busy"));
  }
  daemon.signal(SIGCONT);
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST_F(HapticctlStates, TheStatusSocketLetsOnlyRead) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["tick"]["pointsUsed"] == 100; }));
  for (const Command& command :
       {Command{"fixture", "add", "nerve", "--kind", "sphere", "--position-m", "0,0,-0.8", "--radius-m", "1"},
        {"region", "add", "liver", "--shape", "sphere", "--position-m", "0,0,-1", "--radius-m", "0.05"}}) {
    ASSERT_EQ(home.control(command).ending, exitedWith(kDone)) << textOf(command);
  }
  for (const Call& call : kCalls) {
    Command command = complete(call.command);
    command.insert(command.begin(), {"--socket", home.statusSocket()});
    const Finished finished = runToEnd(hapticctlCommand(command));
    const bool reads = call.does == Does::read;
    EXPECT_EQ(finished.ending, exitedWith(reads ? kDone : kFailed)) << textOf(call.command);
    EXPECT_TRUE(contains(finished.errors, reads ? "" : "members of the group haptic may"));
  }
}

TEST_F(HapticctlStates, ADaemonWithoutCameraSaysSoAndHasNoSnapshot) {
  Daemon daemon(home, "camera: {driver: freenect}\n");
  ASSERT_TRUE(daemon.answers());
  const Finished status = home.control({"status"});
  EXPECT_EQ(status.ending, exitedWith(kDone));
  EXPECT_TRUE(contains(status.output, "! camera "));
  const Finished snapshot = home.control({"snapshot"});
  EXPECT_EQ(snapshot.ending, exitedWith(kFailed));
  EXPECT_TRUE(contains(snapshot.errors, "no depth frame has arrived yet"));
}

TEST_F(HapticctlStates, ADaemonThatWasKilledLeavesASocketOnWhichNobodyListens) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  daemon.signal(SIGKILL);
  daemon.wait();
  const Finished finished = home.control({"status"});
  EXPECT_EQ(finished.ending, exitedWith(kNoConnection));
  EXPECT_TRUE(contains(finished.errors, "nothing listens on " + home.controlSocket()));
}

TEST_F(HapticctlStates, TheSocketOfTheCommandLineIsPreferredToTheEnvironments) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  EXPECT_EQ(home.control({"version"}, {.environment = {"HAPTICD_SOCKET=/nowhere"}}).ending,
            exitedWith(kDone));
  EXPECT_EQ(
      runToEnd(hapticctlCommand({"engage"}), {.environment = {"HAPTICD_SOCKET=" + home.controlSocket()}})
          .ending,
      exitedWith(kDone));
}

TEST_F(HapticctlStates, TooManyConnectionsAreSaid) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  std::list<Client> others;
  for (int i = 0; i < 64; ++i) {
    others.emplace_back(home.controlSocket())
        .send(std::string(R"({"method":"org.varlink.service.GetInfo"})") + '\0');
  }
  others.front().reply();
  const Finished refused = home.control({"disengage"});
  EXPECT_EQ(refused.ending, exitedWith(kFailed));
  EXPECT_TRUE(contains(refused.errors, "too many connections: hapticd serves "));
}

TEST_F(HapticctlStates, WhoMaySeeTheDepthImageIsSaid) {
  if (::geteuid() != 0) GTEST_SKIP() << "takes root, to become another user";
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  std::filesystem::permissions(home.path(), std::filesystem::perms(0711));
  const Finished denied =
      runToEnd(hapticctlCommand({"--socket", home.statusSocket(), "snapshot"}), {.user = 65534});
  EXPECT_EQ(denied.ending, exitedWith(kFailed));
  EXPECT_TRUE(contains(denied.errors, "haptic-view"));
}

TEST_F(HapticctlStates, DoctorAndCameraListSayWhatTheRunningDaemonUses) {
  Daemon daemon(home, std::string(kWallYaml) + "handle: {driver: simulated}\n");
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["camera"]["state"] == "streaming"; }));
  const std::string source = "as the running hapticd uses it (" + home.controlSocket() + ")";
  const std::string checked = home.control({"doctor"}).output;
  EXPECT_TRUE(contains(checked, "ok    configuration: " + source + "\n"));
  EXPECT_TRUE(contains(checked, "ok    depth camera: hapticd uses synthetic: streaming\n"));
  EXPECT_TRUE(contains(checked, "ok    handle: hapticd uses simulated: present\n"));
  EXPECT_TRUE(contains(checked, home.stateFolder()));
  const json listed = json::parse(home.control({"--json", "camera", "list"}).output);
  EXPECT_EQ(listed["configuration"], source);
  EXPECT_EQ(listed["source"], "a computed scene");
  EXPECT_EQ(listed["state"], "streaming");
  const Finished tested = home.control({"camera", "test"});
  EXPECT_EQ(tested.ending, exitedWith(kFailed));
  EXPECT_TRUE(contains(tested.errors, "camera.driver is synthetic"));
  EXPECT_TRUE(contains(tested.errors, source));
}

TEST_F(HapticctlStates, DoctorShowsTheWarningsOfTheDaemonAndKnowsItsCpu) {
  Daemon daemon(home, "camera: {driver: freenect}\nloop: {cpu: 0}\n");
  ASSERT_TRUE(daemon.answers());
  const std::filesystem::path cpus = home.path() / "machine/sys/devices/system/cpu";
  std::filesystem::create_directories(cpus);
  home.write("machine/sys/devices/system/cpu/isolated", "1\n");
  const Finished finished = home.control({"doctor", "--root", home.path() / "machine"});
  EXPECT_EQ(finished.ending, exitedWith(kDone)) << finished.output;
  EXPECT_TRUE(contains(finished.output, "warn  daemon: camera "));
  EXPECT_TRUE(contains(finished.output, "isolated: CPU 1, but the force loop runs on CPU 0"));
}

/// What no daemon of this version sends, so the test itself answers on the socket.
struct StrangeAnswer {
  std::string bytes;
  int code;
  std::string says;
};

class HapticctlAndAnotherProgram : public testing::TestWithParam<StrangeAnswer> {};

TEST_P(HapticctlAndAnotherProgram, SaysWhatIsWrong) {
  const DaemonHome home;
  const base::Descriptor listener = boundSocket(SOCK_STREAM, home.controlSocket());
  ASSERT_EQ(::listen(listener.get(), 1), 0);
  std::thread other([&] {
    const base::Descriptor client(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC));
    std::array<char, 256> call{};
    ::recv(client.get(), call.data(), call.size(), 0);
    ::send(client.get(), GetParam().bytes.data(), GetParam().bytes.size(), MSG_NOSIGNAL);
  });
  const Finished finished = home.control({"profiles"});
  other.join();
  EXPECT_EQ(finished.ending, exitedWith(GetParam().code));
  EXPECT_TRUE(contains(finished.errors, GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    Answers, HapticctlAndAnotherProgram,
    testing::Values(
        StrangeAnswer{"", kNoConnection, "the socket may be another program's"},
        StrangeAnswer{"SSH-2.0\r\n", kNoConnection, "the socket may be another program's"},
        StrangeAnswer{std::string("[1,2]\0", 6), kNoConnection, "the socket may be another program's"},
        StrangeAnswer{
            std::string(R"({"error":"org.varlink.service.MethodNotFound","parameters":{"method":"a.B"}})") +
                '\0',
            kFailed, "this hapticd does not know a.B: it is older than hapticctl"}));

}  // namespace
}  // namespace hapticd::test
