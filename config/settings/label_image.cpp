// SPDX-License-Identifier: Apache-2.0
#include "config/settings/label_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

#include "config/base/file_content.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::config {
namespace {

// Room for the header and long comments in it.
constexpr std::size_t kMaxFileBytes = rt::kMaxFramePixels + 65536;
constexpr std::string_view kBlanks = " \t\r\n\v\f";

std::unexpected<base::Error> failure(const std::filesystem::path& file, std::string what,
                                     std::string remedy) {
  return std::unexpected(base::Error{file.string(), std::move(what), std::move(remedy)});
}

/// Reads the numbers of a graymap's header (netpbm's pgm(5)): separated by blanks, with comments from `#` to
/// the end of the line.
class Header {
 public:
  explicit Header(std::string_view text) : text_(text) {}

  std::optional<int> next() {
    skip();
    int number = 0;
    const std::string_view rest = text_.substr(at_);
    const auto [end, failure] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (failure != std::errc{}) return std::nullopt;
    at_ += static_cast<std::size_t>(end - rest.data());
    return number;
  }
  /// Returns what follows the single blank after the last number.
  std::string_view rest() const {
    return at_ < text_.size() && kBlanks.contains(text_[at_]) ? text_.substr(at_ + 1) : std::string_view();
  }

 private:
  void skip() {
    while (at_ < text_.size() && (kBlanks.contains(text_[at_]) || text_[at_] == '#')) {
      at_ = text_[at_] == '#' ? std::min(text_.find('\n', at_), text_.size()) : at_ + 1;
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

base::Result<LabelImage> loadLabelImage(const std::filesystem::path& file) {
  const auto content = base::fileContent(file, {.longest = kMaxFileBytes, .kind = base::FileKind::regular});
  if (!content) {
    return failure(file, content.error().text(),
                   "name a PGM file of 8 bits, of the size of the depth image, that hapticd can read");
  }
  if (!content->starts_with("P5")) {
    return failure(file, "is not a binary portable graymap: it does not begin with P5",
                   "save it as a binary PGM file (P5)");
  }
  Header header(std::string_view(*content).substr(2));
  const std::optional<int> width = header.next();
  const std::optional<int> height = header.next();
  const std::optional<int> maximum = header.next();
  if (!width || !height || !maximum) {
    return failure(file, "has a damaged header: width, height and largest value must follow P5",
                   "write the file again");
  }
  if (*width < 1 || *height < 1 || *width > rt::kMaxFrameWidth || *height > rt::kMaxFrameHeight) {
    return failure(file, fmt::format("has {} x {} pixels", *width, *height),
                   fmt::format("draw it over a depth image, which has at most {} x {}", rt::kMaxFrameWidth,
                               rt::kMaxFrameHeight));
  }
  if (*maximum != 255) {
    return failure(file, fmt::format("has the largest value {}", *maximum),
                   "write it with 8 bits for each pixel, that is with the largest value 255");
  }
  const std::string_view pixels = header.rest();
  const std::size_t needed = static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height);
  if (pixels.size() != needed) {
    return failure(file, fmt::format("has {} bytes of pixels, and {} are needed", pixels.size(), needed),
                   "write the file again");
  }
  return LabelImage{*width, *height, std::string(pixels)};
}

}  // namespace hapticd::config
