// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "config/settings/parameter_table.h"
#include "tests/installation/staged_installation.h"

namespace hapticd::test {
namespace {

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
