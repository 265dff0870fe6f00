// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/source_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "config/base/file_content.h"
#include "config/base/value_text.h"

namespace hapticd::solids {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f\n";

bool isBlank(char character) {
  return kBlanks.find(character) != std::string_view::npos;
}

}  // namespace

std::string_view textOf(Frame frame) {
  return frame == Frame::lps ? "LPS" : "RAS";
}

std::string_view textOf(KnownFrom knowledge) {
  switch (knowledge) {
    case KnownFrom::file:
      return "stated in the file";
    case KnownFrom::option:
      return "given";
    case KnownFrom::assumed:
      break;
  }
  return "assumed";
}

std::string ignoredFrame(Frame stated, Frame given) {
  return fmt::format("the file states the frame {}; the given {} is ignored", textOf(stated), textOf(given));
}

std::optional<Frame> frameOf(std::string_view word) {
  const std::string lower = lowerCase(word);
  if (lower == "lps") return Frame::lps;
  if (lower == "ras") return Frame::ras;
  return std::nullopt;
}

std::string millimetreText(const rt::Vec3& point_m) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", point_m.x / kMetresPerMillimetre,
                     point_m.y / kMetresPerMillimetre, point_m.z / kMetresPerMillimetre);
}

std::unexpected<base::Error> refused(std::string where, std::string what, std::string remedy) {
  return std::unexpected(base::Error{std::move(where), std::move(what), std::move(remedy)});
}

base::Result<std::string> contentOf(const std::filesystem::path& file, std::size_t longest) {
  auto content = base::fileContent(file, {.longest = longest});
  if (content) return std::move(*content);
  const bool is_long = content.error().reason == base::FileFault::Reason::too_long;
  return refused(file.string(), content.error().text(),
                 is_long ? "crop or simplify it in the program that wrote it" : "check the name of the file");
}

std::optional<double> coordinateFrom(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.size() > 64) return std::nullopt;  // longer than any number that a program writes
  std::string decimal(text);
  if (std::ranges::count(decimal, ',') == 1 && decimal.find('.') == std::string::npos)
    std::ranges::replace(decimal, ',', '.');
  const std::optional<double> number = base::numberFrom<double>(decimal);
  // written so that a value that is not a number is out of range
  if (!number || !(std::abs(*number) <= kMaxCoordinate)) return std::nullopt;
  return number;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::string lowerCase(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](char character) {
    return character >= 'A' && character <= 'Z' ? static_cast<char>(character - 'A' + 'a') : character;
  });
  return lower;
}

TextCursor::TextCursor(std::string_view text) : text_(text) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (text.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
  const std::size_t end = text.find_first_of("\r\n");
  if (end != std::string_view::npos && text[end] == '\r' && !text.substr(end + 1).starts_with('\n'))
    line_end_ = '\r';
}

std::optional<std::string_view> TextCursor::nextLine() {
  if (at_ >= text_.size()) return std::nullopt;
  const std::size_t end = std::min(text_.find(line_end_, at_), text_.size());
  std::string_view line = text_.substr(at_, end - at_);
  at_ = std::min(end + 1, text_.size());
  line_ = ++line_ends_passed_;
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::optional<std::string_view> TextCursor::nextWord() {
  while (at_ < text_.size() && isBlank(text_[at_])) {
    if (text_[at_] == line_end_) ++line_ends_passed_;
    ++at_;
  }
  line_ = line_ends_passed_ + 1;
  if (at_ >= text_.size()) return std::nullopt;
  const std::size_t end = std::min(text_.find_first_of(kBlanks, at_), text_.size());
  const std::string_view word = text_.substr(at_, end - at_);
  at_ = end;
  return word;
}

std::string_view TextCursor::restOfLine() {
  return nextLine().value_or(std::string_view());
}

std::string_view takeWord(std::string_view& text) {
  text = trimmed(text);
  const std::size_t end = std::min(text.find_first_of(kBlanks), text.size());
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end);
  return word;
}

}  // namespace hapticd::solids
