// SPDX-License-Identifier: Apache-2.0
// The completion scripts of all shells, each run by its shell. zsh offers completions in a terminal only, so
// its functions that take them print them instead.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "config/parameter_table.h"
#include "control_fixture.h"
#include "process.h"

namespace hapticd::daemon::test {
namespace {

using Words = std::vector<std::string>;

std::string inQuotes(const std::string& word) {
  return "'" + word + "'";
}

std::string joined(const Words& words) {
  std::string text;
  for (const std::string& word : words) text += inQuotes(word) + " ";
  return text;
}

/// bash makes '=' a word of its own.
Words asBashSeparates(const Words& words) {
  Words separated;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    separated.push_back(word.substr(0, equals));
    if (equals == std::string::npos) continue;
    separated.emplace_back("=");
    if (equals + 1 < word.size()) separated.push_back(word.substr(equals + 1));
  }
  return separated;
}

std::string bashScript(const Words& words) {
  const Words separated = asBashSeparates(words);
  return "source <(hapticctl completion bash)\nCOMP_WORDS=(" + joined(separated) +
         ")\nCOMP_CWORD=" + std::to_string(separated.size() - 1) +
         "\n_hapticctl\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n";
}

std::string zshScript(const Words& words) {
  return R"(
    compadd() {
      local word behind=
      for word; do
        if [[ -n $behind ]]; then print -r -- "$word"; elif [[ $word == -- ]]; then behind=yes; fi
      done
    }
    _describe() { local word; for word in "${(@P)2}"; do print -r -- "${word%%:*}"; done }
    _files() { print -rl -- "$PREFIX"*(N) }
    compset() { [[ $PREFIX == ${~2}* ]] && PREFIX="${PREFIX#${~2}}" }
    source <(hapticctl completion zsh)
    words=()" +
         joined(words) + ") CURRENT=" + std::to_string(words.size()) +
         R"(
    PREFIX="$words[CURRENT]"
    _hapticctl >$HOME/offered
    while read -r word; do [[ $word == "$PREFIX"* ]] && print -r -- "$word"; done <$HOME/offered
    true)";
}

std::string fishScript(const Words& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + word;
  return "hapticctl completion fish | source\ncomplete -C '" + line +
         "' | string replace -r '\\t.*' '' | string replace -r '^.*=(?=.)' ''\n";
}

struct Shell {
  const char* name;
  Words command;
  std::string (*script)(const Words& words);
  /// It also offers candidates that merely contain the letters, behind those that begin with them (fish 4).
  bool is_loose = false;

  friend std::ostream& operator<<(std::ostream& stream, const Shell& shell) { return stream << shell.name; }
};

const Shell kBash{"bash", {"/bin/bash", "--norc", "-c"}, bashScript};
const Shell kZsh{"zsh", {"/bin/zsh", "-f", "-c"}, zshScript};
const Shell kFish{"fish", {"/usr/bin/fish", "--no-config", "-c"}, fishScript, true};

/// Returns the part of the last word that is to be completed.
std::string typedOf(const Words& words) {
  return words.back().substr(words.back().rfind('=') + 1);
}

/// Returns the words with the last one reduced to the part that determines its kind, such as `--kind=`.
Words withNothingTyped(Words words) {
  const std::string typed = typedOf(words);
  const std::size_t kept =
      words.back().size() - typed.size() + std::min(typed.find_first_not_of('-'), typed.size());
  words.back().resize(kept);
  return words;
}

class Completion : public ControlFixture, public testing::WithParamInterface<Shell> {
 protected:
  Completion() {
    std::filesystem::create_directories(folder.path("bin"));
    std::filesystem::create_symlink(HAPTICCTL, folder.path("bin/hapticctl"));
  }
  /// Returns the offered completions that begin with the typed part of the last word, sorted. Each other
  /// offer is a candidate in that place too.
  Words completions(const Words& words) const {
    Words offered = allCompletions(words);
    if (!GetParam().is_loose) return offered;
    const auto loose = std::ranges::stable_partition(
        offered, [&](const std::string& word) { return word.starts_with(typedOf(words)); });
    if (!loose.empty()) {
      const Words candidates = allCompletions(withNothingTyped(words));
      for (const std::string& word : loose) {
        EXPECT_TRUE(std::ranges::binary_search(candidates, word)) << word;
      }
    }
    offered.erase(loose.begin(), loose.end());
    return offered;
  }

  /// All that the shell offers for the last word, sorted.
  Words allCompletions(const Words& words) const {
    Words command = GetParam().command;
    command.push_back("export PATH=" + folder.path("bin") + ":/usr/bin:/bin\n" + GetParam().script(words));
    const ProcessResult result = runProcess(command, {.environment = {"HOME=" + folder.path("")}});
    EXPECT_EQ("", result.errors);
    std::istringstream lines(result.output);
    Words offered;
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty() && line != words.back()) offered.push_back(line);
    }
    std::ranges::sort(offered);
    return offered;
  }
};

TEST_P(Completion, OffersTheCommandsOfTheHelp) {
  const Words offered = completions({"hapticctl", ""});
  const std::string help = runProcess({HAPTICCTL, "--help"}).output;
  std::string listed = help.substr(help.find("Subcommands:"));
  listed.resize(listed.find("\n\n"));
  std::size_t commands = 0;
  for (std::size_t at = 0; (at = listed.find("\n  ", at)) != std::string::npos; at += 3) {
    if (listed.at(at + 3) != ' ') ++commands;  // else the text of a command goes on
  }
  EXPECT_EQ(commands, offered.size());
  for (const std::string& command : offered) {
    EXPECT_NE(std::string::npos, listed.find("\n  " + command + " ")) << command;
  }
  EXPECT_EQ((Words{"set"}), completions({"hapticctl", "--json", "se"}));
  EXPECT_EQ((Words{"disengage", "doctor"}), completions({"hapticctl", "--socket", "/x", "d"}));
}

TEST_P(Completion, OffersTheCommandsOfAGroup) {
  EXPECT_EQ((Words{"start", "stop"}), completions({"hapticctl", "trace", "st"}));
  EXPECT_EQ((Words{"--label"}), completions({"hapticctl", "--json", "trace", "start", "--la"}));
}

TEST_P(Completion, OffersTheOptions) {
  EXPECT_EQ((Words{"--socket"}), completions({"hapticctl", "--s"}));
  EXPECT_EQ((Words{"--interval"}), completions({"hapticctl", "watch", "--i"}));
  EXPECT_EQ((Words{"--root"}), completions({"hapticctl", "doctor", "--r"}));
}

TEST_P(Completion, OffersWhatAnOptionTakes) {
  EXPECT_EQ((Words{"csv", "recording"}), completions({"hapticctl", "trace", "export", "--format", ""}));
  EXPECT_EQ((Words{}), completions({"hapticctl", "watch", "--interval", ""}));
}

TEST_P(Completion, OffersTheKindsOfEventsAndWhatAListIsSortedBy) {
  EXPECT_EQ(4U,  // camera, calibration, clear_fault, configuration
            completions({"hapticctl", "events", "--kind", "c"}).size());
  EXPECT_EQ((Words{"name", "size", "time"}), completions({"hapticctl", "trace", "list", "--sort", ""}));
}

TEST_P(Completion, OffersTheCommandsThatThereIsHelpFor) {
  EXPECT_EQ((Words{"status"}), completions({"hapticctl", "help", "stat"}));
}

TEST_P(Completion, OffersFiles) {
  std::ofstream(folder.path("view.png")) << "";
  const Words offered = completions({"hapticctl", "snapshot", "--png", folder.path("vi")});
  EXPECT_EQ((Words{folder.path("view.png")}), offered);
}

TEST_P(Completion, OffersEveryParameterToGet) {
  EXPECT_EQ(config::parameterTable().size(), completions({"hapticctl", "get", ""}).size());
  EXPECT_EQ((Words{"camera.near_m"}), completions({"hapticctl", "get", "camera.ne"}));
}

TEST_P(Completion, OffersOnlyLiveParametersToSet) {
  EXPECT_EQ((Words{"force.radius_m="}), completions({"hapticctl", "set", "force.r"}));
  EXPECT_EQ((Words{}), completions({"hapticctl", "set", "camera.ne"}));
}

TEST_P(Completion, OffersTheWordsOfAChoice) {
  EXPECT_EQ((Words{"auto", "nearest_springs", "proxy", "smooth_springs", "surface"}),
            completions({"hapticctl", "set", "force.law="}));
  EXPECT_EQ((Words{"nearest_springs"}), completions({"hapticctl", "set", "force.law=near"}));
}

TEST_P(Completion, OffersTheProfilesOfTheDaemon) {
  start();
  for (const char* name : {"soft", "stiff"}) {
    askControl("io.hapticd.Control.SaveProfile", R"({"name":")" + std::string(name) + R"("})");
  }
  const Words line{"hapticctl", "--socket", controlPath(), "load", "s"};
  EXPECT_EQ((Words{"soft", "stiff"}), completions(line));
  EXPECT_EQ((Words{"stiff"}),
            completions({"hapticctl", "--socket", controlPath(), "profiles", "--boot", "st"}));
  EXPECT_EQ((Words{}), completions({"hapticctl", "--socket", folder.path("none"), "load", ""}));
}

TEST_P(Completion, OffersTheTracesOfTheDaemon) {
  start();
  const auto name = askControl("io.hapticd.Control.StartTrace")["parameters"]["name"].get<std::string>();
  const std::string begin = name.substr(0, 2);
  EXPECT_EQ((Words{name}), completions({"hapticctl", "--socket", controlPath(), "trace", "delete", begin}));
  EXPECT_EQ((Words{name}), completions({"hapticctl", "--socket", controlPath(), "trace", "info", begin}));
  EXPECT_EQ((Words{name}), completions({"hapticctl", "--socket", controlPath(), "trace", "note", begin}));
}

TEST_P(Completion, OffersTheFixturesAndRegionsOfTheDaemon) {
  start();
  askControl("io.hapticd.Control.ChangeFixtures",
             R"({"add":[{"name":"nerve","kind":"point","position_m":[0,0,-1]},)"
             R"({"name":"vein","kind":"point","position_m":[0,0,-1]}]})");
  askControl("io.hapticd.Control.ChangeRegions",
             R"({"add":[{"name":"liver","shape":"sphere","position_m":[0,0,-1],"radius_m":0.05}]})");
  const auto offered = [&](const Words& command) {
    Words words{"hapticctl", "--socket", controlPath()};
    words.insert(words.end(), command.begin(), command.end());
    return completions(words);
  };
  EXPECT_EQ((Words{"nerve", "vein"}), offered({"fixture", "enable", ""}));
  EXPECT_EQ((Words{"vein"}), offered({"fixture", "show", "v"}));
  EXPECT_EQ((Words{"liver"}), offered({"region", "remove", "l"}));
  EXPECT_EQ((Words{"box", "path", "plane", "sphere"}), offered({"fixture", "touch", "--kind", ""}));
}

INSTANTIATE_TEST_SUITE_P(Shells, Completion, testing::Values(kBash, kZsh, kFish),
                         [](const auto& shell) { return shell.param.name; });

}  // namespace
}  // namespace hapticd::daemon::test
