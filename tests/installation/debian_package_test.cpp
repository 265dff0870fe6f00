// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/installation/staged_installation.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBox = "hapticd";
constexpr const char* kTools = "hapticd-tools";
constexpr const char* kRos = "hapticd-ros";
constexpr const char* kPython = "python3-hapticd";

/// Returns the path of a package that ctest has built from this build.
std::string packagePath(const std::string& package = kBox) {
  for (const fs::directory_entry& entry : fs::directory_iterator(HAPTICD_PACKAGE_FOLDER)) {
    const std::string name = entry.path().filename();
    if (name.starts_with(package + "_") && name.ends_with(".deb")) return entry.path();
  }
  ADD_FAILURE() << "run these tests by ctest, which makes the package first";
  return {};
}

std::string field(const std::string& name, const std::string& package = kBox) {
  std::string value = runTool("dpkg-deb", {"--field", packagePath(package), name}).output;
  while (value.ends_with('\n')) value.pop_back();
  return value;
}

/// A package unpacked to a folder.
class Unpacked {
 public:
  explicit Unpacked(const std::string& package = kBox) {
    ended = runTool("dpkg-deb", {"--raw-extract", packagePath(package), root()}).ending;
  }
  std::string root() const { return folder_.path() / "root"; }
  fs::path path(const std::string& file) const { return folder_.path() / "root" / file; }
  Ending ended;

 private:
  TemporaryFolder folder_;
};

TEST(DebianPackage, IsNamedByDebiansRules) {
  EXPECT_EQ(fs::path(packagePath()).filename(),
            "hapticd_" HAPTICD_VERSION "-1_" + field("Architecture") + ".deb");
}

TEST(DebianPackage, HasTheVersionOfItsChangelog) {
  const Unpacked package;
  const std::string changelog =
      runTool("gzip", {"-dc", package.path("usr/share/doc/hapticd/changelog.Debian.gz")}).output;
  EXPECT_TRUE(changelog.starts_with("hapticd (" + field("Version") + ") ")) << changelog;
}

using Names = std::set<std::string>;

/// Returns the name without its ending that differs between Debian's releases: the version of a library.
std::string withoutVersion(const std::string& package) {
  if (!package.starts_with("lib")) return package;
  static const std::regex version("-?[0-9.]+(-[0-9.]+)*(t64|debian)?$");
  return std::regex_replace(package, version, "");
}

/// Returns the packages in the field `Depends`.
Names dependenciesOf(const std::string& package) {
  Names names;
  std::string depends = field("Depends", package);
  std::ranges::replace(depends, ',', '\n');
  std::istringstream lines(depends);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    names.insert(withoutVersion(name));
  }
  return names;
}

/// Expects that a package depends on these and on nothing else. A dependency more is a decision, not luck.
void expectDependencies(const std::string& package, const Names& allowed) {
  Names names;
  for (const std::string& name : allowed) names.insert(withoutVersion(name));
  EXPECT_EQ(dependenciesOf(package), names) << package;
}

TEST(DebianPackage, DependsOnWhatIsAllowedAndOnNothingElse) {
  expectDependencies(kBox, {"libc6", "libfmt", "libfreenect", "libgcc-s", "libgpiod", "libhidapi-hidraw",
                            "libhwy", "liblz4", "libnettle", "libpng", "libraw1394-11", "libstdc++",
                            "libsystemd0", "libusb", "libyaml-cpp", "libzstd", "systemd", "zlib1g"});
  expectDependencies(kTools, {"hapticd", "libc6", "libfmt", "libgcc-s", "libhwy", "liblz4", "libnettle",
                              "libpng", "libstdc++", "libyaml-cpp", "libzstd", "zlib1g"});
}

TEST(DebianPackage, ForRos2BringsDdsAndAUnitThatNobodyHasEnabled) {
  if (!HAPTICD_WITH_ROS) GTEST_SKIP() << "this build has no hapticd-ros";
  expectDependencies(kRos, {"hapticd", "libc6", "libddsc", "libfmt", "libgcc-s", "libhwy", "libnettle",
                            "libstdc++", "libsystemd0"});
  EXPECT_EQ(field("Version", kRos), field("Version"));
  const Unpacked package(kRos);
  EXPECT_EQ(unitSetting(contentOf(package.path("usr/lib/systemd/system/hapticd-ros.service")), "ExecStart"),
            "/usr/bin/hapticd-ros --socket /run/hapticd/io.hapticd.Status");
  EXPECT_FALSE(fs::exists(package.path("DEBIAN/postinst")));
  const Unpacked box;
  for (const std::string& file : filesBelow(package.root())) {
    if (file.starts_with("DEBIAN/")) continue;
    EXPECT_FALSE(fs::exists(box.path(file))) << file;
  }
}

TEST(DebianPackage, ForPythonIsOfAnyArchitectureAndCompiledWhereItIsInstalled) {
  expectDependencies(kPython, {"libzstd", "python3"});
  EXPECT_EQ(field("Architecture", kPython), "all");
  const Unpacked package(kPython);
  EXPECT_TRUE(fs::exists(package.path("usr/lib/python3/dist-packages/hapticd/__init__.py")));
  for (const char* script : {"postinst", "prerm"})
    EXPECT_NE(contentOf(package.path("DEBIAN") / script).find("-p python3-hapticd"), std::string::npos)
        << script;
}

TEST(DebianPackage, OfAnotherVariantOfALibraryIsTakenForAnotherLibrary) {
  EXPECT_EQ(withoutVersion("libyaml-cpp0.7"), withoutVersion("libyaml-cpp0.8"));
  EXPECT_NE(withoutVersion("libusb-1.0-0"), withoutVersion("libusb-mock-1.0-0"));
  EXPECT_EQ(withoutVersion("libusb-1.0-0"), "libusb");
  EXPECT_EQ(withoutVersion("libpng16-16t64"), withoutVersion("libpng16-16"));
  EXPECT_EQ(withoutVersion("libpcl-search1.13"), "libpcl-search");
}

TEST(DebianPackage, OfTheToolsGoesWithTheBoxOfTheSameVersion) {
  EXPECT_NE(field("Depends", kTools).find("hapticd (= " + field("Version") + ")"), std::string::npos);
  EXPECT_EQ(field("Version", kTools), field("Version"));
}

TEST(DebianPackage, SharesNoFileWithTheOther) {
  const Unpacked box;
  const Unpacked tools(kTools);
  for (const std::string& file : filesBelow(tools.root())) {
    if (file.starts_with("DEBIAN/")) continue;
    EXPECT_FALSE(fs::exists(box.path(file))) << file;
  }
  for (const char* program : {"usr/bin/hapticbench", "usr/bin/haptic-palpate", "usr/bin/haptic-replay"}) {
    EXPECT_TRUE(fs::exists(tools.path(program))) << program;
  }
  for (const char* program : {"usr/bin/hapticctl", "usr/bin/hapticd-view", "usr/bin/haptic-bridge",
                              "usr/bin/haptic-vendor-bridge", "usr/libexec/hapticd/hapticd"}) {
    EXPECT_TRUE(fs::exists(box.path(program))) << program;
  }
}

TEST(DebianPackage, KeepsChangesToTheConfiguration) {
  const Unpacked package;
  EXPECT_EQ(contentOf(package.path("DEBIAN/conffiles")), "/etc/hapticd/hapticd.yaml\n");
  EXPECT_TRUE(fs::exists(package.path("etc/hapticd/hapticd.yaml")));
}

TEST(DebianPackage, HasUnitsThatStartTheInstalledDaemon) {
  const Unpacked package;
  EXPECT_EQ(unitSetting(contentOf(package.path("usr/lib/systemd/system/hapticd.service")), "ExecStart"),
            "/usr/libexec/hapticd/hapticd --config /etc/hapticd/hapticd.yaml");
}

TEST(DebianPackage, HasScriptsThatAShellUnderstands) {
  const Unpacked package;
  for (const char* script : {"postinst", "prerm", "postrm"}) {
    const fs::path path = package.path("DEBIAN") / script;
    EXPECT_EQ(static_cast<unsigned>(fs::status(path).permissions()), 0755U) << script;
    const Finished checked = runTool("sh", {"-n", path});
    EXPECT_EQ(checked.ending, exitedWith(0)) << checked.errors;
  }
}

TEST(DebianPackage, HoldsSumsThatItsFilesHave) {
  const Unpacked package;
  const Finished checked =
      runTool("sh", {"-c", "cd '" + package.root() + "' && md5sum --quiet --strict --check DEBIAN/md5sums"});
  EXPECT_EQ(checked.ending, exitedWith(0)) << checked.output << checked.errors;
}

TEST(DebianPackage, HoldsProgramsWithoutDebugInformation) {
  HAPTICD_NEEDS("readelf");
  const Unpacked package;
  for (const char* program : {"usr/bin/hapticctl", "usr/libexec/hapticd/hapticd"}) {
    const std::string sections = runTool("readelf", {"-SW", package.path(program)}).output;
    EXPECT_NE(sections.find(".text"), std::string::npos) << program;
    EXPECT_EQ(sections.find(".debug_info"), std::string::npos) << program;
  }
}

TEST(DebianPackage, HaveNoErrorThatLintianFinds) {
  HAPTICD_NEEDS("lintian");
  std::vector<std::string> arguments{
      "--fail-on", "error", "--allow-root", packagePath(), packagePath(kTools), packagePath(kPython)};
  if (HAPTICD_WITH_ROS) arguments.push_back(packagePath(kRos));
  const Finished checked = runTool("lintian", arguments);
  EXPECT_EQ(checked.ending, exitedWith(0)) << checked.output << checked.errors;
}

}  // namespace
}  // namespace hapticd::test
