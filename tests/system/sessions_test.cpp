// SPDX-License-Identifier: Apache-2.0
// Sessions at the command line, to the letter: sessions/*.golden.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <regex>
#include <sstream>
#include <string>

#include "tests/support/golden_file.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/recordings/made_up_scene.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

/// A shell in the folder of a daemon, which runs the commands of transcripts. All programs are on its PATH,
/// and hapticctl calls the daemon on the socket there. `until_says TEXT COMMAND` repeats a command until it
/// prints the text.
class Shell {
 public:
  explicit Shell(const DaemonHome& home) : home_(home) {}

  /// Runs a command: its standard output, the lines of standard error behind "2> ", and "[STATUS]" unless
  /// that is 0. Paths are relative to the folder; TIME stands for the time in the name of a trace.
  std::string answer(const std::string& command) const;
  Finished run(const std::string& command) const;

 private:
  const DaemonHome& home_;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

constexpr const char* kFunctions =
    "until_says() {\n"
    "  text=$1; shift\n"
    "  until \"$@\" 2>&1 | grep -q -e \"$text\"; do sleep 0.02; done\n"
    "}\n";

Finished Shell::run(const std::string& command) const {
  const ProgramOptions options{
      .environment = {
          "PATH=" + std::filesystem::path(HAPTICD_PROGRAM).parent_path().string() + ":/usr/bin:/bin",
          "HAPTICD_SOCKET=Control"}};
  return runToEnd({"/bin/sh", "-c", fmt::format("cd '{}'\n{}{}", home_.path().string(), kFunctions, command)},
                  options);
}

std::string Shell::answer(const std::string& command) const {
  const Finished finished = run(command);
  std::string text = finished.output;
  if (!text.empty() && !text.ends_with('\n')) text += '\n';
  std::istringstream errors(finished.errors);
  for (std::string line; std::getline(errors, line);) text += "2> " + line + "\n";
  if (finished.ending != exitedWith(0)) text += fmt::format("[{}]\n", finished.ending.code);
  const std::string folder = home_.path().string();
  static const std::regex time("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}[-:][0-9]{2}[-:][0-9]{2}Z");
  return std::regex_replace(replaced(replaced(text, folder + "/", ""), folder, "."), time, "TIME");
}

std::string golden(const std::string& name) {
  return std::string(HAPTICD_SOURCE_FOLDER "/tests/system/sessions/") + name + ".golden";
}

/// A session, and whether a daemon with a hand at a wall runs meanwhile.
struct Session {
  const char* name;
  bool with_daemon = false;

  friend std::ostream& operator<<(std::ostream& stream, const Session& session) {
    return stream << session.name;
  }
};

class Sessions : public testing::TestWithParam<Session> {
 protected:
  /// What commands are given to work on.
  Sessions() {
    std::filesystem::create_directory(home.path() / "given");
    writeTrace(home.path() / "given/a.mcap", madeUpRecords(2, 1000), 1000);
    home.write("given/config.yaml", "loop: {rate_hz: 1000}\n");
    home.write("given/hip.csv", "t_s,x_m,y_m,z_m\n0,0,0,-0.98\n0.001,0,0,-0.98\n");
    writeOlderTrace(home.path() / "given/older.mcap", madeUpRecords(1, 50).ticks);
    for (const auto& [name, raw] : {std::pair("wall", 760), {"none", 2047}, {"near", 10}})
      home.write(std::string("given/") + name + ".pgm", pgmBytes(wallImage(static_cast<std::uint16_t>(raw))));
  }

  const DaemonHome home;
};

TEST_P(Sessions, AreAnsweredAsWritten) {
  std::optional<Daemon> daemon;
  if (GetParam().with_daemon) {
    daemon.emplace(home);
    ASSERT_TRUE(daemon->answers());
    ASSERT_TRUE(
        daemon->reaches([](const nlohmann::json& status) { return status["tick"]["pointsUsed"] == 100; }));
  }
  const Shell shell(home);
  expectTranscript(golden(GetParam().name),
                   [&](const std::string& command) { return shell.answer(command); });
}

INSTANTIATE_TEST_SUITE_P(All, Sessions,
                         testing::Values(Session{"bad_input"}, Session{"completion", true},
                                         Session{"configurations"}, Session{"hapticctl_fixtures", true},
                                         Session{"hapticctl_parameters", true},
                                         Session{"hapticctl_traces", true}, Session{"lost_output", true},
                                         Session{"trace_files"}),
                         [](const auto& session) { return std::string(session.param.name); });

/// The exit status and what is said behind the name of the program; without the line that names the help,
/// which most refusals have.
std::string refusalOf(const Shell& shell, const std::string& command) {
  const Finished refused = shell.run(command);
  EXPECT_TRUE(refused.ending.exited) << command;
  EXPECT_EQ(refused.output, "") << command;
  const std::string program = command.substr(0, command.find(' '));
  EXPECT_TRUE(refused.errors.starts_with(program + ": ")) << command << ": " << refused.errors;
  std::string said = refused.errors.substr(std::min(program.size() + 2, refused.errors.size()));
  const std::size_t help = said.rfind("\nRun '" + program);
  const bool names_help = help != std::string::npos && said.ends_with(" --help' for more information.\n");
  if (names_help) said.resize(help);
  return fmt::format("[{}{}] {}\n", refused.ending.code, names_help ? "" : ", alone", said);
}

void expectRefusals(const std::string& transcript) {
  const DaemonHome home;
  const Shell shell(home);
  expectTranscript(golden(transcript),
                   [&shell](const std::string& command) { return refusalOf(shell, command); });
  EXPECT_TRUE(home.entries().empty());
}

TEST(WrongCommandLines, AreRefusedWithTheReasonAndWhereToReadMore) {
  expectRefusals("wrong_command_lines");
#ifdef HAPTICD_ROS_PROGRAM
  expectRefusals("wrong_command_lines_ros");
#endif
}

}  // namespace
}  // namespace hapticd::test
