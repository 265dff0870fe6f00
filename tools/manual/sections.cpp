// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/sections.h"

#include <fmt/format.h>

#include <cctype>
#include <cstddef>
#include <map>
#include <regex>
#include <sstream>
#include <utility>

#include "config/settings/parameter_table.h"
#include "tools/manual/roff.h"

namespace hapticd::tools {
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

}  // namespace hapticd::tools
