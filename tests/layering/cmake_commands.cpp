// SPDX-License-Identifier: Apache-2.0
#include "tests/layering/cmake_commands.h"

#include <cctype>
#include <cstddef>

namespace hapticd::test {
namespace {

bool isInName(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.' || c == '/';
}

/// Returns `text` with comments replaced by spaces.
std::string withoutComments(std::string_view text) {
  std::string plain(text);
  bool in_comment = false;
  for (char& c : plain) {
    if (c == '#') in_comment = true;
    if (c == '\n') in_comment = false;
    if (in_comment) c = ' ';
  }
  return plain;
}

class Reader {
 public:
  explicit Reader(std::string text) : text_(std::move(text)) {}

  bool atEnd() const { return at_ == text_.size(); }
  char peek() const { return text_[at_]; }
  void skip() { line_ += text_[at_++] == '\n' ? 1 : 0; }
  int line() const { return line_; }
  std::string name() {
    std::string name;
    for (; !atEnd() && isInName(peek()); skip()) name += peek();
    return name;
  }
  /// Reads the arguments, from the opening bracket to behind the closing one.
  std::vector<std::string> arguments() {
    std::vector<std::string> arguments;
    int depth = 0;
    while (!atEnd()) {
      if (isInName(peek())) {
        arguments.push_back(name());
        continue;
      }
      if (peek() == '(') ++depth;
      if (peek() == ')') --depth;
      skip();
      if (depth == 0) break;
    }
    return arguments;
  }

 private:
  std::string text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

}  // namespace

std::vector<CMakeCommand> cmakeCommands(std::string_view text) {
  std::vector<CMakeCommand> commands;
  Reader reader(withoutComments(text));
  while (!reader.atEnd()) {
    if (!isInName(reader.peek())) {
      reader.skip();
      continue;
    }
    CMakeCommand command;
    command.line = reader.line();
    command.name = reader.name();
    while (!reader.atEnd() && reader.peek() == ' ') reader.skip();
    if (reader.atEnd() || reader.peek() != '(') continue;
    command.arguments = reader.arguments();
    commands.push_back(std::move(command));
  }
  return commands;
}

}  // namespace hapticd::test
