// SPDX-License-Identifier: Apache-2.0
#include "tests/support/depth_images.h"

#include <png.h>

#include <cstddef>
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

}  // namespace hapticd::test
