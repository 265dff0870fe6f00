// SPDX-License-Identifier: Apache-2.0
#include "tests/support/golden_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <vector>

namespace hapticd::test {
namespace {

std::string unescaped(const std::string& line) {
  std::string text;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] != '\\') {
      text += line[i];
      continue;
    }
    switch (line.at(++i)) {
      case 'n':
        text += '\n';
        break;
      case 'r':
        text += '\r';
        break;
      case 't':
        text += '\t';
        break;
      case 'x':
        text += static_cast<char>(std::stoi(line.substr(i + 1, 2), nullptr, 16));
        i += 2;
        break;
      default:
        text += line[i];
    }
  }
  return text;
}

struct GoldenCase {
  std::string heading;
  std::string input;   ///< as written
  std::string answer;  ///< with the end of its last line
};

}  // namespace

void expectGolden(const std::string& path,
                  const std::function<std::string(const std::string& input)>& answer) {
  std::ifstream file(path);
  std::string comment;
  std::vector<GoldenCase> cases;
  std::string* part = &comment;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("==== ")) {
      part = &cases.emplace_back(line, "", "").input;
    } else if (line == "----" && !cases.empty() && part == &cases.back().input) {
      part = &cases.back().answer;
    } else if (!line.empty() || cases.empty() || part == &cases.back().input) {
      *part += line + "\n";
    }
  }
  ASSERT_FALSE(cases.empty()) << path << " holds no case";
  std::string updated = comment;
  for (const auto& [heading, input, expected] : cases) {
    const bool escaped = heading.ends_with(" escaped");
    const std::string found = answer(escaped ? unescaped(input.substr(0, input.find('\n'))) : input);
    EXPECT_EQ(found, expected) << path << ": " << heading;
    updated += heading + "\n" + input + "----\n" + found + "\n";
  }
  updated.pop_back();
  if (std::getenv("HAPTICD_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << updated;
}

namespace {

std::string withoutEmptyLines(const std::string& text) {
  std::istringstream lines(text);
  std::string kept;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) kept += line + "\n";
  }
  return kept;
}

}  // namespace

void expectTranscript(const std::string& path,
                      const std::function<std::string(const std::string& command)>& answer) {
  std::ifstream file(path);
  std::string command, expected, updated;
  int commands = 0;
  const auto finish = [&] {
    if (command.empty()) return;
    const std::string found = withoutEmptyLines(answer(command));
    EXPECT_EQ(found, expected) << path << ": $ " << command;
    updated += found;
    command.clear();
    expected.clear();
    ++commands;
  };
  for (std::string line; std::getline(file, line);) {
    const bool goes_on = !command.empty() && expected.empty() && line.starts_with("> ");
    const bool answers = !command.empty() && !line.empty() && !line.starts_with("$ ");
    if (goes_on) {
      command += "\n" + line.substr(2);
    } else if (answers) {
      expected += line + "\n";
      continue;
    } else {
      finish();
      if (line.starts_with("$ ")) command = line.substr(2);
    }
    updated += line + "\n";
  }
  finish();
  EXPECT_GT(commands, 0) << path << " holds no command";
  if (std::getenv("HAPTICD_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << updated;
}

}  // namespace hapticd::test
