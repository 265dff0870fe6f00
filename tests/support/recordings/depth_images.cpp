// SPDX-License-Identifier: Apache-2.0
#include "tests/support/recordings/depth_images.h"

#include <png.h>

#include <cstddef>
#include <fstream>
#include <stdexcept>

namespace hapticd::test {
namespace {

std::string pngOf(int width_px, int height_px, png_uint_32 format, const void* pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width_px);
  image.height = static_cast<png_uint_32>(height_px);
  image.format = format;
  png_alloc_size_t bytes = 0;
  if (!png_image_write_to_memory(&image, nullptr, &bytes, 0, pixels, 0, nullptr))
    throw std::runtime_error(image.message);
  std::string file(bytes, '\0');
  if (!png_image_write_to_memory(&image, file.data(), &bytes, 0, pixels, 0, nullptr))
    throw std::runtime_error(image.message);
  return file;
}

}  // namespace

std::vector<std::uint16_t> pixelsOf(const rt::DepthFrame& frame) {
  std::vector<std::uint16_t> pixels;
  for (int row = 0; row < frame.camera.height_px; ++row) {
    const std::uint16_t* const begin =
        frame.raw + static_cast<std::ptrdiff_t>(row) * rt::strideOf(frame.camera.width_px);
    pixels.insert(pixels.end(), begin, begin + frame.camera.width_px);
  }
  return pixels;
}

std::string greyPng(int width_px, int height_px, const std::vector<std::uint16_t>& pixels) {
  return pngOf(width_px, height_px, PNG_FORMAT_LINEAR_Y, pixels.data());
}

std::string greyPngWithTexts(int width_px, int height_px, const std::vector<std::uint16_t>& pixels, int texts,
                             std::size_t bytes_of_text) {
  std::string file;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &file,
      [](png_structp self, png_bytep bytes, png_size_t count) {
        static_cast<std::string*>(png_get_io_ptr(self))->append(reinterpret_cast<const char*>(bytes), count);
      },
      nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width_px), static_cast<png_uint_32>(height_px), 16,
               PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  std::string key = "Comment";
  std::string content(bytes_of_text, 'x');
  png_text text{};
  text.compression = PNG_TEXT_COMPRESSION_zTXt;
  text.key = key.data();
  text.text = content.data();
  text.text_length = content.size();
  png_set_text(png, info, &text, 1);
  png_write_info(png, info);
  png_set_swap(png);
  for (int row = 0; row < height_px; ++row)
    png_write_row(png, reinterpret_cast<png_const_bytep>(pixels.data() + row * width_px));
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  const std::size_t kind = file.find("zTXt");  // between the length of the chunk and its content
  const std::string chunk = file.substr(kind - 4, file.find("IDAT") - kind);
  for (int i = 1; i < texts; ++i) file.insert(kind - 4, chunk);
  return file;
}

std::string bytePng(int width_px, int height_px, bool colour) {
  const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(3 * width_px * height_px), 77);
  return pngOf(width_px, height_px, colour ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY, pixels.data());
}

std::string bigEndianPgm(int width_px, int height_px, const std::vector<std::uint16_t>& pixels) {
  std::string bytes =
      "P5\n# made by a test\n" + std::to_string(width_px) + " " + std::to_string(height_px) + "\n65535\n";
  for (const std::uint16_t pixel : pixels) {
    bytes += static_cast<char>(pixel >> 8);
    bytes += static_cast<char>(pixel & 0xff);
  }
  return bytes;
}

std::vector<std::uint16_t> rawPixelsOf(const std::filesystem::path& file) {
  constexpr std::size_t kPixels = 640 * 480;
  std::ifstream stream(file, std::ios::binary);
  std::string header;
  std::getline(stream, header);
  std::vector<unsigned char> bytes(2 * kPixels);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  std::vector<std::uint16_t> raw(kPixels);
  for (std::size_t pixel = 0; pixel < raw.size(); ++pixel) {
    raw[pixel] = static_cast<std::uint16_t>(bytes[2 * pixel] + 256 * bytes[2 * pixel + 1]);
  }
  return raw;
}

}  // namespace hapticd::test
