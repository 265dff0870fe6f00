// SPDX-License-Identifier: Apache-2.0
#include "config/settings/label_image.h"

#include <fmt/format.h>

#include <string_view>

#include "config/base/file_content.h"
#include "config/base/pgm_header.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::config {
namespace {

// Room for the header and long comments in it.
constexpr std::size_t kMaxFileBytes = rt::kMaxFramePixels + 65536;

std::unexpected<base::Error> failure(const std::filesystem::path& file, std::string what,
                                     std::string remedy) {
  return std::unexpected(base::Error{file.string(), std::move(what), std::move(remedy)});
}

}  // namespace

base::Result<LabelImage> loadLabelImage(const std::filesystem::path& file) {
  const auto content = base::fileContent(file, {.longest = kMaxFileBytes, .kind = base::FileKind::regular});
  if (!content) {
    return failure(file, content.error().text(),
                   "name a PGM file of 8 bits, of the size of the depth image, that hapticd can read");
  }
  std::size_t at = 0;
  const auto header = base::readPgmHeader(
      [&]() -> int { return at < content->size() ? static_cast<unsigned char>((*content)[at++]) : -1; });
  if (!header && header.error() == base::PgmFault::other_format) {
    return failure(file, "is not a binary portable graymap: it does not begin with P5",
                   "save it as a binary PGM file (P5)");
  }
  if (!header) {
    return failure(file, "has a damaged header: width, height and largest value must follow P5",
                   "write the file again");
  }
  const auto& [width_px, height_px, maximum] = *header;
  if (width_px < 1 || height_px < 1 || width_px > rt::kMaxFrameWidth || height_px > rt::kMaxFrameHeight) {
    return failure(file, fmt::format("has {} x {} pixels", width_px, height_px),
                   fmt::format("draw it over a depth image, which has at most {} x {}", rt::kMaxFrameWidth,
                               rt::kMaxFrameHeight));
  }
  if (maximum != 255) {
    return failure(file, fmt::format("has the largest value {}", maximum),
                   "write it with 8 bits for each pixel, that is with the largest value 255");
  }
  const std::string_view pixels = std::string_view(*content).substr(at);
  const auto needed = static_cast<std::size_t>(width_px * height_px);
  if (pixels.size() != needed) {
    return failure(file, fmt::format("has {} bytes of pixels, and {} are needed", pixels.size(), needed),
                   "write the file again");
  }
  return LabelImage{static_cast<int>(width_px), static_cast<int>(height_px), std::string(pixels)};
}

}  // namespace hapticd::config
