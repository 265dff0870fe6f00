// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/page.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstddef>
#include <cstdio>
#include <map>
#include <regex>
#include <sstream>
#include <utility>

#include "config/settings/parameter_table.h"

namespace hapticd::tools {
namespace {

bool blankAt(std::string_view text, std::size_t place) {
  return place >= text.size() || std::isspace(static_cast<unsigned char>(text[place])) != 0;
}

}  // namespace

std::string plainRoff(std::string_view text) {
  std::string roff;
  bool line_begins = true;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char character = text[i];
    if (line_begins && (character == '.' || character == '\'')) roff += "\\&";
    line_begins = character == '\n';
    if (character == '\\' || character == '-') roff += '\\';
    roff += character == '\\' ? 'e' : character;
    // a list without blanks may break too
    if (character == ',' && !blankAt(text, i + 1)) roff += "\\:";
  }
  return roff;
}

std::string labelled(std::string_view label, std::string_view text) {
  return ".TP\n\\fB" + plainRoff(label) + "\\fR\n" + plainRoff(text) + "\n";
}

namespace {

constexpr std::size_t kTextColumn = 30;
constexpr std::string_view kUsage = "Usage: ";
constexpr std::string_view kExitStatus = "Exit status: ";

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(' ');
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

/// "build/bin/hapticd [OPTIONS]" without the folder.
std::string withoutFolder(const std::string& usage) {
  const std::size_t program_end = usage.find(' ');
  const std::size_t slash = usage.rfind('/', program_end);
  return slash == std::string::npos ? usage : usage.substr(slash + 1);
}

bool continuesAnEntry(const std::string& line) {
  return line.starts_with("  ") && line.find_first_not_of(' ') >= kTextColumn;
}

/// `next_line` distinguishes a short name with its text from a long name that has a blank where texts begin.
void addEntryLine(std::vector<HelpEntry>& entries, const std::string& line, const std::string& next_line) {
  if (continuesAnEntry(line)) {
    if (entries.empty()) return;
    std::string& text = entries.back().text;
    text += (text.empty() ? "" : " ") + trimmed(line);
    return;
  }
  const bool reaches_text = line.size() > kTextColumn && line[kTextColumn - 1] == ' ';
  const bool has_text = reaches_text && (line[kTextColumn - 2] == ' ' || !continuesAnEntry(next_line));
  if (!has_text) {
    entries.push_back({trimmed(line), {}});
    return;
  }
  entries.push_back({trimmed(line.substr(0, kTextColumn)), trimmed(line.substr(kTextColumn))});
}

std::vector<std::string> linesOf(std::string_view text) {
  std::vector<std::string> lines;
  std::istringstream stream{std::string(text)};
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Returns the text after the heading in line `first`, to the end of the sentence.
std::string sentenceFrom(const std::vector<std::string>& lines, std::size_t first) {
  std::string sentence = lines[first].substr(kExitStatus.size());
  for (std::size_t i = first + 1; i < lines.size() && !lines[i].empty() && !sentence.ends_with('.'); ++i) {
    sentence += " " + trimmed(lines[i]);
  }
  return sentence;
}

/// "0 done, 64 usage." split: a comma that a number follows begins the next one.
std::vector<HelpEntry> exitStatuses(std::string list) {
  if (list.ends_with('.')) list.pop_back();
  std::vector<HelpEntry> statuses;
  std::istringstream parts(list);
  for (std::string part; std::getline(parts, part, ',');) {
    part = trimmed(part);
    const std::size_t blank = part.find(' ');
    if (!part.empty() && std::isdigit(static_cast<unsigned char>(part.front())) &&
        blank != std::string::npos) {
      statuses.push_back({part.substr(0, blank), part.substr(blank + 1)});
    } else if (!statuses.empty()) {
      statuses.back().text += ", " + part;
    }
  }
  return statuses;
}

/// The list that a heading opens, or null for other lines.
std::vector<HelpEntry>* sectionOf(HelpText& help, const std::string& heading) {
  if (heading == "Positionals:") return &help.arguments;
  if (heading == "Options:") return &help.options;
  if (heading == "Subcommands:") return &help.commands;
  return nullptr;
}

}  // namespace

HelpText parseHelp(std::string_view printed) {
  HelpText help;
  std::vector<HelpEntry>* section = nullptr;
  const std::vector<std::string> lines = linesOf(printed);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string& line = lines[i];
    if (line.starts_with(kUsage)) help.usage = withoutFolder(line.substr(kUsage.size()));
    if (line.starts_with(kExitStatus)) help.exit_statuses = exitStatuses(sentenceFrom(lines, i));
    const bool entry = line.starts_with("  ");
    if (!entry) section = sectionOf(help, line);
    if (entry && section != nullptr) addEntryLine(*section, line, i + 1 < lines.size() ? lines[i + 1] : "");
  }
  return help;
}

namespace {

const std::regex kComment(" *#+ *(.*)");
const std::regex kInterface("interface (.+)");
const std::regex kItem(R"((type|error|method) (\w+) ?\((.*))");
const std::regex kAnswers(R"(\) -> \((.*))");
const std::regex kField(R"( +(\w+): (.+?),?)");

std::string paragraph(const std::string& text) {
  return text.empty() ? "" : ".PP\n" + plainRoff(text) + "\n";
}

/// `behind`: what stands behind the bracket that opens the list.
std::string listHead(const std::string& what, const std::string& behind) {
  return paragraph(what + (behind.starts_with(')') ? " nothing." : ":"));
}

/// The lines below a heading that stand in the same line of the interface.
std::string itemHead(const std::string& kind, const std::string& behind) {
  if (kind != "method") {
    const std::string words = behind.substr(0, behind.find(')'));
    return words.empty() ? "" : paragraph("One of: " + words + ".");
  }
  std::smatch answers;
  const bool has_answers = std::regex_match(behind, answers, kAnswers);
  return listHead("Takes", behind) + (has_answers ? listHead("Answers", answers[1]) : "");
}

}  // namespace

base::Result<std::string> interfaceSection(std::string_view text) {
  std::string head;
  std::map<std::string, std::string> roff_of;  // by the kind of item
  std::string* roff = nullptr;                 // of the item that is open
  std::string comment;
  std::istringstream lines{std::string(text)};
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::smatch part;
    if (line.empty() || line == ")") continue;
    if (std::regex_match(line, part, kComment)) {
      comment += (comment.empty() ? "" : " ") + part[1].str();
      continue;
    }
    const std::string above = std::exchange(comment, {});
    if (std::regex_match(line, part, kInterface)) {
      head = ".SH \"" + plainRoff(part[1].str()) + "\"\n" + paragraph(above);
    } else if (std::regex_match(line, part, kItem)) {
      roff = &roff_of[part[1]];
      *roff += ".SS " + plainRoff(part[1].str() + " " + part[2].str()) + "\n" + paragraph(above) +
               itemHead(part[1], part[3]);
    } else if (roff != nullptr && std::regex_match(line, part, kAnswers)) {
      *roff += listHead("Answers", part[1]);
    } else if (roff != nullptr && std::regex_match(line, part, kField)) {
      *roff += labelled(part[1].str() + ": " + part[2].str(), above.empty() ? "See above." : above + ".");
    } else {
      return std::unexpected(base::Error{"line " + std::to_string(number),
                                         "is not of the form of our interface texts: " + line,
                                         "write an item or a field a line, and comments above it"});
    }
  }
  return head + roff_of["method"] + roff_of["error"] + roff_of["type"];
}

namespace {

std::string sentence(std::string_view text) {
  std::string capital(text);
  capital.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(capital.front())));
  return capital + ".";
}

/// Which values are looser; empty: the parameter is no limit.
std::string looserValues(const config::Parameter& parameter) {
  const bool higher = parameter.looser != config::Looser::lower;
  if (parameter.looser == config::Looser::never) return "";
  if (parameter.kind == config::Kind::boolean) return higher ? "true" : "false";
  if (parameter.kind == config::Kind::choice) return higher ? "later words" : "earlier words";
  if (parameter.looser == config::Looser::higher_or_zero) return "higher values, and 0";
  return higher ? "higher values" : "lower values";
}

std::string paragraph(const config::Parameter& parameter) {
  std::string text = sentence(parameter.help);
  if (!parameter.symbol.empty()) text += " In the paper: " + std::string(parameter.symbol) + ".";
  const std::string value = config::toText(parameter.defaultValue());
  text += "\nAllowed: " + parameter.range() + ". Default: " + (value.empty() ? "empty" : value) + ".";
  if (parameter.effect == config::Effect::live) text += " Live.";
  if (const std::string looser = looserValues(parameter); !looser.empty()) text += " Looser: " + looser + ".";
  for (std::size_t i = 0; i < parameter.choice_help.size(); ++i)
    text += fmt::format("\n{}: {}.", parameter.choices[i], parameter.choice_help[i]);
  return labelled(parameter.name, text);
}

}  // namespace

std::string parameterSection() {
  std::string section;
  std::string_view group;
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (parameter.group() != group) section += ".SS " + plainRoff(parameter.group()) + "\n";
    group = parameter.group();
    section += paragraph(parameter);
  }
  return section;
}

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
  if (help.usage.empty()) return std::unexpected(Error{line, "shows no usage", "see page.cpp"});
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
