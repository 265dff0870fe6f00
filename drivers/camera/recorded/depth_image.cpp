// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/depth_image.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/pgm_header.h"
#include "config/base/value_text.h"
#include "drivers/camera/kinect_image.h"

namespace hapticd::drivers {
namespace {

/// Reads a PNG image from a stream, with the pixels as they are in the file, without colour management.
/// Thread: one.  RT: not safe.
class PngPixels {
 public:
  struct Header {
    std::uint32_t width_px = 0;
    std::uint32_t height_px = 0;
    int bits = 0;  ///< of each channel
    bool grey = false;
  };

  /// `stream`: at the beginning of the file; it outlives the object.
  explicit PngPixels(std::FILE* stream);
  ~PngPixels();
  PngPixels(const PngPixels&) = delete;
  PngPixels& operator=(const PngPixels&) = delete;

  /// Reads the header. False: the file is damaged, see fault().
  bool readHeader(Header& header);
  /// Reads an image of 16-bit greys into `rows`, one pointer for each row, after readHeader(). False: the
  /// file is damaged or truncated, see fault().
  bool readRows(std::vector<std::uint16_t*>& rows);
  /// libpng's description of what is wrong.
  const std::string& fault() const;

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

static_assert(std::endian::native == std::endian::little, "the bytes of PNG's pixels are swapped");

/// Far beyond the largest frame, so that a caller can say which size an image has.
constexpr png_uint_32 kMaxPixelsOfASide = 16384;
/// Beside its pixels a file may hold texts, profiles and more, compressed a thousandfold. libpng keeps at
/// most kMaxChunks of those, each of at most kMaxChunkBytes when it is unpacked.
constexpr png_uint_32 kMaxChunks = 16;
constexpr png_alloc_size_t kMaxChunkBytes = 1024 * 1024;

/// libpng reports errors by longjmp() back into the function that called it, so that those functions have no
/// local objects with destructors.
struct PngPixels::Library {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string fault = "out of memory";

  static void remember(png_structp png, png_const_charp message) {
    static_cast<Library*>(png_get_error_ptr(png))->fault = message;
    png_longjmp(png, 1);
  }
  static void ignore(png_structp /*png*/, png_const_charp /*warning*/) {}
};

PngPixels::PngPixels(std::FILE* stream) : library_(std::make_unique<Library>()) {
  Library& library = *library_;
  library.png =
      png_create_read_struct(PNG_LIBPNG_VER_STRING, library_.get(), &Library::remember, &Library::ignore);
  if (library.png == nullptr) return;
  png_set_user_limits(library.png, kMaxPixelsOfASide, kMaxPixelsOfASide);
  png_set_chunk_cache_max(library.png, kMaxChunks);
  png_set_chunk_malloc_max(library.png, kMaxChunkBytes);
  library.info = png_create_info_struct(library.png);
  if (library.info != nullptr) png_init_io(library.png, stream);
}

PngPixels::~PngPixels() {
  png_destroy_read_struct(&library_->png, &library_->info, nullptr);
}

bool PngPixels::readHeader(Header& header) {
  const png_structp png = library_->png;
  const png_infop info = library_->info;
  if (info == nullptr) return false;
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_info(png, info);
  header.width_px = png_get_image_width(png, info);
  header.height_px = png_get_image_height(png, info);
  header.bits = png_get_bit_depth(png, info);
  header.grey = png_get_color_type(png, info) == PNG_COLOR_TYPE_GRAY;
  return true;
}

bool PngPixels::readRows(std::vector<std::uint16_t*>& rows) {
  const png_structp png = library_->png;
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_swap(png);
  const int passes = png_set_interlace_handling(png);
  for (int pass = 0; pass < passes; ++pass) {
    for (std::uint16_t* const row : rows) png_read_row(png, reinterpret_cast<png_bytep>(row), nullptr);
  }
  png_read_end(png, nullptr);
  return true;
}

const std::string& PngPixels::fault() const {
  return library_->fault;
}

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "the bytes of PGM's pixels are swapped");

constexpr int kMaxValue = 65535;
constexpr int kMinValues = 256;  // with a smaller maximum a pixel has one byte
constexpr const char* kFormats =
    "depth images are binary PGM (P5) or PNG with 16 bits of grey for each pixel";
constexpr const char* kCopyAgain = "copy the recording again";

constexpr std::string_view kKinectHeader = "P5 640 480 65535\n";
constexpr std::size_t kKinectPixelBytes = kKinectPixels * sizeof(std::uint16_t);
constexpr std::size_t kKinectFileBytes = kKinectHeader.size() + kKinectPixelBytes;

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// Width and height of an image in pixels.
struct ImageSize {
  int width_px = 0;
  int height_px = 0;
};

std::unexpected<base::Error> refuse(const fs::path& file, std::string what, std::string remedy) {
  return std::unexpected(base::Error{file.string(), std::move(what), std::move(remedy)});
}

base::Result<File> opened(const fs::path& file) {
  std::error_code failure;
  if (!fs::is_regular_file(file, failure)) {
    return refuse(file, failure ? failure.message() : "not a file", "check the path");
  }
  File stream(std::fopen(file.c_str(), "rbe"));
  if (!stream) return refuse(file, std::strerror(errno), "check the path and the permissions");
  return stream;
}

/// Returns whether the file begins like a PNG image; the position is at the beginning afterwards.
bool isPng(std::FILE* stream) {
  constexpr std::string_view kSignature = "\x89PNG";
  char first[kSignature.size()] = {};
  const std::size_t bytes = std::fread(first, 1, sizeof first, stream);
  std::rewind(stream);
  return std::string_view(first, bytes) == kSignature;
}

base::Result<ImageSize> checkedSize(const fs::path& file, std::uint64_t width, std::uint64_t height) {
  if (width < 1 || height < 1 || width > static_cast<std::uint64_t>(rt::kMaxFrameWidth) ||
      height > static_cast<std::uint64_t>(rt::kMaxFrameHeight)) {
    return refuse(file, fmt::format("is an image of {} x {} pixels", width, height),
                  fmt::format("frames have at most {} x {} pixels", rt::kMaxFrameWidth, rt::kMaxFrameHeight));
  }
  return ImageSize{static_cast<int>(width), static_cast<int>(height)};
}

/// Reads the header of a PGM image; the pixels follow.
base::Result<ImageSize> readPgmHeader(const fs::path& file, std::FILE* stream) {
  const auto header = base::readPgmHeader([stream] { return std::fgetc(stream); });
  if (!header && header.error() == base::PgmFault::other_format)
    return refuse(file, "is neither a PGM (P5) nor a PNG image", kFormats);
  if (!header || header->width_px < 1 || header->height_px < 1 || header->maximum < 1 ||
      header->maximum > kMaxValue) {
    return refuse(file, "has a damaged PGM header",
                  "the header is \"P5\", width, height and 65535, each followed by white space");
  }
  if (header->maximum < kMinValues) {
    return refuse(file, fmt::format("has 8 bits for each pixel (a maximum of {})", header->maximum),
                  kFormats);
  }
  return checkedSize(file, static_cast<std::uint64_t>(header->width_px),
                     static_cast<std::uint64_t>(header->height_px));
}

base::Result<ImageSize> readPngHeader(const fs::path& file, PngPixels& png) {
  PngPixels::Header header;
  if (!png.readHeader(header)) return refuse(file, "is a damaged PNG image: " + png.fault(), kCopyAgain);
  if (!header.grey) return refuse(file, "is a PNG image in colour", kFormats);
  if (header.bits != 16)
    return refuse(file, fmt::format("has {} bits for each pixel", header.bits), kFormats);
  return checkedSize(file, header.width_px, header.height_px);
}

base::Result<void> requireSize(const fs::path& file, const ImageSize& size,
                               const rt::DepthModelParameters& camera) {
  if (size.width_px == camera.width_px && size.height_px == camera.height_px) return {};
  return refuse(file,
                fmt::format("is an image of {} x {} pixels, the camera's frames have {} x {}", size.width_px,
                            size.height_px, camera.width_px, camera.height_px),
                "all images of a recording have the size that camera.yaml states");
}

std::uint16_t* rowOf(rt::DepthFrame& frame, int row) {
  return frame.raw + static_cast<std::ptrdiff_t>(row) * rt::strideOf(frame.camera.width_px);
}

std::uint16_t swapped(std::uint16_t value) {
  return static_cast<std::uint16_t>(value << 8 | value >> 8);
}

base::Result<void> readPgmPixels(const fs::path& file, std::FILE* stream, rt::DepthFrame& frame) {
  const auto width = static_cast<std::size_t>(frame.camera.width_px);
  for (int v = 0; v < frame.camera.height_px; ++v) {
    std::uint16_t* const row = rowOf(frame, v);
    if (std::fread(row, sizeof *row, width, stream) != width) {
      return refuse(file, fmt::format("is truncated in row {} of {}", v + 1, frame.camera.height_px),
                    kCopyAgain);
    }
    std::transform(row, row + width, row, swapped);
  }
  if (std::fgetc(stream) == EOF) return {};
  return refuse(file, "goes on after the last pixel", "write one image into each file");
}

base::Result<void> readPngPixels(const fs::path& file, PngPixels& png, rt::DepthFrame& frame) {
  std::vector<std::uint16_t*> rows;
  for (int v = 0; v < frame.camera.height_px; ++v) rows.push_back(rowOf(frame, v));
  if (png.readRows(rows)) return {};
  return refuse(file, "is a damaged or truncated PNG image: " + png.fault(), kCopyAgain);
}

base::Result<void> readPixels(const fs::path& file, std::FILE* stream, rt::DepthFrame& frame) {
  if (isPng(stream)) {
    PngPixels png(stream);
    const auto size = readPngHeader(file, png);
    if (!size) return std::unexpected(size.error());
    if (auto fits = requireSize(file, *size, frame.camera); !fits) return fits;
    return readPngPixels(file, png, frame);
  }
  const auto size = readPgmHeader(file, stream);
  if (!size) return std::unexpected(size.error());
  if (auto fits = requireSize(file, *size, frame.camera); !fits) return fits;
  return readPgmPixels(file, stream, frame);
}

std::unexpected<base::Error> refuseKinectHeader(const fs::path& file, std::string_view header) {
  constexpr const char* kRemedy =
      "record it with libfreenect's own recorder (fakenect-record), or write the header \"P5 640 480 65535\" "
      "and little-endian pixels";
  if (header.find('\r') != std::string_view::npos) {
    return refuse(file,
                  "the header has CRLF line endings: the file was copied as text and its pixels are damaged",
                  "copy the recording again as binary data");
  }
  const std::size_t line_end = header.find('\n');
  const std::string_view line = header.substr(0, line_end);
  if (header.starts_with("P5") && line.size() < kKinectHeader.size() - 1) {
    return refuse(file,
                  fmt::format("the header begins with the line {}; expected one single line "
                              "\"P5 640 480 65535\"",
                              base::inQuotes(line)),
                  kRemedy);
  }
  if (header.starts_with("P5")) {
    return refuse(file, fmt::format("the header is {}; expected \"P5 640 480 65535\"", base::inQuotes(line)),
                  kRemedy);
  }
  return refuse(file, "not a PGM image: it does not begin with \"P5\"", kRemedy);
}

std::unexpected<base::Error> refuseKinectPixels(const fs::path& file, rt::DepthFrame& frame) {
  const std::size_t damaged = countDamagedPixels(frame.image());
  const bool byte_swapped = std::ranges::all_of(
      frame.image(), [](std::uint16_t value) { return swapped(value) < kKinectRawValues; });
  if (byte_swapped) {
    return refuse(file, fmt::format("{} pixels are above 2047: the pixels are big-endian", damaged),
                  "swap the bytes of the pixels; libfreenect's recordings are little-endian, unlike the PGM "
                  "standard");
  }
  return refuse(file, fmt::format("{} of {} pixels are above 2047", damaged, kKinectPixels),
                "the frame is damaged; copy the recording again");
}

base::Result<void> writePgm(const fs::path& file, std::string_view header,
                            std::span<const std::uint16_t> pixels) {
  const File stream(std::fopen(file.c_str(), "wbe"));
  bool whole = stream != nullptr;
  whole = whole && std::fwrite(header.data(), 1, header.size(), stream.get()) == header.size();
  whole = whole && std::fwrite(pixels.data(), sizeof pixels[0], pixels.size(), stream.get()) == pixels.size();
  whole = whole && std::fflush(stream.get()) == 0;
  if (whole) return {};
  const int problem = errno;
  std::error_code ignored;
  if (stream) fs::remove(file, ignored);
  return refuse(file, fmt::format("cannot be written: {}", std::strerror(problem)), "check the disk");
}

void fillPadding(rt::DepthFrame& frame) {
  for (int v = 0; v < frame.camera.height_px; ++v) {
    std::uint16_t* const row = rowOf(frame, v);
    std::fill(row + frame.camera.width_px, row + rt::strideOf(frame.camera.width_px),
              frame.camera.raw_no_measurement);
  }
}

}  // namespace

base::Result<void> readDepthImage(const fs::path& file, rt::DepthFrame& frame) {
  const auto stream = opened(file);
  if (!stream) return std::unexpected(stream.error());
  if (auto read = readPixels(file, stream->get(), frame); !read) return read;
  fillPadding(frame);
  const rt::DepthModelParameters& camera = frame.camera;
  const auto damaged =
      std::ranges::count_if(frame.image(), [&camera](std::uint16_t raw) { return raw >= camera.raw_values; });
  if (damaged == 0) return {};
  return refuse(file, fmt::format("{} pixels are above {}", damaged, camera.raw_values - 1),
                "correct raw_values in camera.yaml if the camera has such raw values, else copy the "
                "recording again");
}

base::Result<void> writeDepthImage(const fs::path& file, const rt::DepthFrame& frame) {
  const rt::DepthModelParameters& camera = frame.camera;
  std::vector<std::uint16_t> pixels;
  for (int v = 0; v < camera.height_px; ++v) {
    const std::uint16_t* const from =
        frame.raw + static_cast<std::ptrdiff_t>(v) * rt::strideOf(camera.width_px);
    std::transform(from, from + camera.width_px, std::back_inserter(pixels), swapped);
  }
  return writePgm(file, fmt::format("P5\n{} {}\n{}\n", camera.width_px, camera.height_px, kMaxValue), pixels);
}

base::Result<void> readKinectImage(const fs::path& file, rt::DepthFrame& frame) {
  const auto stream = opened(file);
  if (!stream) return std::unexpected(stream.error());
  std::setvbuf(stream->get(), nullptr, _IONBF, 0);  // so that one read goes straight into the frame
  char header[kKinectHeader.size()];
  const std::size_t header_bytes = std::fread(header, 1, sizeof header, stream->get());
  const bool has_header = header_bytes == sizeof header;
  const std::string_view found(header, header_bytes);
  if (has_header && found != kKinectHeader) return refuseKinectHeader(file, found);
  const std::size_t pixel_bytes = has_header ? std::fread(frame.raw, 1, kKinectPixelBytes, stream->get()) : 0;
  if (pixel_bytes < kKinectPixelBytes) {
    return refuse(file,
                  fmt::format("has {} bytes, expected {}", header_bytes + pixel_bytes, kKinectFileBytes),
                  "the file is truncated; copy it again");
  }
  if (std::fgetc(stream->get()) != EOF) {
    return refuse(file, fmt::format("has more than the expected {} bytes", kKinectFileBytes),
                  "libfreenect's depth images are 640 x 480; copy or record it again");
  }
  if (hasDamagedPixels(frame.image())) return refuseKinectPixels(file, frame);
  return {};
}

base::Result<void> writeKinectImage(const fs::path& file, const rt::DepthFrame& frame) {
  return writePgm(file, kKinectHeader, std::span(frame.raw).first<kKinectPixels>());
}

}  // namespace hapticd::drivers
