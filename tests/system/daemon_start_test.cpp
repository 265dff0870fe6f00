// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <iostream>

#include "config/base/descriptor.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/test_sockets.h"

// Missing LEDs cause a warning, and nothing else changes.
namespace hapticd {
namespace {

using test::boundSocket;
using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;
using test::Finished;
using test::isTold;

const std::string kAbsentLeds =
    std::string(test::kWallYaml) +
    "leds: {driver: gpiod, chip: gpiochip-none, power_line: 0, fault_line: STATUS active-low}\n";

TEST(AbsentLeds, LeaveTheDaemonEngagedWithAWarningAndARemedy) {
  const DaemonHome home;
  Daemon daemon(home, kAbsentLeds, {"control.engage_at_start=true"});
  ASSERT_TRUE(daemon.answers());
  nlohmann::json leds;
  std::string warnings;
  EXPECT_TRUE(daemon.reaches([&](const nlohmann::json& status) {
    leds = status.at("leds");
    warnings = status.at("warnings").dump();
    return status.at("mode") == "engaged" && leds.at("fault") == "slow_blink";
  }));
  EXPECT_EQ(leds.at("state"), "absent");
  EXPECT_EQ(leds.at("identity"), "gpiod gpiochip-none");
  EXPECT_EQ(leds.at("power"), "on");
  EXPECT_TRUE(leds.at("camera").is_null());
  EXPECT_TRUE(contains(warnings, "no such chip"));
  EXPECT_TRUE(
      contains(home.control({"status"}).output, "leds          absent, gpiod gpiochip-none: power on"));
  EXPECT_TRUE(daemon.ticks());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(AbsentLeds, AreNotMentionedWhereNoneAreConfigured) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  EXPECT_EQ(daemon.status().at("leds").at("state"), "none");
  EXPECT_EQ(home.control({"status"}).output.find("\nleds"), std::string::npos);
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

/// The user to run as, who may neither use real-time scheduling nor lock memory: `nobody` for root, else
/// the user who runs the tests.
test::ProgramOptions ordinaryUser(const DaemonHome& home) {
  if (::geteuid() != 0) return {};
  constexpr uid_t kNobody = 65534;
  home.giveTo(kNobody);
  return {.user = kNobody};
}

TEST(UnprivilegedDaemon, RunsAndSaysHonestlyWhatItCouldNotGet) {
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, {}, ordinaryUser(home));
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.ticks());
  const nlohmann::json status = daemon.status();
  const std::string warnings = status.at("warnings").dump();
  const bool scheduled = status.at("loop").at("realtimeScheduling");
  const bool locked = status.at("loop").at("memoryLocked");
  if (::geteuid() == 0) {  // then the daemon runs as a user who has neither
    EXPECT_FALSE(scheduled);
    EXPECT_FALSE(locked);
  } else {
    std::cerr << "not root: what this user may do decides what is warned of\n";
  }
  // In the status and at the start, each with its remedy; none where there is nothing to warn of.
  for (const std::string& text : {warnings, daemon.errors()}) {
    EXPECT_EQ(text.find("force thread without real-time scheduling") != std::string::npos, !scheduled)
        << text;
    EXPECT_EQ(text.find("handle thread without real-time scheduling") != std::string::npos, !scheduled)
        << text;
    EXPECT_EQ(text.find("memory not locked") != std::string::npos, !locked) << text;
    EXPECT_EQ(text.find("LimitRTPRIO=") != std::string::npos, !scheduled) << text;
    EXPECT_EQ(text.find("LimitMEMLOCK=infinity") != std::string::npos, !locked) << text;
  }
  const nlohmann::json& handle = status.at("handle");
  EXPECT_EQ(handle.at("wantedThreadPriority"), 79);
  EXPECT_EQ(handle.at("threadPriority"), scheduled ? 79 : 0);
  EXPECT_EQ(daemon.terminate(), test::exitedWith(0));
}

TEST(UnprivilegedDaemon, FeelsTheSceneLikeAPrivilegedOne) {
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, {"control.engage_at_start=true"}, ordinaryUser(home));
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("mode") == "engaged" && test::lengthOf(status.at("tick").at("commandForceNInWorld")) > 1;
  }));
  EXPECT_EQ(daemon.terminate(), test::exitedWith(0));
}

// hapticd starts, whatever it finds at the paths of its sockets.

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
  const base::Descriptor manager = boundSocket(SOCK_DGRAM, home.path() / "notify");
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
  const base::Descriptor manager = boundSocket(SOCK_DGRAM, home.path() / "notify");
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
  const base::Descriptor manager = boundSocket(SOCK_DGRAM, home.path() / "notify");
  Daemon daemon(
      home, test::kWallYaml, {},
      {.environment = {"NOTIFY_SOCKET=" + (home.path() / "notify").string(), "WATCHDOG_USEC=200000"}});
  ASSERT_TRUE(isTold(manager, "READY=1"));
  const std::filesystem::path file = home.path() / "hapticd.yaml";
  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  const base::Descriptor held_open(::open(file.c_str(), O_RDWR | O_CLOEXEC));
  daemon.signal(SIGHUP);
  EXPECT_TRUE(isTold(manager, "RELOADING=1"));
  EXPECT_TRUE(isTold(manager, "READY=1"));
  for (int time = 0; time < 5; ++time) EXPECT_TRUE(isTold(manager, "WATCHDOG=1"));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(DaemonStart, FeedsTheWatchdogAgainAndAgain) {
  const DaemonHome home;
  const base::Descriptor manager = boundSocket(SOCK_DGRAM, home.path() / "notify");
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

// --- a configuration that it cannot use; most are in sessions/configurations.golden

constexpr int kConfiguration = 78;

/// Runs hapticd, which must refuse the configuration and leave nothing but the file in its folder.
std::string refusalOf(const DaemonHome& home, const std::string& yaml,
                      const std::vector<std::string>& set = {}) {
  const Finished finished = test::runToEnd(home.command(yaml, set));
  EXPECT_EQ(finished.ending, exitedWith(kConfiguration)) << finished.errors;
  EXPECT_EQ(home.entries(), std::vector<std::string>{"hapticd.yaml"});
  return finished.errors;
}

TEST(BadConfiguration, AFileWithoutReadPermissionIsRefused) {
  const DaemonHome home;
  const std::vector<std::string> command = home.command("{}\n");
  std::filesystem::permissions(home.path() / "hapticd.yaml", std::filesystem::perms::none);
  test::ProgramOptions options;
  if (::geteuid() == 0) {  // whom no permission stops
    constexpr uid_t kNobody = 65534;
    options.user = kNobody;
    home.giveTo(kNobody);
  }
  const Finished finished = test::runToEnd(command, options);
  EXPECT_EQ(finished.ending, exitedWith(kConfiguration));
  EXPECT_TRUE(contains(finished.errors, "hapticd.yaml: cannot be read"));
  EXPECT_EQ(home.entries(), std::vector<std::string>{"hapticd.yaml"});
}

// Escape codes as bytes, as escapes of YAML, in names, values, groups and assignments of the command line.
TEST(BadConfiguration, NothingThatSteersATerminalIsShownNorMoreThanTheBeginningOfALongValue) {
  const DaemonHome home;
  const std::string long_text(3000, 'x');
  const std::string bad = "\\e[2J\\x9b" + long_text;
  std::string errors = refusalOf(home,
                                 "force: {\"" + bad + "\": 1, law: \"" + bad + "\", radius_m: \"" + bad +
                                     "\"}\n\"" + bad + "\": {a: 1}\ncamera: {serial: \"" + bad + "\"}\n",
                                 {"force.law=\x1b[2J" + long_text, "\xc2\x9b" + long_text + "=1"});
  errors += refusalOf(home, "camera: {serial: \x1b[2J}\n# \xc2\x9b\n");
  for (const char* steering : {"\x1b", "\xc2\x9b"}) EXPECT_EQ(errors.find(steering), std::string::npos);
  EXPECT_TRUE(contains(errors, "\\x1b[2J"));
  EXPECT_EQ(errors.find(std::string(61, 'x')), std::string::npos) << errors;
}

}  // namespace
}  // namespace hapticd
