// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/png_pixels.h"

#include <png.h>

#include <bit>
#include <csetjmp>

namespace hapticd::drivers {

static_assert(std::endian::native == std::endian::little, "the bytes of PNG's pixels are swapped");

namespace {

/// Far beyond the largest frame, so that a caller can say which size an image has.
constexpr png_uint_32 kMostPixelsOfASide = 16384;
/// Beside its pixels a file may hold texts, profiles and more, compressed a thousandfold. libpng keeps at
/// most kMostChunks of those, each of at most kMostChunkBytes when it is unpacked.
constexpr png_uint_32 kMostChunks = 16;
constexpr png_alloc_size_t kMostChunkBytes = 1024 * 1024;

}  // namespace

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
  png_set_user_limits(library.png, kMostPixelsOfASide, kMostPixelsOfASide);
  png_set_chunk_cache_max(library.png, kMostChunks);
  png_set_chunk_malloc_max(library.png, kMostChunkBytes);
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

}  // namespace hapticd::drivers
