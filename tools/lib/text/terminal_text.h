// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::tools {

/// The columns that UTF-8 text takes on a terminal, counted as one for each character.
std::size_t columnsOf(std::string_view text);

/// `text` cut to `columns`, with "..." in place of what is left out.
std::string cutTo(std::string text, std::size_t columns);

/// Wraps a text into lines of at most `columns`, at blanks if possible; all lines but the first begin with
/// `indent`.
std::string wrapped(const std::string& text, std::size_t columns, const std::string& indent);

/// Wraps those lines of a text that are longer than `columns` at blanks; what follows begins below the value
/// of a line like "name   value", else a few columns in. A word that is longer than a line is not divided, so
/// that it can be copied. Lines that fit stay as they are. columns: TerminalSize::kNoLimit: as it is.
std::string fitted(const std::string& text, std::size_t columns);

enum class Colour { plain, red, yellow, green, dim };

/// `text` in a colour, as ANSI terminals understand it; unchanged when `on` is false.
std::string painted(const std::string& text, Colour colour, bool on);

/// Whether `descriptor` is a terminal that understands control sequences: $TERM is not "dumb".
bool isScreen(int descriptor);

/// Whether to use colours. `when`: auto, always or never; auto: if stdout isScreen(), unless NO_COLOR is set
/// (no-color.org).
bool wantsColours(std::string_view when);

/// Whether the locale of the environment uses UTF-8.
bool showsUtf8();

struct TerminalSize {
  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();
  std::size_t columns = 80;
  std::size_t rows = 24;
};
/// The size of the terminal on stdout; 80x24 if it is not known; no limit if stdout is a file or a pipe.
TerminalSize terminalSize();

/// A table for people: a header, and columns as wide as their cells. On a terminal it is fitted to the width:
/// the last column, which holds text, is wrapped within what the others leave, or is on lines of its own
/// below its row where they leave too little. Nothing is ever cut, because names and values are copied from
/// tables.
class Table {
 public:
  struct Column {
    std::string title;
    bool right = false;  ///< for numbers, which are aligned to the right of their column
  };

  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /// Adds a row with as many cells as there are columns.
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }

  /// The lines, each with its end. columns: of the terminal; TerminalSize::kNoLimit: each row in one line.
  std::string text(std::size_t columns) const;

 private:
  using Cells = std::vector<std::string>;
  std::size_t widthOf(std::size_t column) const;

  std::vector<Column> columns_;
  std::vector<Cells> rows_;
};

// hapticctl shows all times in UTC, as the names of traces do: a trace, its list entry and its events then
// carry the same time on every computer that they are copied to.

/// "2026-03-04 05:06:07Z"; "-" for NaN. realtime_ns: CLOCK_REALTIME.
std::string utcTime(double realtime_ns);

/// "2026-03-04 05:06:07.123Z"; "-" for NaN. realtime_ns: CLOCK_REALTIME.
std::string utcTimeWithMilliseconds(double realtime_ns);

/// "45 s", "12 min", "5 h", "30 d": how long something lasts or ago it was, in the largest unit that it fills
/// twice; "-" for NaN. A time in the future is 0 s ago.
std::string ageText(double seconds);

/// The seconds that "90s", "45min", "12h", "30d" or "2w" stands for; nothing where the text is no age.
std::optional<double> secondsOfAge(std::string_view text);

/// CLOCK_REALTIME, in nanoseconds, of a date and time in UTC ("2026-03-04", "2026-03-04 05:06",
/// "2026-03-04T05:06:07Z") or of an age before now_ns ("12h"); nothing where the text is neither.
std::optional<std::int64_t> timeFrom(std::string_view text, std::int64_t now_ns);

/// CLOCK_REALTIME now.
std::int64_t realtimeNow_ns();

}  // namespace hapticd::tools
