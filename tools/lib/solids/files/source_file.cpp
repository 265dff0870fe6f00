// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/source_file.h"

#include <fmt/format.h>
#include <zlib.h>

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

/// Owns zlib's state.
struct ByteStream::Gzip {
  Gzip() { is_ready = inflateInit2(&state, 15 + 16) == Z_OK; }  // 16: a gzip header
  ~Gzip() {
    if (is_ready) inflateEnd(&state);
  }
  Gzip(const Gzip&) = delete;
  Gzip& operator=(const Gzip&) = delete;

  z_stream state{};
  bool is_ready = false;
  bool has_ended = false;
};

ByteStream::ByteStream(std::string_view bytes, bool is_gzip, const std::string& name)
    : bytes_(bytes), size_(bytes.size()), name_(name), gzip_(is_gzip ? std::make_unique<Gzip>() : nullptr) {}

ByteStream::~ByteStream() = default;

base::Result<std::size_t> ByteStream::read(std::span<char> room) {
  constexpr std::size_t kPiece = std::size_t{1} << 26;  // zlib takes at most 4 GiB at a time
  if (!gzip_) {
    const std::size_t count = bytes_.copy(room.data(), room.size());
    bytes_.remove_prefix(count);
    return count;
  }
  if (!gzip_->is_ready) return refused(name_, "zlib cannot start", "free some memory");
  z_stream& state = gzip_->state;
  std::size_t made = 0;
  while (made < room.size() && !gzip_->has_ended) {
    const std::size_t input = std::min(kPiece, bytes_.size()), space = std::min(kPiece, room.size() - made);
    // zlib does not write to its input
    state.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes_.data()));
    state.avail_in = static_cast<uInt>(input);
    state.next_out = reinterpret_cast<Bytef*>(room.data() + made);
    state.avail_out = static_cast<uInt>(space);
    const int status = ::inflate(&state, Z_NO_FLUSH);
    const std::size_t used = input - state.avail_in, got = space - state.avail_out;
    bytes_.remove_prefix(used);
    made += got;
    if (status == Z_STREAM_END) {
      // another member may follow; zeros that fill the last block of a tape are not one
      gzip_->has_ended = bytes_.find_first_not_of('\0') == std::string_view::npos;
      if (!gzip_->has_ended && inflateReset(&state) != Z_OK)
        return refused(name_, "zlib cannot go on", "free some memory");
      continue;
    }
    const bool is_stuck = used == 0 && got == 0;
    if (status == Z_OK && !is_stuck) continue;
    const bool is_short = bytes_.empty() && (status == Z_OK || status == Z_BUF_ERROR);
    return refused(
        fmt::format("{}: byte {} of the compressed data", name_, size_ - bytes_.size()),
        is_short ? "the compressed data end too early"
                 : fmt::format("the compressed data are damaged ({})",
                               state.msg == nullptr ? "not gzip" : state.msg),
        is_short ? "the file is truncated: copy or write it again" : "copy or write the file again");
  }
  return made;
}

}  // namespace hapticd::solids
