// SPDX-License-Identifier: Apache-2.0
// hapticd with a configuration that it cannot use: exit status 78, every problem with its place and range,
// and nothing created.

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/system/support/daemon_under_test.h"

namespace hapticd {
namespace {

using test::contains;
using test::DaemonHome;
using test::exitedWith;
using test::Finished;

constexpr int kUsage = 64, kConfiguration = 78;

/// Runs hapticd, which must refuse the configuration and leave nothing but the file in its folder.
std::string refusalOf(const DaemonHome& home, const std::string& yaml,
                      const std::vector<std::string>& set = {}) {
  const Finished finished = test::runToEnd(home.command(yaml, set));
  EXPECT_EQ(finished.ending, exitedWith(kConfiguration)) << finished.errors;
  EXPECT_EQ(home.entries(), std::vector<std::string>{"hapticd.yaml"});
  return finished.errors;
}

std::string allBytes() {
  std::string bytes;
  for (int byte = 0; byte < 256; ++byte) bytes.push_back(static_cast<char>(byte));
  return bytes;
}

/// A configuration, assignments on the command line, and what the refusal names.
struct Refused {
  std::string yaml;
  std::vector<std::string> set;
  std::vector<std::string> says;
};

TEST(BadConfiguration, IsRefusedWithEachPlaceAndRange) {
  const DaemonHome home;
  for (const auto& [yaml, set, says] : std::vector<Refused>{
           {"force:\n  stiffness_n_per_m: 5001\n  radius_m: .nan\nsafety:\n  max_force_n: -1\n",
            {},
            {"hapticd.yaml:2: ", "0..5000 N/m", "hapticd.yaml:3: ", "0.005..0.1 m",
             "hapticd.yaml:5: ", "0..40 N"}},
           {"force: {law: nearest_springs}\ncamera: {near_m: [0.4\n", {}, {"hapticd.yaml:"}},
           {"camera:\n  serial: \"A00362\nsafety:\n  max_force_n: 1\n",
            {},
            {"hapticd.yaml:2: the quote before \"A00362\" is not closed on its line"}},
           {allBytes(), {}, {"hapticd.yaml"}},
           {"", {}, {"has no group of parameters"}},
           {"# the box in room 3\n", {}, {"has no group of parameters"}},
           {"---\nsafety: {max_force_n: 1}\n", {}, {"the line `...` at its end is missing"}},
           {"force: {min_points: 200, max_points: 100}\n", {}, {"force.min_points", "force.max_points"}},
           {"{}\n",
            {"force.stiffnes_n_per_m=400"},
            {"--set force.stiffnes_n_per_m=400", "force.stiffness_n_per_m"}},
           {"{}\n", {"force.radius_m=1"}, {"0.005..0.1 m"}},
           {"{}\n", {"control.status_socket=/tmp/" + std::string(120, 's')}, {"control.status_socket"}}}) {
    const std::string errors = refusalOf(home, yaml, set);
    for (const std::string& part : says) EXPECT_TRUE(contains(errors, part));
  }
}

TEST(BadConfiguration, FaultsAreNotMadeUpWhereThatIsNotAllowedNorFromABadScript) {
  const DaemonHome home;
  const test::TemporaryFolder folder;
  const auto refusal = [&](const std::string& script, const std::string& yaml) {
    std::vector<std::string> command = home.command(yaml);
    command.insert(command.end(), {"--inject", folder.write("faults", script)});
    const Finished finished = test::runToEnd(command);
    EXPECT_EQ(finished.ending, exitedWith(kConfiguration)) << finished.errors;
    return finished.errors;
  };
  EXPECT_TRUE(contains(refusal("1 1 nan_pose\n", "force:"), "control.allow_fault_injection"));
  EXPECT_TRUE(contains(refusal("1 1 nonsense\n", "control: {allow_fault_injection: true}"), "faults:1"));
}

TEST(BadConfiguration, AMissingFileIsRefused) {
  const DaemonHome home;
  const Finished finished = test::runToEnd(test::hapticdCommand({"--config", home.path() / "none.yaml"}));
  EXPECT_EQ(finished.ending, exitedWith(kConfiguration));
  EXPECT_TRUE(contains(finished.errors, "none.yaml: cannot be read"));
  EXPECT_TRUE(home.entries().empty());
}

TEST(BadConfiguration, AFolderInThePlaceOfTheFileIsRefused) {
  const DaemonHome home;
  const Finished finished = test::runToEnd(test::hapticdCommand({"--config", home.path()}));
  EXPECT_EQ(finished.ending, exitedWith(kConfiguration));
  EXPECT_TRUE(contains(finished.errors, "cannot be read"));
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

TEST(BadConfiguration, ChecksWithoutStarting) {
  const DaemonHome home;
  std::vector<std::string> command = home.command(test::kWallYaml);
  command.emplace_back("--check");
  const Finished finished = test::runToEnd(command);
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(contains(finished.output, "hapticd.yaml: no problem found"));
  EXPECT_EQ(home.entries(), std::vector<std::string>{"hapticd.yaml"});
}

/// What only a driver reads: --check refuses it as the start does, with the same words.
TEST(BadConfiguration, ChecksRefuseFilesThatTheStartRefuses) {
  const DaemonHome home;
  const test::TemporaryFolder files;
  const std::filesystem::path key = files.path() / "key";
  const std::string udp =
      "handle: {driver: udp}\nudp_handle: {peer: 127.0.0.1, key_file: " + key.string() + "}\n";
  const auto expectRefused = [&](const std::string& yaml, const std::string& says) {
    std::vector<std::string> command = home.command(yaml);
    const Finished started = test::runToEnd(command);
    command.emplace_back("--check");
    const Finished checked = test::runToEnd(command);
    for (const Finished& each : {started, checked}) {
      EXPECT_EQ(each.ending, exitedWith(kConfiguration)) << each.output << each.errors;
      EXPECT_TRUE(contains(each.errors, says)) << each.errors;
    }
  };
  expectRefused(udp, "No such file");
  std::ofstream(key) << "too short";
  std::filesystem::permissions(key, std::filesystem::perms(0600));
  expectRefused(udp, "has 9 bytes, allowed: 16 to 1024");
  std::ofstream(key) << std::string(32, 'k');
  std::filesystem::permissions(key, std::filesystem::perms(0644));
  expectRefused(udp, "others may read or write it");
  expectRefused("camera: {driver: recorded, recording: " + files.path().string() + "}\n",
                files.path().string());
}

/// Returns the output of --check for a valid file.
std::string reportOn(const DaemonHome& home, const std::string& yaml) {
  std::vector<std::string> command = home.command(yaml);
  command.emplace_back("--check");
  const Finished finished = test::runToEnd(command);
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  return finished.output;
}

// The home names the law, both sockets and the state folder on the command line.
TEST(BadConfiguration, ChecksSayHowManyParametersAreSetAndWhichDifferFromTheDefaults) {
  const DaemonHome home;
  const std::string report = reportOn(home, "safety: {max_force_n: 1}\nforce: {min_points: 10}\n");
  EXPECT_TRUE(
      contains(report, "hapticd.yaml: no problem found; 6 parameters set, 5 differ from the defaults: "));
  EXPECT_TRUE(contains(report, ", safety.max_force_n = 1 (default 4), control.status_socket = "));
}

TEST(BadConfiguration, ChecksWarnOfAHandleOnTheNetworkWithoutAKey) {
  const DaemonHome home;
  const std::string report =
      reportOn(home, "handle: {driver: udp}\nudp_handle: {address: 0.0.0.0, peer: 192.0.2.10}\n");
  EXPECT_TRUE(contains(report, "hapticd.yaml: warning: udp_handle.key_file: is empty"));
  EXPECT_TRUE(contains(report, "no problem found"));
}

TEST(BadConfiguration, ChecksWarnOfABootProfileThatCannotBeUsed) {
  const DaemonHome home;
  std::filesystem::create_directories(home.stateFolder() / "profiles");
  std::ofstream(home.stateFolder() / "profiles/mine.yaml");
  std::ofstream(home.stateFolder() / "profiles/boot") << "mine\n";
  EXPECT_TRUE(contains(reportOn(home, "force:"), "mine.yaml: names no parameter"));
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

TEST(BadConfiguration, ChecksSayWhetherACutWouldBeNoticed) {
  const DaemonHome home;
  EXPECT_TRUE(contains(reportOn(home, "force:\n"), "nothing would show that its end was cut off"));
  EXPECT_EQ(reportOn(home, "---\nforce:\n...\n").find("cut off"), std::string::npos);
}

TEST(BadConfiguration, ChecksReportWhatAStartWouldRefuse) {
  const DaemonHome home;
  std::vector<std::string> command = home.command("camera: {near_m: 5}\n");
  command.emplace_back("--check");
  const Finished finished = test::runToEnd(command);
  EXPECT_EQ(finished.ending, exitedWith(kConfiguration));
  EXPECT_TRUE(contains(finished.errors, "hapticd.yaml:1: "));
}

TEST(BadConfiguration, AWrongCommandLineIsAUsageError) {
  EXPECT_EQ(test::runToEnd(test::hapticdCommand({"--confg", "x"})).ending, exitedWith(kUsage));
}

}  // namespace
}  // namespace hapticd
