// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "config/settings/settings.h"
#include "tests/installation/staged_installation.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUnits = "usr/lib/systemd/system";
constexpr const char* kExamples = "usr/share/doc/hapticd/examples";

std::string unit(const std::string& name) {
  return contentOf(stagedRoot() / kUnits / name);
}

/// The staged units with the daemon where it is staged: systemd looks whether it can be executed.
class UnitCopies {
 public:
  UnitCopies() {
    std::string service = unit("hapticd.service");
    const std::string program = "ExecStart=/usr/libexec";
    const std::size_t place = service.find(program);
    if (place != std::string::npos) {
      service.replace(place, program.size(), "ExecStart=" + (stagedRoot() / "usr/libexec").string());
    }
    folder_.write("hapticd.service", service);
    for (const std::string socket :
         {"hapticd-status.socket", "hapticd-control.socket", "hapticd-metrics.socket"}) {
      folder_.write(socket, unit(socket));
    }
    for (const std::string tool : {"hapticd-metrics@.service", "hapticd-view.service", "hapticd-view.socket"})
      folder_.write(tool, withStagedTools(unit(tool)));
    for (const std::string example :
         {"haptic-bridge.service", "hapticd-check.service", "hapticd-mail.service"})
      folder_.write(example, withStagedTools(contentOf(stagedRoot() / kExamples / example)));
    if (HAPTICD_WITH_ROS) folder_.write("hapticd-ros.service", withStagedTools(unit("hapticd-ros.service")));
  }
  std::string path(const std::string& name) const { return folder_.path() / name; }

 private:
  static std::string withStagedTools(std::string text) {
    for (const std::string key : {"ExecStart=", "ExecStartPre="}) {
      if (const std::size_t found = text.find(key + "/usr/bin"); found != std::string::npos)
        text.replace(found, key.size() + 8, key + (stagedRoot() / "usr/bin").string());
    }
    return text;
  }

  TemporaryFolder folder_;
};

TEST(Units, HaveNothingThatSystemdComplainsAbout) {
  HAPTICD_NEEDS("systemd-analyze");
  const UnitCopies copies;
  const Finished finished =
      runTool("systemd-analyze",
              {"verify", "--man=no", copies.path("hapticd.service"), copies.path("hapticd-status.socket"),
               copies.path("hapticd-control.socket"), copies.path("hapticd-metrics.socket"),
               copies.path("hapticd-metrics@.service"), copies.path("hapticd-view.socket"),
               copies.path("hapticd-view.service"), copies.path("haptic-bridge.service"),
               copies.path("hapticd-check.service"), copies.path("hapticd-mail.service")});
  EXPECT_EQ(finished.ending, exitedWith(0));
  EXPECT_EQ(finished.output + finished.errors, "");
}

TEST(Units, ForRos2HaveNothingThatSystemdComplainsAbout) {
  HAPTICD_NEEDS("systemd-analyze");
  if (!HAPTICD_WITH_ROS) GTEST_SKIP() << "this build has no hapticd-ros";
  const UnitCopies copies;
  const Finished verified =
      runTool("systemd-analyze", {"verify", "--man=no", copies.path("hapticd-status.socket"),
                                  copies.path("hapticd.service"), copies.path("hapticd-ros.service")});
  EXPECT_EQ(verified.ending, exitedWith(0));
  EXPECT_EQ(verified.output + verified.errors, "");
}

/// Units and examples by the exposure that systemd computes, in tenths.
TEST(Units, ExposeLittle) {
  HAPTICD_NEEDS("systemd-analyze");
  const UnitCopies copies;
  std::vector<std::pair<std::string, int>> units{
      {"hapticd.service", 19},       {"hapticd-metrics@.service", 10},
      {"hapticd-view.service", 19},  {"haptic-bridge.service", 19},
      {"hapticd-check.service", 10}, {"hapticd-mail.service", 40}};  // runs as root
  if (HAPTICD_WITH_ROS) units.emplace_back("hapticd-ros.service", 19);
  for (const auto& [unit, most] : units) {
    const Finished rated =
        runTool("systemd-analyze",
                {"security", "--offline=true", fmt::format("--threshold={}", most), copies.path(unit)});
    EXPECT_EQ(rated.ending, exitedWith(0)) << unit << rated.output << rated.errors;
  }
}

/// A library of a vendor may do what the user of its process may.
TEST(Units, KeepTheCodeOfAVendorFromTheBoxAndFromHomes) {
  const std::string bridge = contentOf(stagedRoot() / kExamples / "haptic-bridge.service");
  EXPECT_EQ(unitSetting(bridge, "User"), "hapticd-vendor");
  EXPECT_EQ(unitSetting(bridge, "SupplementaryGroups"), "");
  EXPECT_EQ(unitSetting(bridge, "ProtectHome"), "yes");
  const std::string rules = contentOf(stagedRoot() / kExamples / "73-vendor-handles.rules");
  EXPECT_NE(rules.find("GROUP=\"hapticd-vendor\""), std::string::npos);
  EXPECT_EQ(rules.find("GROUP=\"hapticd\""), std::string::npos);
  EXPECT_NE(contentOf(stagedRoot() / "usr/lib/sysusers.d/hapticd.conf").find("\nu hapticd-vendor -"),
            std::string::npos);
}

TEST(Units, ShowTheLivePictureOnThisHostOnlyAndControlNothingByIt) {
  EXPECT_EQ(unitSetting(unit("hapticd-view.socket"), "ListenStream"), "127.0.0.1:8765");
  const std::string service = unit("hapticd-view.service");
  EXPECT_EQ(unitSetting(service, "ExecStart"),
            "/usr/bin/hapticd-view --socket " + config::Settings().control.status_socket);
  EXPECT_EQ(unitSetting(service, "DynamicUser"), "yes");
  EXPECT_EQ(unitSetting(service, "SupplementaryGroups"), "haptic-view");
  EXPECT_EQ(unitSetting(service, "RestrictAddressFamilies"), "AF_UNIX AF_INET AF_INET6 AF_NETLINK")
      << "the last one tells whose connection it is";
  EXPECT_EQ(unitSetting(service, "Group"), "");
  EXPECT_EQ(unitSetting(service, "IPAddressAllow"), "localhost");
}

TEST(Units, MakeTheTokenOfTheLivePictureBeforeItsFirstClient) {
  EXPECT_EQ(unitSetting(unit("hapticd-view.socket"), "ExecStartPre"), "/usr/bin/hapticd-view --make-token");
  EXPECT_NE(contentOf(stagedRoot() / "usr/lib/tmpfiles.d/hapticd.conf")
                .find("d /run/hapticd-view 0755 root root -"),
            std::string::npos);
}

TEST(Units, AnswerMetricsOnThisHostOnlyThroughTheReadingSocket) {
  EXPECT_EQ(unitSetting(unit("hapticd-metrics.socket"), "ListenStream"), "127.0.0.1:9477");
  EXPECT_EQ(unitSetting(unit("hapticd-metrics.socket"), "Accept"), "yes");
  EXPECT_EQ(unitSetting(unit("hapticd-metrics@.service"), "ExecStart"),
            "/usr/bin/hapticctl --socket " + config::Settings().control.status_socket + " metrics --http");
}

TEST(Units, NameProgramAndConfigurationThatAreInstalled) {
  const std::string start = unitSetting(unit("hapticd.service"), "ExecStart");
  EXPECT_EQ(start, "/usr/libexec/hapticd/hapticd --config /etc/hapticd/hapticd.yaml");
  EXPECT_TRUE(fs::exists(stagedRoot() / "usr/libexec/hapticd/hapticd"));
  EXPECT_TRUE(fs::exists(stagedRoot() / "etc/hapticd/hapticd.yaml"));
}

TEST(Units, ListenWhereClientsLook) {
  const config::Settings defaults;
  EXPECT_EQ(unitSetting(unit("hapticd-status.socket"), "ListenStream"), defaults.control.status_socket);
  EXPECT_EQ(unitSetting(unit("hapticd-control.socket"), "ListenStream"), defaults.control.control_socket);
}

TEST(Units, LetEveryoneReadAndTheGroupHapticSteer) {
  EXPECT_EQ(unitSetting(unit("hapticd-status.socket"), "SocketMode"), "0666");
  EXPECT_EQ(unitSetting(unit("hapticd-control.socket"), "SocketMode"), "0660");
  EXPECT_EQ(unitSetting(unit("hapticd-control.socket"), "SocketGroup"), "haptic");
}

TEST(Units, NameTheDescriptorsAsTheDaemonLooksForThem) {
  EXPECT_EQ(unitSetting(unit("hapticd-status.socket"), "FileDescriptorName"), "status");
  EXPECT_EQ(unitSetting(unit("hapticd-control.socket"), "FileDescriptorName"), "control");
}

// systemd removes a RuntimeDirectory= when the service restarts, and the sockets with it.
TEST(Units, HaveUdevLookAgainWhichDevicesTheConfigurationNames) {
  const std::string service = unit("hapticd.service");
  const std::size_t begin = service.find("\nExecStartPre=+-");
  ASSERT_NE(begin, std::string::npos) << "as root, and no reason not to start";
  const std::string before = service.substr(begin, service.find("\nExecStart=") - begin);
  EXPECT_NE(before.find("udevadm trigger --action=change --subsystem-match=gpio --subsystem-match=hidraw"),
            std::string::npos)
      << before;
}

TEST(Units, LeaveTheFolderOfTheSocketsToTmpfiles) {
  EXPECT_EQ(unitSetting(unit("hapticd.service"), "RuntimeDirectory"), "");
  EXPECT_NE(
      contentOf(stagedRoot() / "usr/lib/tmpfiles.d/hapticd.conf").find("d /run/hapticd 0755 root root -"),
      std::string::npos);
}

// A box with one or two CPUs has to start too.
TEST(Units, NameNoCpu) {
  EXPECT_EQ(unitSetting(unit("hapticd.service"), "CPUAffinity"), "");
}

TEST(Units, AreMadeForUsersThatSysusersCreates) {
  HAPTICD_NEEDS("systemd-sysusers");
  if (::geteuid() != 0) GTEST_SKIP() << "systemd-sysusers writes another root's /etc only as root";
  const TemporaryFolder root;
  fs::create_directories(root.path() / "etc");
  const Finished finished = runTool(
      "systemd-sysusers",
      {"--root=" + root.path().string(), (stagedRoot() / "usr/lib/sysusers.d/hapticd.conf").string()});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_NE(contentOf(root.path() / "etc/passwd").find("hapticd:x:"), std::string::npos);
  EXPECT_NE(contentOf(root.path() / "etc/passwd").find(":/var/lib/hapticd:/usr/sbin/nologin"),
            std::string::npos);
  const std::string groups = contentOf(root.path() / "etc/group");
  EXPECT_TRUE(groups.starts_with("hapticd:x:") || groups.find("\nhapticd:x:") != std::string::npos) << groups;
  EXPECT_TRUE(groups.starts_with("haptic-view:x:") || groups.find("\nhaptic-view:x:") != std::string::npos)
      << groups;
  EXPECT_TRUE(groups.starts_with("haptic:x:") || groups.find("\nhaptic:x:") != std::string::npos) << groups;
}

TEST(Units, FindTheFoldersThatTmpfilesCreates) {
  HAPTICD_NEEDS("systemd-tmpfiles");
  HAPTICD_NEEDS("systemd-sysusers");
  if (::geteuid() != 0) GTEST_SKIP() << "systemd-tmpfiles gives folders to root only as root";
  const TemporaryFolder root;
  fs::create_directory(root.path() / "etc");
  const Finished users = runTool(
      "systemd-sysusers",
      {"--root=" + root.path().string(), (stagedRoot() / "usr/lib/sysusers.d/hapticd.conf").string()});
  ASSERT_EQ(users.ending, exitedWith(0)) << users.errors;
  const Finished finished =
      runTool("systemd-tmpfiles", {"--create", "--root=" + root.path().string(),
                                   (stagedRoot() / "usr/lib/tmpfiles.d/hapticd.conf").string()});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_EQ(static_cast<unsigned>(fs::status(root.path() / "run/hapticd").permissions()), 0755U);
  EXPECT_EQ(static_cast<unsigned>(fs::status(root.path() / "var/lib/hapticd/traces").permissions()), 02750U);
}

}  // namespace
}  // namespace hapticd::test
