// SPDX-License-Identifier: Apache-2.0
#include "tests/system/support/shell.h"

#include <fmt/format.h>

#include <regex>
#include <sstream>

namespace hapticd::test {
namespace {

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

}  // namespace

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

}  // namespace hapticd::test
