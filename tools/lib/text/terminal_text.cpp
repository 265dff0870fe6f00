// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/text/terminal_text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>

namespace hapticd::tools {
namespace {

bool continuesACharacter(char byte) {
  return (static_cast<unsigned char>(byte) & 0xc0U) == 0x80U;
}

/// Bytes of the first `columns` characters.
std::size_t bytesOf(std::string_view text, std::size_t columns) {
  std::size_t end = 0;
  for (std::size_t column = 0; end < text.size() && column < columns; ++column) {
    do ++end;
    while (end < text.size() && continuesACharacter(text[end]));
  }
  return end;
}

std::string withoutBlanksAtTheEnd(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string_view() : value;
}

}  // namespace

std::size_t columnsOf(std::string_view text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char byte) { return !continuesACharacter(byte); }));
}

std::string cutTo(std::string text, std::size_t columns) {
  constexpr std::string_view kMore = "...";
  if (columnsOf(text) <= columns) return text;
  if (columns <= kMore.size()) return text.substr(0, bytesOf(text, columns));
  return text.substr(0, bytesOf(text, columns - kMore.size())) + std::string(kMore);
}

std::string wrapped(const std::string& text, std::size_t columns, const std::string& indent) {
  std::string lines;
  std::string_view rest = text;
  for (std::size_t room = columns; columnsOf(rest) > room; room = columns - indent.size()) {
    const std::size_t most = bytesOf(rest, room);
    const std::size_t blank = rest.rfind(' ', most);
    const bool breaks = blank != std::string_view::npos && blank > 0;
    lines += std::string(rest.substr(0, breaks ? blank : most)) + "\n" + indent;
    rest.remove_prefix(breaks ? blank + 1 : most);
  }
  return lines + std::string(rest);
}

namespace {

/// Where the value of a line like "name   value" begins; 0 where it has another form.
std::size_t valueColumn(std::string_view line) {
  const std::size_t name = line.find_first_not_of(' ');
  const std::size_t gap = line.find("  ", std::min(name, line.size()));
  const std::size_t value = gap == std::string_view::npos ? gap : line.find_first_not_of(' ', gap);
  return value == std::string_view::npos ? 0 : columnsOf(line.substr(0, value));
}

/// A line of more than `columns`, divided at blanks.
std::string divided(std::string_view line, std::size_t columns) {
  constexpr std::size_t kFewColumns = 4;
  constexpr std::size_t kFewestForText = 24;
  const std::size_t value = valueColumn(line);
  const bool below = value > 0 && value + kFewestForText <= columns;
  const std::string indent(below ? value : std::min(kFewColumns, columns / kFewColumns), ' ');
  std::string lines;
  std::size_t first = line.find_first_not_of(' ');  // no line ends before its first word
  while (columnsOf(line) + (lines.empty() ? 0 : indent.size()) > columns) {
    const std::size_t most = bytesOf(line, columns - (lines.empty() ? 0 : indent.size()));
    std::size_t blank = line.rfind(' ', most);
    if (blank == std::string_view::npos || blank <= first) blank = line.find(' ', first);
    if (blank == std::string_view::npos) break;
    lines += (lines.empty() ? "" : indent) + withoutBlanksAtTheEnd(std::string(line.substr(0, blank))) + "\n";
    line.remove_prefix(std::min(line.find_first_not_of(' ', blank), line.size()));
    first = 0;
  }
  return lines + (lines.empty() ? "" : indent) + std::string(line);
}

}  // namespace

std::string fitted(const std::string& text, std::size_t columns) {
  if (columns == TerminalSize::kNoLimit) return text;
  std::string lines;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    lines += columnsOf(line) > columns ? divided(line, columns) : std::string(line);
    if (end < rest.size()) lines += '\n';
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return lines;
}

std::string painted(const std::string& text, Colour colour, bool on) {
  if (!on || colour == Colour::plain) return text;
  const char* code = colour == Colour::red      ? "31"
                     : colour == Colour::yellow ? "33"
                     : colour == Colour::green  ? "32"
                                                : "2";
  return std::string("\033[") + code + "m" + text + "\033[0m";
}

bool isScreen(int descriptor) {
  return ::isatty(descriptor) == 1 && environment("TERM") != "dumb";
}

bool wantsColours(std::string_view when) {
  if (when != "auto") return when == "always";
  return isScreen(STDOUT_FILENO) && environment("NO_COLOR").empty();
}

bool showsUtf8() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    std::string locale(environment(name));
    if (locale.empty()) continue;
    std::ranges::transform(locale, locale.begin(), [](unsigned char c) { return std::tolower(c); });
    return locale.find("utf-8") != std::string::npos || locale.find("utf8") != std::string::npos;
  }
  return false;
}

TerminalSize terminalSize() {
  if (::isatty(STDOUT_FILENO) != 1) return {TerminalSize::kNoLimit, TerminalSize::kNoLimit};
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {size.ws_col, size.ws_row};
}

namespace {

constexpr std::size_t kGap = 2;
/// A last column narrower than this would hold hardly more than one word a line.
constexpr std::size_t kNarrowestText = 24;
const std::string kIndentBelow(4, ' ');

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::string blanks(width - std::min(columnsOf(text), width), ' ');
  return right ? blanks + text : text + blanks;
}

}  // namespace

std::size_t Table::widthOf(std::size_t column) const {
  std::size_t width = columnsOf(columns_[column].title);
  for (const Cells& row : rows_) width = std::max(width, columnsOf(row[column]));
  return width;
}

std::string Table::text(std::size_t columns) const {
  std::vector<std::size_t> all_widths;  // except the last one's, whose cells end their line
  for (std::size_t i = 0; i + 1 < columns_.size(); ++i) all_widths.push_back(widthOf(i));
  const std::size_t last_width = columns_.back().right ? widthOf(columns_.size() - 1) : 0;
  std::size_t before = 0;  // the last column
  for (const std::size_t width : all_widths) before += width + kGap;
  const bool unlimited = columns == TerminalSize::kNoLimit;
  const bool beside = unlimited || before + kNarrowestText <= columns;
  const bool aligned = unlimited || before <= columns;

  const auto lineOf = [&](const Cells& cells) {
    std::string line;
    for (std::size_t i = 0; i < all_widths.size(); ++i) {
      line += padded(cells[i], aligned ? all_widths[i] : 0, columns_[i].right) + std::string(kGap, ' ');
    }
    if (unlimited) return withoutBlanksAtTheEnd(line + padded(cells.back(), last_width, true));
    if (beside && !cells.back().empty()) {
      return wrapped(line + cells.back(), columns, std::string(before, ' '));
    }
    line = wrapped(withoutBlanksAtTheEnd(line), columns, kIndentBelow);
    if (!beside && !cells.back().empty()) {
      line += "\n" + wrapped(kIndentBelow + cells.back(), columns, kIndentBelow);
    }
    return line;
  };

  Cells titles;
  for (const Column& column : columns_) titles.push_back(column.title);
  std::string text = lineOf(titles) + "\n";
  for (const Cells& row : rows_) text += lineOf(row) + "\n";
  return text;
}

namespace {

struct Unit {
  std::string_view name;
  double seconds;
};
constexpr std::array<Unit, 6> kUnits{
    {{"s", 1}, {"min", 60}, {"m", 60}, {"h", 3600}, {"d", 86400}, {"w", 7 * 86400}}};
constexpr double kNsPerSecond = 1e9;
/// Ages beyond that leave the range of a 64-bit time in nanoseconds.
constexpr double kMaxAge_s = 9e9;

std::tm utcOf(std::int64_t seconds) {
  return fmt::gmtime(static_cast<std::time_t>(seconds));
}

}  // namespace

std::string utcTime(double realtime_ns) {
  if (std::isnan(realtime_ns)) return "-";
  return fmt::format("{:%Y-%m-%d %H:%M:%S}Z", utcOf(static_cast<std::int64_t>(realtime_ns / kNsPerSecond)));
}

std::string utcTimeWithMilliseconds(double realtime_ns) {
  if (std::isnan(realtime_ns)) return "-";
  const auto milliseconds = static_cast<std::int64_t>(realtime_ns / 1e6);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03}Z", utcOf(milliseconds / 1000), milliseconds % 1000);
}

std::string ageText(double seconds) {
  if (std::isnan(seconds)) return "-";
  const double age_s = std::fmax(seconds, 0);
  if (age_s < 120) return fmt::format("{:.0f} s", std::floor(age_s));
  if (age_s < 2 * 3600) return fmt::format("{:.0f} min", std::floor(age_s / 60));
  if (age_s < 2 * 86400) return fmt::format("{:.0f} h", std::floor(age_s / 3600));
  return fmt::format("{:.0f} d", std::floor(age_s / 86400));
}

std::optional<double> secondsOfAge(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || !(number >= 0)) return std::nullopt;
  const std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  for (const auto& [name, seconds] : kUnits) {
    if (unit == name && number * seconds <= kMaxAge_s) return number * seconds;
  }
  return std::nullopt;
}

std::optional<std::int64_t> timeFrom(std::string_view text, std::int64_t now_ns) {
  if (const auto age_s = secondsOfAge(text)) {
    return now_ns - static_cast<std::int64_t>(*age_s * kNsPerSecond);
  }
  const std::string time(text);
  for (const char* form :
       {"%Y-%m-%dT%H:%M:%SZ", "%Y-%m-%d %H:%M:%SZ", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%d %H:%M:%S",
        "%Y-%m-%dT%H:%M", "%Y-%m-%d %H:%M", "%Y-%m-%dT%H-%M-%SZ", "%Y-%m-%d"}) {
    std::tm utc{};
    const char* const end = ::strptime(time.c_str(), form, &utc);
    // before 1900 and after 2200 the nanoseconds would not fit into 64 bits
    if (end != nullptr && *end == '\0' && utc.tm_year >= 0 && utc.tm_year < 300) {
      return std::int64_t{::timegm(&utc)} * static_cast<std::int64_t>(kNsPerSecond);
    }
  }
  return std::nullopt;
}

std::int64_t realtimeNow_ns() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count();
}

}  // namespace hapticd::tools
