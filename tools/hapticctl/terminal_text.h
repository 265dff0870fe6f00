// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

namespace hapticd::tools {

/// Columns that UTF-8 text takes on a terminal, one for each character.
std::size_t columnsOf(std::string_view text);

/// `text` cut to `columns`, with "..." in place of what is left out.
std::string cutTo(std::string text, std::size_t columns);

/// Lines of at most `columns`, broken at blanks where there are any; all but the first begin with `indent`.
std::string wrapped(const std::string& text, std::size_t columns, const std::string& indent);

enum class Colour { plain, red, yellow, green, dim };

/// `text` in a colour, as ANSI terminals understand it; unchanged when `on` is false.
std::string painted(const std::string& text, Colour colour, bool on);

/// Whether to colour. `when`: auto, always or never; auto: on a terminal that is not "dumb", unless NO_COLOR
/// is set (no-color.org).
bool wantsColours(std::string_view when);

/// Whether the environment's locale says that the terminal shows UTF-8.
bool showsUtf8();

struct TerminalSize {
  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();
  std::size_t columns = 80;
  std::size_t rows = 24;
};
/// Of the terminal that stdout is; 80x24 where it does not say. What goes to a file or a program is not cut.
TerminalSize terminalSize();

}  // namespace hapticd::tools
