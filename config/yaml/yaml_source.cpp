// SPDX-License-Identifier: Apache-2.0
#include "config/yaml/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

constexpr std::string_view kBlanks = " \t\r";
// Characters that may follow a backslash in double quotes (YAML 1.2, 5.7), except the end of the line.
constexpr std::string_view kEscapes = "0abtnvfe \"/\\N_LPxuU";

/// Walks through the text from scalar to scalar.
class SourceWalk {
 public:
  SourceWalk(std::string_view text, std::span<const SourceScalar> scalars) : text_(text), scalars_(scalars) {}

  std::optional<YamlProblem> run(bool complete) {
    bool was_in_list = false;
    for (const SourceScalar& scalar : scalars_) {
      if (scalar.at < at_ || scalar.at >= text_.size()) return notUnderstood();
      in_list_ = was_in_list || scalar.in_list;
      if (!passTo(scalar.at) || !pass(scalar)) return problem_;
      was_in_list = scalar.in_list;
    }
    in_list_ = was_in_list;
    if (!complete) return std::nullopt;
    if (!passTo(text_.size())) return problem_;
    if (has_version_ && !begun_) {
      fail("a line `---` is missing after the version", "write it below %YAML, or remove the version");
      return problem_;
    }
    return std::nullopt;
  }

 private:
  char current() const { return at_ < text_.size() ? text_[at_] : '\n'; }
  char before() const { return at_ > 0 ? text_[at_ - 1] : '\n'; }
  std::string_view restOfLine() const { return text_.substr(at_, text_.find('\n', at_) - at_); }

  bool fail(std::string what, std::string remedy) {
    const auto line = 1 + std::ranges::count(text_.substr(0, at_), '\n');
    problem_ = {static_cast<int>(line), "", std::move(what), std::move(remedy)};
    return false;
  }
  bool failHere() {
    return fail(fmt::format("{} is not understood here", base::inQuotes(restOfLine())),
                "check the quotes, brackets and indentation of this line and the one above");
  }
  YamlProblem notUnderstood() {
    failHere();
    return problem_;
  }

  /// Skips what is allowed between two scalars.
  bool passTo(std::size_t end) {
    while (at_ < end) {
      if (current() == '#') {
        if (kBlanks.find(before()) == std::string_view::npos && before() != '\n') return failHere();
        at_ += restOfLine().size();
        if (at_ > end) return fail("a comment was parsed as a value", "put the value in quotes");
      } else if (before() == '\n' && isMarker()) {
        at_ += restOfLine().starts_with("%") ? restOfLine().size() : 3;
      } else if ((current() == '{' || (in_list_ && current() == '[')) && !mayBeginValue() &&
                 !isIndentedGroup()) {
        return failValueElsewhere();
      } else if (in_list_ && isDash()) {
        behind_name_ = true;
        ++at_;
      } else if (!passSign() && !passNull()) {
        return failHere();
      }
    }
    return true;
  }

  /// Recognises the beginning and end of a document, and the version before it.
  bool isMarker() {
    const std::string_view line = restOfLine();
    const bool ends_here = line.size() == 3 || (line.size() > 3 && kBlanks.contains(line[3]));
    if (line.starts_with("%YAML 1.1") || line.starts_with("%YAML 1.2")) {
      has_version_ = at_ == 0 && line.find_first_not_of(kBlanks, 9) == std::string_view::npos;
      return has_version_;
    }
    if (line.starts_with("---") && ends_here) return !std::exchange(begun_, true);
    return line.starts_with("...") && ends_here;
  }

  bool passSign() {
    const char sign = current();
    if (!in_list_ && (sign == '[' || sign == ']')) return false;
    if (sign == '{' || sign == '[') {
      ++depth_;
      name_column_.reset();
    }
    if ((sign == '}' || sign == ']') && --depth_ < 0) return false;
    if (sign == ',' && depth_ == 0) return false;
    constexpr std::string_view kSigns = " \t\r\n{}[],~";
    if (!kSigns.contains(sign)) return false;
    if (sign == '\n') behind_name_ = false;
    ++at_;
    return true;
  }

  /// Skips a word that the parser reads as no value, as it does '~'.
  bool passNull() {
    if (!(kBlanks.contains(before()) || std::string_view("\n:,[{").contains(before()))) return false;
    const std::string_view rest = restOfLine();
    const std::string_view word = rest.substr(0, 4);
    if (word != "null" && word != "Null" && word != "NULL") return false;
    if (rest.size() > 4 && !kBlanks.contains(rest[4]) && !std::string_view(",]}").contains(rest[4]))
      return false;
    at_ += word.size();
    return true;
  }

  /// Recognises the mark of an item of a list.
  bool isDash() const {
    if (depth_ > 0 || !restOfLine().starts_with('-')) return false;
    if (restOfLine().size() > 1 && !kBlanks.contains(restOfLine()[1])) return false;
    const std::string_view before_it = text_.substr(at_ - column(), column());
    return before_it.find_first_not_of(" -") == std::string_view::npos;
  }

  std::size_t column() const {
    const std::size_t break_at = text_.substr(0, at_).rfind('\n');
    return break_at == std::string_view::npos ? at_ : at_ - break_at - 1;
  }

  /// Entries of a group in braces below its name: all readers accept them if they are indented.
  bool isIndentedGroup() const { return name_column_ && column() > *name_column_; }

  /// Readers differ in the indentation that they require for values on another line than their name.
  bool mayBeginValue() const { return depth_ > 0 || behind_name_ || !in_entries_; }
  bool failValueElsewhere() {
    return fail("the value is not on the line of its name", "write it as `name: value`");
  }

  bool pass(const SourceScalar& scalar) {
    const char first = current();
    if (first == '|' || first == '>') {
      return fail("text over several lines is not supported", "write the value on one line");
    }
    if (!scalar.name && !mayBeginValue()) return failValueElsewhere();
    in_entries_ = true;
    behind_name_ = scalar.name;
    name_column_ = scalar.name && depth_ == 0 ? std::optional(column()) : std::nullopt;
    const bool quoted = first == '"' || first == '\'';
    if (!(quoted ? passQuoted(first) : passPlain(scalar.value))) return false;
    return scalar.name ? passColon(quoted) : isEndOfValue() || failHere();
  }

  bool isEndOfValue() const {
    return current() == '\n' || current() == ',' || current() == '}' || (in_list_ && current() == ']') ||
           kBlanks.contains(current());
  }

  bool passColon(bool quoted) {
    at_ = std::min(text_.find_first_not_of(kBlanks, at_), text_.size());
    if (current() != ':') return fail("a colon is missing after the name", "write `name: value`");
    ++at_;
    const bool as_in_json = quoted && depth_ > 0;
    return as_in_json || current() == '\n' || kBlanks.contains(current()) || failHere();
  }

  bool passQuoted(char quote) {
    const std::string_view line = restOfLine();
    std::size_t length = 1;
    while (length < line.size() && line[length] != quote) {
      const bool escapes = quote == '"' && line[length] == '\\' && length + 1 < line.size();
      if (escapes && !kEscapes.contains(line[length + 1])) {
        return fail(fmt::format("{} is not a valid escape sequence", base::inQuotes(line.substr(length, 2))),
                    "write \\\\ for a backslash");
      }
      length += escapes ? 2 : 1;
    }
    if (length >= line.size()) {
      return fail(
          fmt::format("the quote before {} is not closed on its line", base::inQuotes(line.substr(1))),
          fmt::format("close it with {} at the end of the value", quote));
    }
    at_ += length + 1;
    return quote != '\'' || current() != '\'' || passQuoted(quote);  // '' stands for one quote
  }

  bool passPlain(const std::string& value) {
    if (current() == ':') return failHere();
    if (!restOfLine().starts_with(value)) {
      return fail(fmt::format("the value that begins with {} continues on the next line",
                              base::inQuotes(restOfLine())),
                  "write it on one line; check the colon and the indentation of the line below");
    }
    at_ += value.size();
    return true;
  }

  std::string_view text_;
  std::span<const SourceScalar> scalars_;
  std::size_t at_ = 0;
  int depth_ = 0;                           // of flow maps
  bool has_version_ = false;                // from a line %YAML, which must be followed by a line ---
  bool begun_ = false;                      // by a line ---
  bool in_entries_ = false;                 // after the first name
  bool behind_name_ = false;                // on its line, or on that of an item's dash
  bool in_list_ = false;                    // the last or the next scalar is part of a list
  std::optional<std::size_t> name_column_;  // of the name whose value is expected; nothing in braces
  YamlProblem problem_;
};

}  // namespace

std::optional<YamlProblem> sourceProblem(std::string_view text, std::span<const SourceScalar> scalars,
                                         bool complete) {
  return SourceWalk(text, scalars).run(complete);
}

}  // namespace hapticd::config
