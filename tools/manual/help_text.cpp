// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/help_text.h"

#include <cctype>
#include <sstream>

namespace hapticd::tools {
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

}  // namespace hapticd::tools
