// SPDX-License-Identifier: Apache-2.0
// hapticd starts, whatever it finds at the paths of its sockets.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "config/descriptor.h"
#include "tests/system/daemon_under_test.h"
#include "tests/system/test_sockets.h"

namespace hapticd {
namespace {

using test::boundSocket;
using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;
using test::Finished;
using test::isTold;

constexpr int kSocketsUnavailable = 69;

TEST(DaemonStart, RunsWithEveryDefaultButSocketsAndCamera) {
  const DaemonHome home;
  Daemon daemon(home, "force:\n", {"camera.driver=synthetic"});
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("mode") == "idle" && status.at("camera").at("state") == "streaming";
  }));
  EXPECT_TRUE(daemon.ticks());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(DaemonStart, WaitsForACameraThatIsNotThere) {
  const DaemonHome home;
  // Without the player, libfreenect finds no camera: where there is a real one, this serial number is not
  // its.
  Daemon daemon(home, "camera: {driver: freenect, serial: \"no such camera\"}\n");
  ASSERT_TRUE(daemon.answers());
  const nlohmann::json status = daemon.status();
  EXPECT_EQ(status.at("camera").at("state"), "absent");
  EXPECT_NE(status.at("camera").at("detail"), "");
  EXPECT_TRUE(daemon.ticks());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(DaemonStart, NotifiesTheServiceManagerWhenItIsReadyAndWhenItStops) {
  const DaemonHome home;
  const config::Descriptor manager = boundSocket(SOCK_DGRAM, home.path() / "notify");
  Daemon daemon(home, test::kWallYaml, {},
                {.environment = {"NOTIFY_SOCKET=" + (home.path() / "notify").string()}});
  EXPECT_TRUE(isTold(manager, "READY=1"));
  EXPECT_TRUE(daemon.running());
  EXPECT_TRUE(std::filesystem::exists(home.controlSocket()));
  daemon.signal(SIGTERM);
  EXPECT_TRUE(isTold(manager, "STOPPING=1"));
  EXPECT_EQ(daemon.wait(), exitedWith(0));
}

TEST(DaemonStart, NotifiesTheServiceManagerThatItReloadsAndThatItIsReadyAgain) {
  const DaemonHome home;
  const config::Descriptor manager = boundSocket(SOCK_DGRAM, home.path() / "notify");
  Daemon daemon(home, test::kWallYaml, {},
                {.environment = {"NOTIFY_SOCKET=" + (home.path() / "notify").string()}});
  ASSERT_TRUE(isTold(manager, "READY=1"));
  daemon.signal(SIGHUP);
  EXPECT_TRUE(isTold(manager, "RELOADING=1\nMONOTONIC_USEC="));
  EXPECT_TRUE(isTold(manager, "READY=1"));
}

// With the pipe open for writing, even a reader that does not wait for a writer would wait for data.
TEST(DaemonStart, FeedsTheWatchdogWhileAndAfterAReloadFromAPipe) {
  const DaemonHome home;
  const config::Descriptor manager = boundSocket(SOCK_DGRAM, home.path() / "notify");
  Daemon daemon(
      home, test::kWallYaml, {},
      {.environment = {"NOTIFY_SOCKET=" + (home.path() / "notify").string(), "WATCHDOG_USEC=200000"}});
  ASSERT_TRUE(isTold(manager, "READY=1"));
  const std::filesystem::path file = home.path() / "hapticd.yaml";
  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  const config::Descriptor held_open(::open(file.c_str(), O_RDWR | O_CLOEXEC));
  daemon.signal(SIGHUP);
  EXPECT_TRUE(isTold(manager, "RELOADING=1"));
  EXPECT_TRUE(isTold(manager, "READY=1"));
  for (int time = 0; time < 5; ++time) EXPECT_TRUE(isTold(manager, "WATCHDOG=1"));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(DaemonStart, FeedsTheWatchdogAgainAndAgain) {
  const DaemonHome home;
  const config::Descriptor manager = boundSocket(SOCK_DGRAM, home.path() / "notify");
  Daemon daemon(
      home, test::kWallYaml, {},
      {.environment = {"NOTIFY_SOCKET=" + (home.path() / "notify").string(), "WATCHDOG_USEC=200000"}});
  for (int time = 0; time < 5; ++time) EXPECT_TRUE(isTold(manager, "WATCHDOG=1"));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(DaemonStart, CreatesNothingThatOthersMayWriteWhateverMaskItInherits) {
  namespace fs = std::filesystem;
  const DaemonHome home;
  std::vector<std::string> command{"/bin/sh", "-c", "umask 000 && exec \"$@\"", "sh"};
  for (const std::string& word : home.command(test::kWallYaml, {"trace.at_start=true", "trace.depth=true"}))
    command.push_back(word);
  Daemon daemon(home, command);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(
      daemon.reaches([](const nlohmann::json& status) { return status.at("trace").at("ticks") > 0; }));
  const std::string trace = daemon.status().at("trace").at("name");
  for (const std::vector<std::string>& work :
       std::vector<std::vector<std::string>>{{"save", "soft"},
                                             {"profiles", "--boot", "soft"},
                                             {"trace", "note", trace, "good"},
                                             {"trace", "dump"},
                                             {"trace", "stop"},
                                             {"trace", "keep", trace}}) {
    EXPECT_EQ(home.control(work).ending, exitedWith(0)) << work[0];
  }
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  std::size_t files = 0;
  const auto others = fs::perms::group_write | fs::perms::others_write;
  for (const auto& entry : fs::recursive_directory_iterator(home.stateFolder())) {
    EXPECT_EQ(entry.status().permissions() & others, fs::perms::none) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 7U) << "folders of traces and profiles, two traces, a note, a profile, the boot profile";
  EXPECT_EQ(fs::status(home.stateFolder()).permissions() & others, fs::perms::none);
}

TEST(DaemonStart, IsRefusedWithoutTheFolderOfItsSockets) {
  const DaemonHome home;
  const Finished finished = test::runToEnd(
      home.command(test::kWallYaml, {"control.control_socket=" + (home.path() / "none/Control").string()}));
  EXPECT_EQ(finished.ending, exitedWith(kSocketsUnavailable));
  EXPECT_TRUE(contains(finished.errors, "does not exist"));
  EXPECT_EQ(home.entries(), std::vector<std::string>{"hapticd.yaml"});
}

TEST(DaemonStart, IsRefusedWhereAnotherFileStands) {
  const DaemonHome home;
  const std::vector<std::string> command = home.command(test::kWallYaml);
  std::filesystem::create_directory(home.controlSocket());
  const Finished finished = test::runToEnd(command);
  EXPECT_EQ(finished.ending, exitedWith(kSocketsUnavailable));
  EXPECT_TRUE(contains(finished.errors, "is not a socket"));
  EXPECT_EQ(home.entries(), (std::vector<std::string>{"Control", "hapticd.yaml"}));
}

TEST(DaemonStart, IsRefusedBesideALiveDaemonWhichStaysUnharmed) {
  const DaemonHome home;
  Daemon first(home);
  ASSERT_TRUE(first.answers());
  const Finished second = test::runToEnd(home.command(test::kWallYaml));
  EXPECT_EQ(second.ending, exitedWith(kSocketsUnavailable));
  EXPECT_TRUE(contains(second.errors, "another daemon listens there"));
  EXPECT_TRUE(first.ticks());
  EXPECT_EQ(first.terminate(), exitedWith(0));
}

TEST(DaemonStart, TakesOverSocketFilesThatNobodyListensOn) {
  const DaemonHome home;
  for (const std::string& path : {home.statusSocket(), home.controlSocket()}) boundSocket(SOCK_STREAM, path);
  Daemon daemon(home);
  EXPECT_TRUE(daemon.answers());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  EXPECT_EQ(home.entries(), std::vector<std::string>{"hapticd.yaml"});
}

TEST(DaemonStart, TakesOverTheSocketsOfADaemonThatWasKilled) {
  const DaemonHome home;
  {
    Daemon killed(home);
    ASSERT_TRUE(killed.answers());
    killed.signal(SIGKILL);
    EXPECT_EQ(killed.wait(), (test::Ending{false, SIGKILL}));
  }
  ASSERT_TRUE(std::filesystem::exists(home.controlSocket()));
  Daemon next(home);
  EXPECT_TRUE(next.answers());
  EXPECT_EQ(next.terminate(), exitedWith(0));
}

}  // namespace
}  // namespace hapticd
