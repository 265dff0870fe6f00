#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/installation/staged_installation.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

/// The package that ctest has made from this build.
std::string packagePath() {
  for (const fs::directory_entry& entry : fs::directory_iterator(HAPTICD_PACKAGE_FOLDER)) {
    if (entry.path().extension() == ".deb") return entry.path();
  }
  ADD_FAILURE() << "run these tests by ctest, which makes the package first";
  return {};
}

std::string field(const std::string& name) {
  std::string value = runTool("dpkg-deb", {"--field", packagePath(), name}).output;
  while (value.ends_with('\n')) value.pop_back();
  return value;
}

/// The package taken apart.
class Unpacked {
 public:
  Unpacked() { ended = runTool("dpkg-deb", {"--raw-extract", packagePath(), root()}).ending; }
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

TEST(DebianPackage, NeedsTheLibrariesThatItsProgramsAreLinkedWith) {
  const std::string depends = field("Depends");
  // without the numbers that differ between Debian's releases
  for (const char* library :
       {"libc6", "libfreenect0.5", "libfmt", "libgpiod", "libsystemd0", "libyaml-cpp", "systemd"}) {
    EXPECT_NE(depends.find(library), std::string::npos) << library << " is not in: " << depends;
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

TEST(DebianPackage, HasNoErrorThatLintianFinds) {
  HAPTICD_NEEDS("lintian");
  const Finished checked = runTool("lintian", {"--fail-on", "error", "--allow-root", packagePath()});
  EXPECT_EQ(checked.ending, exitedWith(0)) << checked.output << checked.errors;
}

}  // namespace
}  // namespace hapticd::test
