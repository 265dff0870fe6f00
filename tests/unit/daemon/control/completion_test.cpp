// The completion script of bash, run by bash. Those of the other shells are checked for their words only,
// because the shells need not be installed.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "config/parameter_table.h"
#include "process.h"

namespace hapticd::daemon::test {
namespace {

/// What bash offers for the last of `words`, which are separated as bash separates them.
std::vector<std::string> completions(const std::vector<std::string>& words) {
  std::string script = std::string("source <('") + HAPTICCTL + "' completion bash)\nCOMP_WORDS=(";
  for (const std::string& word : words) script += "'" + word + "' ";
  script += ")\nCOMP_CWORD=" + std::to_string(words.size() - 1) +
            "\n_hapticctl\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n";
  const ProcessResult result = runProcess({"/bin/bash", "-c", script});
  EXPECT_EQ("", result.errors);
  std::istringstream lines(result.output);
  std::vector<std::string> offered;
  for (std::string line; std::getline(lines, line);) offered.push_back(line);
  return offered;
}

using Words = std::vector<std::string>;

TEST(Completion, OffersTheCommandsOfTheHelp) {
  const Words offered = completions({"hapticctl", ""});
  const std::string help = runProcess({HAPTICCTL, "--help"}).output;
  const std::string listed = help.substr(help.find("Subcommands:"));
  EXPECT_EQ(
      std::count(listed.begin(), listed.begin() + static_cast<std::ptrdiff_t>(listed.find("\n\n")), '\n'),
      std::ssize(offered));
  for (const std::string& command : offered) {
    EXPECT_NE(std::string::npos, listed.find("\n  " + command + " ")) << command;
  }
  EXPECT_EQ((Words{"set"}), completions({"hapticctl", "--json", "se"}));
  EXPECT_EQ((Words{"disengage", "doctor"}), completions({"hapticctl", "--socket", "/x", "d"}));
}

TEST(Completion, OffersTheCommandsOfAGroup) {
  EXPECT_EQ((Words{"start", "stop"}), completions({"hapticctl", "trace", "st"}));
  EXPECT_EQ((Words{"--label"}), completions({"hapticctl", "--json", "trace", "start", "--la"}));
}

TEST(Completion, OffersTheOptions) {
  EXPECT_EQ((Words{"--socket"}), completions({"hapticctl", "--s"}));
  EXPECT_EQ((Words{"--interval"}), completions({"hapticctl", "watch", "--i"}));
  EXPECT_EQ((Words{"--root"}), completions({"hapticctl", "doctor", "--r"}));
}

TEST(Completion, OffersWhatAnOptionTakes) {
  EXPECT_EQ((Words{"csv", "hdf5"}), completions({"hapticctl", "trace", "export", "--format", ""}));
  EXPECT_EQ((Words{"/usr/bin"}), completions({"hapticctl", "snapshot", "--png", "/usr/bi"}));
  EXPECT_EQ((Words{""}), completions({"hapticctl", "watch", "--interval", ""}));
}

TEST(Completion, OffersEveryParameterToGet) {
  EXPECT_EQ(config::parameterTable().size(), completions({"hapticctl", "get", ""}).size());
  EXPECT_EQ((Words{"camera.near_m"}), completions({"hapticctl", "get", "camera.ne"}));
}

TEST(Completion, OffersOnlyLiveParametersToSet) {
  EXPECT_EQ((Words{"force.radius_m="}), completions({"hapticctl", "set", "force.r"}));
  EXPECT_EQ((Words{""}), completions({"hapticctl", "set", "camera.ne"}));
}

TEST(Completion, OffersTheWordsOfAChoice) {
  EXPECT_EQ((Words{"auto", "nearest_springs", "smooth_springs", "proxy", "surface"}),
            completions({"hapticctl", "set", "force.law", "="}));
  EXPECT_EQ((Words{"nearest_springs"}), completions({"hapticctl", "set", "force.law", "=", "near"}));
}

TEST(Completion, KnowsEveryParameterInTheOtherShellsToo) {
  for (const std::string shell : {"zsh", "fish"}) {
    const ProcessResult result = runProcess({HAPTICCTL, "completion", shell});
    EXPECT_EQ(0, result.exit_code);
    for (const config::Parameter& parameter : config::parameterTable()) {
      EXPECT_NE(std::string::npos, result.output.find(parameter.name)) << shell << ": " << parameter.name;
    }
  }
}

}  // namespace
}  // namespace hapticd::daemon::test
