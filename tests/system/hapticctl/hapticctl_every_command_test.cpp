// SPDX-License-Identifier: Apache-2.0
// What holds for every command of hapticctl, as its own help lists them: --json, the width of a terminal, and
// names that are shortened.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "tests/support/made_up_trace.h"
#include "tests/system/hapticctl/command_table.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/loopback_listener.h"
#include "tests/system/support/terminal_program.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

constexpr int kUsage = 2;
constexpr int kNoConnection = 3;

/// A command, as the help lists it.
struct Leaf {
  Command path;
  bool may_be_shortened = false;
};

/// Commands that work without a daemon. FILE stands for a trace, FOLDER for the folder of the test, PORT for
/// one that listens.
const std::vector<Command> kWithoutDaemon{
    {"camera", "list"},
    {"handle", "list"},
    {"completion", "bash"},
    {"help", "trace", "list"},
    {"trace", "info", "FILE"},
    {"trace", "breaches", "FILE"},
    {"trace", "export", "FILE", "--out", "FOLDER/out.csv"},
    {"trace", "export", "FILE", "--format", "rosbag2", "--out", "FOLDER/out.mcap"},
    {"trace", "recover", "FILE", "--out", "FOLDER/recovered.mcap"},
    {"trace", "plot", "FILE", "--out", "FOLDER/out.svg"},
    {"view", "--port", "PORT", "--token-file", "FOLDER/token"}};

/// Lists of names, and other forms whose text is not that of the command alone.
const std::vector<Command> kOtherForms{
    {"fixture", "list", "--names"}, {"region", "list", "--names"},
    {"trace", "list", "--names"},   {"profiles", "--names"},
    {"metrics", "--prometheus"},    {"watch", "--count", "2", "--interval", "20", "--summary"}};

/// Commands that cannot work with the daemon of these tests: there is no fault, no camera of the driver v4l2
/// and no hapticd-ros. `doctor` fails where the machine is not set up for hapticd.
const std::vector<Command> kFailing{{"clear-fault"},
                                    {"camera", "test"},
                                    {"doctor"},
                                    {"frame", "show", "ghost"},
                                    {"frame", "feed", "ghost"},
                                    {"ros", "--file", "nowhere.json"}};

/// As long as names may be.
const std::string kLongName = "abcdefghijabcdefghijabcdefghijab";
const std::string kLongLabel = kLongName + kLongName;

bool isStream(const Command& command) {
  return command[0] == "watch" || command[0] == "events";
}

class EveryCommand : public testing::Test {
 protected:
  EveryCommand() {
    writeCommandFiles(home);
    writeTrace(home.path() / "a.mcap", madeUpRecords(1, 50), 50);
    home.write("token", std::string(32, 'a') + "\n");
  }

  Command complete(const Command& command) const {
    Command words = completedCommand(home, command);
    for (std::string& word : words) {
      if (word == "FILE") word = home.path() / "a.mcap";
      if (word == "PORT") word = view.port();
      if (word.starts_with("FOLDER")) word.replace(0, 6, home.path().string());
    }
    return words;
  }

  /// The commands below a group, from its help.
  std::vector<Leaf> leavesBelow(const Command& group) const {
    Command help{"--json", "help"};
    help.insert(help.end(), group.begin(), group.end());
    const Finished finished = home.control(help);
    const json document = json::parse(finished.output, nullptr, false);
    if (document.is_discarded()) {
      ADD_FAILURE() << finished.output << finished.errors;
      return {};
    }
    std::vector<Leaf> leaves;
    for (const json& command : document.at("commands")) {
      Command path = group;
      path.push_back(command.at("name"));
      std::vector<Leaf> below;
      if (path.size() < 3) below = leavesBelow(path);
      if (below.empty()) below.push_back({path, command.at("mayBeShortened")});
      leaves.insert(leaves.end(), below.begin(), below.end());
    }
    return leaves;
  }

  std::vector<Leaf> leaves() const { return leavesBelow({}); }

  /// The calls of all commands, in an order in which all but those of kFailing work.
  std::vector<Command> calls() const {
    std::vector<Command> all;
    for (const Call& call : kCalls) all.push_back(call.command);
    for (const auto* list : {&kWithoutDaemon, &kOtherForms, &kFailing})
      all.insert(all.end(), list->begin(), list->end());
    return all;
  }

  DaemonHome home;
  LoopbackListener view;
};

/// Whether a text is one JSON document, or for streams one a line, and says anything.
testing::AssertionResult isJson(const std::string& text, bool stream) {
  std::vector<std::string> documents{text};
  if (stream) {
    documents.clear();
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) documents.push_back(line);
  }
  for (const std::string& document : documents) {
    const json read = json::parse(document, nullptr, false);
    if (read.is_discarded() || !read.is_structured())
      return testing::AssertionFailure() << "is not JSON: " << document;
    if (read.is_object() && read.empty()) return testing::AssertionFailure() << "says nothing: " << document;
  }
  return testing::AssertionSuccess();
}

/// Whether a text has the form of all errors, on one line; `name`: of the error, or empty for any.
testing::AssertionResult isJsonError(const std::string& text, const std::string& name) {
  const json error = json::parse(text, nullptr, false);
  if (error.is_discarded() || std::ranges::count(text, '\n') != 1)
    return testing::AssertionFailure() << "is not one line of JSON: " << text;
  const bool has_form = error.is_object() && error.size() == 3 && error.contains("error") &&
                        error.contains("parameters") && error.contains("message");
  if (!has_form || (!name.empty() && error["error"] != name)) return testing::AssertionFailure() << text;
  return testing::AssertionSuccess();
}

TEST_F(EveryCommand, IsAmongTheCallsOfTheseTests) {
  const std::vector<Leaf> all = leaves();
  EXPECT_GT(all.size(), 40U);
  const std::vector<Command> made = calls();
  for (const Leaf& leaf : all) {
    const bool called = std::ranges::any_of(made, [&](const Command& call) {
      return call.size() >= leaf.path.size() && std::equal(leaf.path.begin(), leaf.path.end(), call.begin());
    });
    EXPECT_TRUE(called) << textOf(leaf.path);
  }
}

TEST_F(EveryCommand, AsJsonPrintsJsonThatSaysSomething) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["tick"]["pointsUsed"] == 100; }));
  for (Command call : calls()) {
    const std::string name = textOf(call);
    const bool may_fail = std::ranges::find(kFailing, call) != kFailing.end();
    call = complete(call);
    call.insert(call.begin(), "--json");
    const Finished finished = home.control(call);
    if (finished.ending == exitedWith(0) || (may_fail && !finished.output.empty())) {
      EXPECT_TRUE(isJson(finished.output, isStream({call[1]}))) << name;
      EXPECT_EQ(finished.errors, "") << name;
    } else {
      EXPECT_TRUE(may_fail) << name << ": " << finished.errors;
      EXPECT_EQ(finished.output, "") << name;
      EXPECT_TRUE(isJsonError(finished.errors, "")) << name;
    }
  }
}

TEST_F(EveryCommand, AsJsonSaysThatTheDaemonIsAbsentAndHowToStartIt) {
  for (const Call& call : kCalls) {
    Command command = complete(call.command);
    command.insert(command.begin(), "--json");
    const Finished finished = home.control(command);
    EXPECT_EQ(finished.ending, exitedWith(kNoConnection)) << textOf(command);
    EXPECT_TRUE(isJsonError(finished.errors, "NoConnection")) << textOf(command);
    EXPECT_TRUE(contains(finished.errors, "is hapticd running? Start it with 'systemctl start hapticd'"));
  }
}

TEST_F(EveryCommand, AsJsonSaysWhatIsWrongWithACommandLine) {
  for (const Leaf& leaf : leaves()) {
    Command command = leaf.path;
    command.insert(command.end(), {"--no-such-option", "--json"});
    const Finished finished = home.control(command);
    EXPECT_EQ(finished.ending, exitedWith(kUsage)) << textOf(command);
    EXPECT_EQ(finished.output, "") << textOf(command);
    EXPECT_TRUE(isJsonError(finished.errors, "WrongUsage")) << textOf(command);
  }
  for (const Command& command : {Command{}, {"nope"}, {"trace"}, {"trace", "nope"}, {"s"}, {"engag"}}) {
    Command words = command;
    words.emplace_back("--json");
    EXPECT_TRUE(isJsonError(home.control(words).errors, "WrongUsage")) << textOf(words);
  }
}

// --- the width of a terminal

/// The columns of a line, of UTF-8 text and with the sequences that a terminal does not show.
std::size_t columnsOf(const std::string& line) {
  std::size_t columns = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\033') {
      while (i < line.size() && (std::isalpha(static_cast<unsigned char>(line[i])) == 0)) ++i;
    } else if (line[i] != '\r' && (static_cast<unsigned char>(line[i]) & 0xc0U) != 0x80U) {
      ++columns;
    }
  }
  return columns;
}

/// The part of a line behind the last return of the carriage: what progress leaves is not seen.
std::string seen(std::string line) {
  while (line.ends_with('\r')) line.pop_back();
  const std::size_t back = line.rfind('\r');
  return back == std::string::npos ? line : line.substr(back + 1);
}

/// Commands whose text is for programs, which no line break may divide.
bool isForPrograms(const Command& command) {
  static const std::set<std::string> kVerbatim{"metrics", "completion", "view"};
  return kVerbatim.contains(command[0]) ||
         (command.size() > 1 && (command[1] == "export" || command[1] == "feed"));
}

TEST_F(EveryCommand, FitsATerminalOf80ColumnsAlsoWithLongNames) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status["tick"]["pointsUsed"] == 100; }));
  for (const Command& command :
       {Command{"fixture", "add", kLongName, "--kind", "sphere", "--position-m", "0,0,-0.8", "--radius-m",
                "0.05"},
        {"region", "add", kLongName, "--shape", "sphere", "--position-m", "0,0,-1", "--radius-m", "0.05"},
        {"save", kLongLabel},
        {"trace", "start", "--label", kLongLabel},
        {"trace", "stop"},
        {"trace", "note", "TRACE",
         "a note of many words, a note of many words, a note of many words, the end"}}) {
    const Finished finished = home.control(complete(command));
    ASSERT_EQ(finished.ending, exitedWith(0)) << textOf(command) << ": " << finished.errors;
  }
  std::vector<Command> shown{{"fixture", "show", kLongName}, {"region", "show", kLongName}};
  for (const Call& call : kCalls) {
    const bool waits = call.command[0] == "watch" || call.command[0] == "calibrate";
    if (call.does == Does::read && !waits && call.command.back() != "nerve" && call.command.back() != "liver")
      shown.push_back(call.command);
  }
  for (const auto* list : {&kWithoutDaemon, &kFailing}) shown.insert(shown.end(), list->begin(), list->end());
  shown.push_back({"trace", "info", "TRACE"});
  for (const Command& command : shown) {
    if (isForPrograms(command)) continue;
    TerminalProgram program(home.controlCommand(complete(command)),
                            {"PATH=/usr/bin:/bin", "TERM=xterm", "LANG=C.UTF-8"}, 40, 80);
    program.wait();
    std::istringstream lines(program.output());
    std::string text;
    for (std::string line; std::getline(lines, line);) {
      const std::string visible = seen(line);
      // a single word, such as a path, is not divided; and errors are left to the terminal
      const bool divisible = visible.find(' ', visible.find_first_not_of(' ')) != std::string::npos &&
                             !visible.starts_with("hapticctl: ");
      EXPECT_TRUE(columnsOf(visible) <= 80 || !divisible) << textOf(command) << ": " << visible;
      text += visible;
    }
    std::erase(text, ' ');
    const bool lists = command.size() > 1 && command[1] == "list" && command[0] != "camera" &&
                       command[0] != "handle" && command[0] != "frame";  // clients add none
    if (lists) {                                                         // divided by the width, but whole
      const std::string name = command[0] == "trace" ? kLongLabel : kLongName;
      EXPECT_NE(text.find(name), std::string::npos) << textOf(command) << ": " << program.output();
      const bool whole = command[0] != "trace" || text.find("theend") != std::string::npos;
      EXPECT_TRUE(whole) << program.output();
    }
  }
}

TEST_F(EveryCommand, HasAHelpThatFitsATerminalOf80ColumnsAndNamesTheExitStatus) {
  std::vector<Command> commands{{}, {"trace"}};
  for (const Leaf& leaf : leaves()) commands.push_back(leaf.path);
  for (Command command : commands) {
    const bool has_own_footer = !command.empty() && (command[0] == "camera" || command[0] == "handle");
    command.emplace_back("--help");
    const std::string text = home.control(command).output;
    EXPECT_TRUE(has_own_footer || contains(text, "Exit status: 0 done")) << textOf(command);
    std::istringstream help(text);
    for (std::string line; std::getline(help, line);) EXPECT_LE(line.size(), 80U) << line;
  }
}

// --- names that are shortened

/// The shortest beginning of a command's name that begins no other of its group; empty if there is none.
std::string shortest(const std::string& name, const std::set<std::string>& group) {
  for (std::size_t length = 1; length < name.size(); ++length) {
    const std::string beginning = name.substr(0, length);
    const auto begins = [&](const std::string& other) { return other.starts_with(beginning); };
    if (std::ranges::count_if(group, begins) == 1) return beginning;
  }
  return "";
}

TEST_F(EveryCommand, IsTakenFromTheBeginningOfItsNameOnlyIfNothingThatActsIsChanged) {
  static const std::set<std::string> kAct{"set",       "engage",   "disengage",   "clear-fault",
                                          "reload",    "load",     "save",        "profiles",
                                          "calibrate", "register", "trace delete"};
  static const std::set<std::string> kOfLists{"list", "show", "export"};
  const std::vector<Leaf> all = leaves();
  std::set<std::string> first, acting;
  for (const Leaf& leaf : all) first.insert(leaf.path[0]);
  for (const Leaf& leaf : all) {
    const bool is_addition = leaf.path[0] == "fixture" || leaf.path[0] == "region";
    if (is_addition) {
      EXPECT_EQ(leaf.may_be_shortened, kOfLists.contains(leaf.path[1])) << textOf(leaf.path);
    }
    if (kAct.contains(textOf(leaf.path))) {
      EXPECT_FALSE(leaf.may_be_shortened) << textOf(leaf.path);
      acting.insert(textOf(leaf.path));
    }
    Command typed = leaf.path;
    std::set<std::string> group = first;
    if (typed.size() > 1) {
      group.clear();
      for (const Leaf& other : all) {
        if (other.path[0] == leaf.path[0]) group.insert(other.path[1]);
      }
    }
    typed.back() = shortest(typed.back(), group);
    if (typed.back().empty()) continue;
    const std::string written = textOf(typed);
    typed.emplace_back("--help");
    const Finished finished = home.control(typed);
    if (leaf.may_be_shortened) {
      EXPECT_EQ(finished.ending, exitedWith(0)) << written << ": " << finished.errors;
      EXPECT_TRUE(contains(finished.output, "Usage: hapticctl " + textOf(leaf.path))) << written;
    } else {
      EXPECT_EQ(finished.ending, exitedWith(kUsage)) << written;
      EXPECT_TRUE(finished.errors.starts_with("hapticctl: '" + written + "' could be '" + textOf(leaf.path) +
                                              "', which "))
          << finished.errors;
      EXPECT_TRUE(contains(finished.errors, ": write it in full\n")) << finished.errors;
    }
  }
  EXPECT_EQ(acting, kAct);
}

}  // namespace
}  // namespace hapticd::test
