// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/depth_pgm.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "config/value_text.h"
#include "drivers/camera/damaged_pixels.h"
#include "drivers/camera/kinect_image.h"

namespace hapticd::drivers {
namespace {

static_assert(std::endian::native == std::endian::little, "pixels are read in the file's own byte order");

constexpr std::string_view kHeader = "P5 640 480 65535\n";
constexpr std::size_t kPixelBytes = kKinectPixels * sizeof(std::uint16_t);
constexpr std::size_t kFileBytes = kHeader.size() + kPixelBytes;

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

std::unexpected<config::Error> refuse(const std::filesystem::path& file, std::string what,
                                      std::string remedy) {
  return std::unexpected(config::Error{file.string(), std::move(what), std::move(remedy)});
}

std::unexpected<config::Error> refuseHeader(const std::filesystem::path& file, std::string_view header) {
  constexpr const char* kRemedy =
      "record it with libfreenect's own recorder (fakenect-record), or write the header \"P5 640 480 65535\" "
      "and "
      "little-endian pixels";
  if (header.find('\r') != std::string_view::npos) {
    return refuse(file,
                  "the header has CRLF line endings: the file was copied as text and its pixels are damaged",
                  "copy the recording again as binary data");
  }
  const std::size_t line_end = header.find('\n');
  const std::string_view line = header.substr(0, line_end);
  if (header.starts_with("P5") && line.size() < kHeader.size() - 1) {
    return refuse(file,
                  fmt::format("the header begins with the line {}; expected one single line "
                              "\"P5 640 480 65535\"",
                              config::inQuotes(line)),
                  kRemedy);
  }
  if (header.starts_with("P5")) {
    return refuse(file,
                  fmt::format("the header is {}; expected \"P5 640 480 65535\"", config::inQuotes(line)),
                  kRemedy);
  }
  return refuse(file, "not a PGM image: it does not begin with \"P5\"", kRemedy);
}

std::unexpected<config::Error> refusePixels(const std::filesystem::path& file, rt::DepthFrame& frame) {
  const std::size_t damaged = countDamagedPixels(frame.image());
  const bool byte_swapped = std::ranges::all_of(frame.image(), [](std::uint16_t value) {
    return static_cast<std::uint16_t>(value << 8 | value >> 8) <= 2047;
  });
  if (byte_swapped) {
    return refuse(file, fmt::format("{} pixels are above 2047: the pixels are big-endian", damaged),
                  "swap the bytes of the pixels; libfreenect's recordings are little-endian, unlike the PGM "
                  "standard");
  }
  return refuse(file, fmt::format("{} of {} pixels are above 2047", damaged, kKinectPixels),
                "the frame is damaged; copy the recording again");
}

}  // namespace

config::Result<void> readDepthPgm(const std::filesystem::path& file, rt::DepthFrame& frame) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(file, failure)) {
    return refuse(file, failure ? failure.message() : "not a file", "check the path");
  }
  const File stream(std::fopen(file.c_str(), "rb"));
  if (!stream) return refuse(file, std::strerror(errno), "check the path and the permissions");
  std::setvbuf(stream.get(), nullptr, _IONBF, 0);  // so that one read goes straight into the frame

  char header[kHeader.size()];
  const std::size_t header_bytes = std::fread(header, 1, kHeader.size(), stream.get());
  const std::string_view found(header, header_bytes);
  if (header_bytes == kHeader.size() && found != kHeader) return refuseHeader(file, found);

  const std::size_t pixel_bytes =
      header_bytes < kHeader.size() ? 0 : std::fread(frame.raw, 1, kPixelBytes, stream.get());
  if (pixel_bytes < kPixelBytes) {
    return refuse(file, fmt::format("has {} bytes, expected {}", header_bytes + pixel_bytes, kFileBytes),
                  "the file is truncated; copy it again");
  }
  if (std::fgetc(stream.get()) != EOF) {
    return refuse(file, fmt::format("has more than the expected {} bytes", kFileBytes),
                  "libfreenect's depth images are 640 x 480; copy or record it again");
  }
  if (hasDamagedPixels(frame.image())) return refusePixels(file, frame);
  return {};
}

config::Result<void> writeDepthPgm(const std::filesystem::path& file, const rt::DepthFrame& frame) {
  const File stream(std::fopen(file.c_str(), "wbe"));
  bool whole = stream != nullptr;
  whole = whole && std::fwrite(kHeader.data(), 1, kHeader.size(), stream.get()) == kHeader.size();
  whole = whole && std::fwrite(frame.raw, 1, kPixelBytes, stream.get()) == kPixelBytes;
  whole = whole && std::fflush(stream.get()) == 0;
  if (whole) return {};
  const int problem = errno;
  std::error_code ignored;
  if (stream) std::filesystem::remove(file, ignored);
  return refuse(file, fmt::format("cannot be written: {}", std::strerror(problem)), "check the disk");
}

}  // namespace hapticd::drivers
