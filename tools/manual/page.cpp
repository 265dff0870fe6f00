// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/page.h"

#include <array>
#include <cstdio>
#include <sstream>

#include "tools/manual/help_text.h"
#include "tools/manual/roff.h"
#include "tools/manual/sections.h"

namespace hapticd::tools {
namespace {

using base::Error;
using base::Result;

/// Returns the help of `program`, or of its subcommand `command`.
Result<HelpText> helpOf(const std::string& program, const std::string& command) {
  const std::string line = "'" + program + "' " + command + " --help";
  std::FILE* const pipe = ::popen(line.c_str(), "r");
  if (pipe == nullptr) return std::unexpected(Error{line, "cannot be started", "build the program"});
  std::string printed;
  std::array<char, 4096> buffer{};
  while (const std::size_t bytes = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
    printed.append(buffer.data(), bytes);
  }
  if (::pclose(pipe) != 0) return std::unexpected(Error{line, "failed", "run it to see why"});
  HelpText help = parseHelp(printed);
  if (help.usage.empty()) return std::unexpected(Error{line, "shows no usage", "see help_text.cpp"});
  return help;
}

std::string entries(const std::vector<HelpEntry>& list) {
  std::string roff;
  for (const HelpEntry& entry : list) roff += labelled(entry.name, entry.text);
  return roff;
}

std::string synopsis(const HelpText& help) {
  const std::size_t name_end = help.usage.find(' ');
  const std::string name = help.usage.substr(0, name_end);
  const std::string rest = name_end == std::string::npos ? "" : help.usage.substr(name_end);
  return "\\fB" + plainRoff(name) + "\\fR" + plainRoff(rest) + "\n";
}

/// The options of a subcommand that not every one of them has.
std::vector<HelpEntry> ownOptions(const HelpText& help) {
  std::vector<HelpEntry> own;
  for (const HelpEntry& option : help.options) {
    if (option.name.find("--help") == std::string::npos) own.push_back(option);
  }
  return own;
}

/// A section for each of a program's commands, and for those below them. `above`: "trace " in front of its
/// own.
Result<std::string> commandSections(const std::string& program, const HelpText& help,
                                    const std::string& above) {
  std::string roff;
  for (const HelpEntry& command : help.commands) {
    const std::string name = above + command.name;
    const Result<HelpText> own = helpOf(program, name);
    if (!own) return std::unexpected(own.error());
    const Result<std::string> below = commandSections(program, *own, name + " ");
    if (!below) return below;
    roff += ".SS " + plainRoff(name) + "\n" + synopsis(*own) + ".PP\n" + plainRoff(command.text) + "\n" +
            entries(own->arguments) + entries(ownOptions(*own)) + *below;
  }
  return roff;
}

Result<std::string> interfaceSections(const std::vector<std::string>& texts) {
  std::string roff;
  for (const std::string& text : texts) {
    const Result<std::string> section = interfaceSection(text);
    if (!section) return section;
    roff += *section;
  }
  return roff;
}

/// The roff that stands for a placeholder line; the line itself where it is none.
Result<std::string> filled(const std::string& line, const PageSource& source, const HelpText& help) {
  if (line == "@PARAMETERS@") return parameterSection();
  if (line == "@INTERFACES@") return interfaceSections(source.interfaces);
  if (line == "@SYNOPSIS@") return synopsis(help);
  if (line == "@OPTIONS@") return entries(help.arguments) + entries(help.options);
  if (line == "@EXIT_STATUS@") return entries(help.exit_statuses);
  if (line == "@COMMANDS@") return commandSections(source.program, help, "");
  return line + "\n";
}

std::string withVersion(std::string line, const std::string& version) {
  constexpr std::string_view kMark = "@VERSION@";
  const std::size_t place = line.find(kMark);
  return place == std::string::npos ? line : line.replace(place, kMark.size(), version);
}

}  // namespace

Result<std::string> manualPage(const PageSource& source) {
  Result<HelpText> help = HelpText{};
  if (!source.program.empty()) help = helpOf(source.program, "");
  if (!help) return std::unexpected(help.error());
  std::string page;
  std::istringstream lines(source.template_text);
  for (std::string line; std::getline(lines, line);) {
    const Result<std::string> roff = filled(withVersion(line, source.version), source, *help);
    if (!roff) return std::unexpected(roff.error());
    if (roff->empty()) {
      return std::unexpected(
          Error{line, "stands for nothing", "give --program or --interface, or take the line out"});
    }
    page += *roff;
  }
  return page;
}

}  // namespace hapticd::tools
