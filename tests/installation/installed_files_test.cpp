// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "config/settings/parameter_table.h"
#include "tests/installation/staged_installation.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> kPrograms{"usr/bin/haptic-bridge",
                                      "usr/bin/haptic-crtk-bridge",
                                      "usr/bin/haptic-palpate",
                                      "usr/bin/haptic-replay",
                                      "usr/bin/haptic-vendor-bridge",
                                      "usr/bin/hapticbench",
                                      "usr/bin/hapticctl",
                                      "usr/bin/hapticd-ros",
                                      "usr/bin/hapticd-view",
                                      "usr/libexec/hapticd/hapticctl-machine",
                                      "usr/libexec/hapticd/hapticctl-register",
                                      "usr/libexec/hapticd/hapticctl-shapes",
                                      "usr/libexec/hapticd/hapticctl-trace",
                                      "usr/libexec/hapticd/hapticd",
                                      "usr/sbin/hapticd-realtime-setup",
                                      "usr/share/doc/hapticd-tools/examples/slurm"};

constexpr const char* kPageFolder = "usr/share/hapticd/view/";

bool isOfThePage(const std::string& file) {
  return file.starts_with(kPageFolder);
}

Finished install(const fs::path& prefix) {
  return runToEnd({HAPTICD_CMAKE, "--install", HAPTICD_BUILD_FOLDER, "--prefix", prefix.string()});
}

TEST(Installation, PutsEveryFileInItsPlace) {
  std::vector<std::string> expected{
      "etc/hapticd/hapticd.yaml",
      "usr/bin/haptic-bridge",
      "usr/bin/haptic-crtk-bridge",
      "usr/bin/haptic-palpate",
      "usr/bin/haptic-replay",
      "usr/bin/haptic-vendor-bridge",
      "usr/bin/hapticbench",
      "usr/bin/hapticctl",
      "usr/bin/hapticd-ros",
      "usr/bin/hapticd-view",
      "usr/lib/python3/dist-packages/hapticd/__init__.py",
      "usr/lib/python3/dist-packages/hapticd/box.py",
      "usr/lib/python3/dist-packages/hapticd/device.py",
      "usr/lib/python3/dist-packages/hapticd/error.py",
      "usr/lib/python3/dist-packages/hapticd/interface.py",
      "usr/lib/python3/dist-packages/hapticd/link.py",
      "usr/lib/python3/dist-packages/hapticd/py.typed",
      "usr/lib/python3/dist-packages/hapticd/trace.py",
      "usr/lib/systemd/system/hapticd-control.socket",
      "usr/lib/systemd/system/hapticd-metrics.socket",
      "usr/lib/systemd/system/hapticd-metrics@.service",
      "usr/lib/systemd/system/hapticd-ros.service",
      "usr/lib/systemd/system/hapticd-status.socket",
      "usr/lib/systemd/system/hapticd-view.service",
      "usr/lib/systemd/system/hapticd-view.socket",
      "usr/lib/systemd/system/hapticd.service",
      "usr/lib/sysusers.d/hapticd.conf",
      "usr/lib/tmpfiles.d/hapticd.conf",
      "usr/lib/udev/rules.d/72-hapticd.rules",
      "usr/libexec/hapticd/hapticctl-machine",
      "usr/libexec/hapticd/hapticctl-register",
      "usr/libexec/hapticd/hapticctl-shapes",
      "usr/libexec/hapticd/hapticctl-trace",
      "usr/libexec/hapticd/hapticd",
      "usr/sbin/hapticd-realtime-setup",
      "usr/share/bash-completion/completions/hapticctl",
      "usr/share/doc/hapticd-ros/changelog.Debian.gz",
      "usr/share/doc/hapticd-ros/copyright",
      "usr/share/doc/hapticd-tools/changelog.Debian.gz",
      "usr/share/doc/hapticd-tools/copyright",
      "usr/share/doc/hapticd-tools/examples/slurm",
      "usr/share/doc/hapticd/README.md",
      "usr/share/doc/hapticd/changelog.Debian.gz",
      "usr/share/doc/hapticd/changelog.gz",
      "usr/share/doc/hapticd/copyright",
      "usr/share/doc/hapticd/docs/README.md",
      "usr/share/doc/hapticd/docs/architecture.md",
      "usr/share/doc/hapticd/docs/box.svg",
      "usr/share/doc/hapticd/docs/cameras.md",
      "usr/share/doc/hapticd/docs/cluster.md",
      "usr/share/doc/hapticd/docs/comparison.md",
      "usr/share/doc/hapticd/docs/control-api.md",
      "usr/share/doc/hapticd/docs/faults.md",
      "usr/share/doc/hapticd/docs/fixtures.md",
      "usr/share/doc/hapticd/docs/glossary.md",
      "usr/share/doc/hapticd/docs/handles.md",
      "usr/share/doc/hapticd/docs/hardware.md",
      "usr/share/doc/hapticd/docs/licensing.md",
      "usr/share/doc/hapticd/docs/live-view.md",
      "usr/share/doc/hapticd/docs/measurements.md",
      "usr/share/doc/hapticd/docs/pareto.svg",
      "usr/share/doc/hapticd/docs/patents.md",
      "usr/share/doc/hapticd/docs/recipes.md",
      "usr/share/doc/hapticd/docs/ros2-check.md",
      "usr/share/doc/hapticd/docs/ros2.md",
      "usr/share/doc/hapticd/docs/traces.md",
      "usr/share/doc/hapticd/docs/view.png",
      "usr/share/doc/hapticd/docs/viewers.md",
      "usr/share/doc/hapticd/examples/50-cpu.conf",
      "usr/share/doc/hapticd/examples/60-udp-peer.conf",
      "usr/share/doc/hapticd/examples/70-mail.conf",
      "usr/share/doc/hapticd/examples/73-vendor-handles.rules",
      "usr/share/doc/hapticd/examples/d435.yaml",
      "usr/share/doc/hapticd/examples/demo-fixtures.yaml",
      "usr/share/doc/hapticd/examples/demo.yaml",
      "usr/share/doc/hapticd/examples/depth.py",
      "usr/share/doc/hapticd/examples/device.py",
      "usr/share/doc/hapticd/examples/forces.c",
      "usr/share/doc/hapticd/examples/forces.py",
      "usr/share/doc/hapticd/examples/haptic-bridge.service",
      "usr/share/doc/hapticd/examples/hapticd-alerts.yml",
      "usr/share/doc/hapticd/examples/hapticd-check.service",
      "usr/share/doc/hapticd/examples/hapticd-check.timer",
      "usr/share/doc/hapticd/examples/hapticd-mail.service",
      "usr/share/doc/hapticd/examples/hdf5_from_trace.py",
      "usr/share/doc/hapticd/examples/recording_from_images.py",
      "usr/share/doc/hapticd/examples/ticks.py",
      "usr/share/doc/hapticd/hid-reports.md",
      "usr/share/doc/hapticd/udp-protocol.md",
      "usr/share/doc/python3-hapticd/changelog.Debian.gz",
      "usr/share/doc/python3-hapticd/copyright",
      "usr/share/fish/vendor_completions.d/hapticctl.fish",
      "usr/share/man/man1/haptic-bridge.1.gz",
      "usr/share/man/man1/haptic-crtk-bridge.1.gz",
      "usr/share/man/man1/haptic-palpate.1.gz",
      "usr/share/man/man1/haptic-replay.1.gz",
      "usr/share/man/man1/hapticbench.1.gz",
      "usr/share/man/man1/hapticctl.1.gz",
      "usr/share/man/man5/hapticd.yaml.5.gz",
      "usr/share/man/man7/hapticd-varlink.7.gz",
      "usr/share/man/man8/hapticd-realtime-setup.8.gz",
      "usr/share/man/man8/hapticd-ros.8.gz",
      "usr/share/man/man8/hapticd-view.8.gz",
      "usr/share/man/man8/hapticd.8.gz",
      "usr/share/zsh/vendor-completions/_hapticctl",
  };
  if (!HAPTICD_WITH_ROS)
    std::erase_if(expected, [](const std::string& file) {
      return file.contains("hapticd-ros") || file.contains("haptic-crtk-bridge");
    });
  std::vector<std::string> installed = filesBelow(stagedRoot());
  std::erase_if(installed, isOfThePage);
  EXPECT_EQ(installed, expected);
}

TEST(Installation, PutsEveryFileOfThePageBesideTheOthers) {
  const fs::path source = fs::path(HAPTICD_SOURCE_FOLDER) / "tools/hapticd-view/page";
  std::size_t files = 0;
  for (const std::string& file : filesBelow(source)) {
    if (file.find('/') != std::string::npos || file.ends_with(".md")) continue;
    EXPECT_EQ(contentOf(stagedRoot() / kPageFolder / file), contentOf(source / file)) << file;
    ++files;
  }
  EXPECT_GT(files, 0U);
  EXPECT_TRUE(fs::exists(stagedRoot() / kPageFolder / "index.html"));
}

TEST(Installation, LetsEverybodyReadAndNobodyElseWrite) {
  for (const std::string& file : filesBelow(stagedRoot())) {
    const auto mode = static_cast<unsigned>(fs::status(stagedRoot() / file).permissions());
    EXPECT_EQ(mode, kPrograms.contains(file) ? 0755U : 0644U) << file;
  }
}

TEST(Installation, InstallsTheShippedConfigurationUnchanged) {
  EXPECT_EQ(contentOf(stagedRoot() / "etc/hapticd/hapticd.yaml"),
            contentOf(fs::path(HAPTICD_SOURCE_FOLDER) / "config/hapticd.yaml"));
}

TEST(Installation, InstallsTheCompletionThatHapticctlPrints) {
  const std::string hapticctl = stagedRoot() / "usr/bin/hapticctl";
  EXPECT_EQ(contentOf(stagedRoot() / "usr/share/bash-completion/completions/hapticctl"),
            runToEnd({hapticctl, "completion", "bash"}).output);
  EXPECT_EQ(contentOf(stagedRoot() / "usr/share/zsh/vendor-completions/_hapticctl"),
            runToEnd({hapticctl, "completion", "zsh"}).output);
  EXPECT_EQ(contentOf(stagedRoot() / "usr/share/fish/vendor_completions.d/hapticctl.fish"),
            runToEnd({hapticctl, "completion", "fish"}).output);
}

TEST(Installation, UnderAnotherPrefixStaysBelowIt) {
  const TemporaryFolder home;
  const Finished finished = install(home.path());
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  std::set<std::string> below_usr;
  for (std::string file : filesBelow(stagedRoot())) {
    below_usr.insert(file.starts_with("usr/") ? file.substr(4) : file);
  }
  const std::vector<std::string> files = filesBelow(home.path());
  EXPECT_EQ(std::set<std::string>(files.begin(), files.end()), below_usr);
}

TEST(Installation, UnderAnotherPrefixHasAUnitWithItsPaths) {
  const TemporaryFolder home;
  ASSERT_EQ(install(home.path()).ending, exitedWith(0));
  const std::string prefix = home.path();
  EXPECT_EQ(unitSetting(contentOf(home.path() / "lib/systemd/system/hapticd.service"), "ExecStart"),
            prefix + "/libexec/hapticd/hapticd --config " + prefix + "/etc/hapticd/hapticd.yaml");
}

TEST(Installation, KeepsAChangedConfiguration) {
  const TemporaryFolder home;
  fs::create_directories(home.path() / "etc/hapticd");
  home.write("etc/hapticd/hapticd.yaml", "force: {radius_m: 0.03}\n");
  ASSERT_EQ(install(home.path()).ending, exitedWith(0));
  EXPECT_EQ(contentOf(home.path() / "etc/hapticd/hapticd.yaml"), "force: {radius_m: 0.03}\n");
}

const std::vector<std::string> kPages{
    "man1/haptic-bridge.1.gz",   "man1/haptic-palpate.1.gz", "man1/haptic-replay.1.gz",
    "man1/hapticbench.1.gz",     "man1/hapticctl.1.gz",      "man5/hapticd.yaml.5.gz",
    "man7/hapticd-varlink.7.gz", "man8/hapticd-view.8.gz",   "man8/hapticd.8.gz"};

std::string pagePath(const std::string& page) {
  return stagedRoot() / "usr/share/man" / page;
}

/// Returns the page's source without the escapes that split words.
std::string pageText(const std::string& page) {
  std::string text = runTool("gzip", {"-dc", pagePath(page)}).output;
  text = std::regex_replace(text, std::regex(R"(\\:)"), "");
  return std::regex_replace(text, std::regex(R"(\\-)"), "-");
}

std::string helpOf(const std::string& program, const std::string& command = "") {
  std::vector<std::string> line{std::string(HAPTICD_PROGRAM_FOLDER) + "/" + program};
  std::istringstream words(command);
  for (std::string word; words >> word;) line.push_back(word);
  line.emplace_back("--help");
  return runToEnd(line).output;
}

std::set<std::string> wordsOf(const std::string& text, const char* pattern) {
  const std::regex word(pattern);
  std::set<std::string> words;
  for (std::sregex_iterator match(text.begin(), text.end(), word), end; match != end; ++match) {
    words.insert((*match)[1]);
  }
  return words;
}

std::set<std::string> commandsOf(const std::string& program, const std::string& above = "") {
  const std::string help = helpOf(program, above);
  const std::size_t begin = help.find("Subcommands:\n");
  return begin == std::string::npos ? std::set<std::string>{}
                                    : wordsOf(help.substr(begin), "\n  ([a-z][a-z-]*)(?= )");
}

/// The help of all commands of a program, and of those below them; the page must have a heading for each.
std::string helpBelow(const std::string& program, const std::string& above, const std::string& page_text) {
  std::string help;
  for (const std::string& name : commandsOf(program, above)) {
    const std::string command = above.empty() ? name : above + " " + name;
    EXPECT_NE(page_text.find("\n.SS " + command + "\n"), std::string::npos) << command;
    help += helpOf(program, command) + helpBelow(program, command, page_text);
  }
  return help;
}

/// Whether the page has a heading for each command, and every option that any help shows.
void expectComplete(const std::string& program, const std::string& page) {
  const std::string text = pageText(page);
  const std::string help = helpOf(program) + helpBelow(program, "", text);
  const std::set<std::string> options = wordsOf(help, "\n  (?:-[a-z],)?(--[a-z][a-z-]*)");
  EXPECT_TRUE(options.contains("--help"));
  for (const std::string& option : options) EXPECT_NE(text.find(option), std::string::npos) << option;
}

TEST(Manual, ShowsEveryParameterWithRangeAndDefault) {
  const std::string text = pageText("man5/hapticd.yaml.5.gz");
  for (const config::Parameter& parameter : config::parameterTable()) {
    const std::size_t begin = text.find("\n\\fB" + std::string(parameter.name) + "\\fR\n");
    ASSERT_NE(begin, std::string::npos) << parameter.name;
    const std::string paragraph = text.substr(begin, text.find(".TP", begin + 1) - begin);
    EXPECT_NE(paragraph.find("Allowed: " + parameter.range() + "."), std::string::npos) << paragraph;
    const std::string value = config::toText(parameter.defaultValue());
    EXPECT_NE(paragraph.find("Default: " + (value.empty() ? "empty" : value) + "."), std::string::npos)
        << paragraph;
  }
}

TEST(Manual, ShowsEveryCommandAndOptionOfHapticctl) {
  EXPECT_TRUE(commandsOf("hapticctl").contains("status"));
  expectComplete("hapticctl", "man1/hapticctl.1.gz");
}

TEST(Manual, ShowsEveryMethodTypeAndErrorOfTheInterfaces) {
  const std::string text = pageText("man7/hapticd-varlink.7.gz");
  int items = 0;
  for (const char* file : {"io.hapticd.Status", "io.hapticd.Control", "org.varlink.service"}) {
    const std::string definition = contentOf(std::filesystem::path(HAPTICD_SOURCE_FOLDER) / "daemon/control" /
                                             (std::string(file) + ".varlink"));
    for (const std::string& item : wordsOf(definition, "\n((?:type|method|error) [A-Za-z]+)")) {
      EXPECT_NE(text.find("\n.SS " + item + "\n"), std::string::npos) << item;
      ++items;
    }
    for (const std::string& field : wordsOf(definition, "\n  ([A-Za-z0-9]+: [^,\n(]+)")) {
      EXPECT_NE(text.find("\\fB" + field + "\\fR\n"), std::string::npos) << field;
    }
  }
  EXPECT_GT(items, 20);
}

TEST(Manual, ShowsEveryCommandAndOptionOfHapticbench) {
  EXPECT_TRUE(commandsOf("hapticbench").contains("pareto"));
  expectComplete("hapticbench", "man1/hapticbench.1.gz");
}

TEST(Manual, ShowsEveryOptionOfHapticBridge) {
  expectComplete("haptic-bridge", "man1/haptic-bridge.1.gz");
}

TEST(Manual, ShowsEveryOptionOfHapticPalpate) {
  expectComplete("haptic-palpate", "man1/haptic-palpate.1.gz");
}

TEST(Manual, ShowsEveryOptionOfHapticReplay) {
  expectComplete("haptic-replay", "man1/haptic-replay.1.gz");
}

TEST(Manual, ShowsEveryOptionOfHapticdView) {
  expectComplete("hapticd-view", "man8/hapticd-view.8.gz");
}

TEST(Manual, ShowsEveryOptionOfHapticdRos) {
  if (!HAPTICD_WITH_ROS) GTEST_SKIP() << "this build has no hapticd-ros";
  expectComplete("hapticd-ros", "man8/hapticd-ros.8.gz");
  expectComplete("haptic-crtk-bridge", "man1/haptic-crtk-bridge.1.gz");
}

TEST(Manual, ShowsEveryOptionOfHapticd) {
  expectComplete("hapticd", "man8/hapticd.8.gz");
}

TEST(Manual, ShowsTheExitStatusesOfHapticd) {
  const std::string text = pageText("man8/hapticd.8.gz");
  EXPECT_NE(text.find("\\fB64\\fR\nusage"), std::string::npos);
  EXPECT_NE(text.find("\\fB78\\fR\nconfiguration"), std::string::npos);
}

TEST(Manual, HasNothingThatGroffWarnsAbout) {
  HAPTICD_NEEDS("groff");
  for (const std::string& page : kPages) {
    const Finished unpacked =
        runTool("sh", {"-c", "gzip -dc '" + pagePath(page) + "' | groff -man -Tutf8 -ww -z"});
    EXPECT_EQ(unpacked.ending, exitedWith(0)) << page;
    EXPECT_EQ(unpacked.errors, "") << page;
  }
}

TEST(Manual, IsFoundUnderItsNameByManDb) {
  HAPTICD_NEEDS("lexgrog");
  for (const std::string& page : kPages) {
    const Finished finished = runTool("lexgrog", {pagePath(page)});
    EXPECT_EQ(finished.ending, exitedWith(0)) << page << finished.output << finished.errors;
  }
}

}  // namespace
}  // namespace hapticd::test
