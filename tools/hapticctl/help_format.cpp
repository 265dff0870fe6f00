// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/help_format.h"

#include <sstream>

#include "tools/hapticctl/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kColumns = 80;

std::string wrappedLines(const std::string& text, std::size_t columns) {
  std::istringstream lines(text);
  std::string all;
  for (std::string line; std::getline(lines, line);) {
    all += (all.empty() ? "" : "\n") + wrapped(line, columns, "");
  }
  return all;
}

/// "csv, recording" from "{csv,recording}".
std::string spaced(std::string words) {
  words = words.substr(1, words.size() - 2);
  for (std::size_t comma = 0; (comma = words.find(',', comma)) != std::string::npos; comma += 2) {
    words.insert(comma + 1, " ");
  }
  return words;
}

}  // namespace

std::string HelpFormatter::row(const std::string& name, const std::string& text) const {
  std::ostringstream out;
  CLI::detail::format_help(out, name, wrappedLines(text, kColumns - column_width_), column_width_);
  return out.str();
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  std::string name = make_option_name(option, is_positional) + make_option_opts(option);
  std::string text = make_option_desc(option);
  const std::size_t open = name.find(":{");
  const std::size_t close = name.find('}');
  if (2 + name.size() > kColumns && open != std::string::npos && close != std::string::npos) {
    text += ": " + spaced(name.substr(open + 1, close - open));
    name.erase(open, close + 1 - open);
  }
  return row(name, text);
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return row(command->get_display_name(true), command->get_description());
}

std::string HelpFormatter::make_footer(const CLI::App* command) const {
  const std::string footer = command->get_footer();
  return footer.empty() ? footer : wrappedLines(footer, kColumns) + "\n\n";
}

}  // namespace hapticd::tools
