// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/interface_section.h"

#include <map>
#include <regex>
#include <sstream>
#include <utility>

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

config::Result<std::string> interfaceSection(std::string_view text) {
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
      return std::unexpected(config::Error{"line " + std::to_string(number),
                                           "is not of the form of our interface texts: " + line,
                                           "write an item or a field a line, and comments above it"});
    }
  }
  return head + roff_of["method"] + roff_of["error"] + roff_of["type"];
}

}  // namespace hapticd::tools
