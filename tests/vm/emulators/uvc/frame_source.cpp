// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/frame_source.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <string>

#include "tests/vm/emulators/uvc/byte_writer.h"

namespace hapticd::test::uvc {
namespace {

struct Image {
  std::size_t width_px = 0;
  std::size_t height_px = 0;
  std::vector<std::uint16_t> pixels;
};

std::unexpected<config::Error> refuse(const std::filesystem::path& path, std::string what) {
  return std::unexpected(
      config::Error{path.string(), std::move(what), "name a folder with PGM images (P5) of 16 bits"});
}

config::Result<Image> readImage(const std::filesystem::path& path, bool big_endian) {
  constexpr std::size_t kMostPixels = 1920 * 1200;
  std::ifstream file(path, std::ios::binary);
  std::string magic;
  Image image;
  unsigned largest = 0;
  if (!(file >> magic >> image.width_px >> image.height_px >> largest) || magic != "P5" || largest < 256) {
    return refuse(path, "not a PGM image of 16 bits");
  }
  if (image.width_px == 0 || image.height_px == 0 || image.height_px > kMostPixels / image.width_px) {
    return refuse(path, "too large, or empty");
  }
  file.get();  // the end of the header's line
  Bytes bytes(image.width_px * image.height_px * 2);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) {
    return refuse(path, "truncated");
  }
  image.pixels.resize(image.width_px * image.height_px);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const std::uint16_t value = get16(bytes, 2 * i);
    image.pixels[i] = big_endian ? static_cast<std::uint16_t>(value << 8 | value >> 8) : value;
  }
  return image;
}

}  // namespace

void SceneFrames::begin(const DepthMode& mode, const Intrinsics& intrinsics, std::uint32_t unit_um) {
  scene_ = std::make_unique<DepthScene>(mode.width_px, mode.height_px, intrinsics, unit_um);
}

config::Result<std::unique_ptr<FolderFrames>> FolderFrames::load(const std::filesystem::path& folder,
                                                                 std::size_t most_frames, bool big_endian) {
  std::error_code failure;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failure)) {
    if (entry.path().extension() == ".pgm") files.push_back(entry.path());
  }
  if (failure) return refuse(folder, failure.message());
  if (files.empty()) return refuse(folder, "has no *.pgm");
  std::ranges::sort(files);
  files.resize(std::min(files.size(), most_frames));
  auto frames = std::make_unique<FolderFrames>();
  for (const auto& file : files) {
    auto image = readImage(file, big_endian);
    if (!image) return std::unexpected(image.error());
    if (frames->images_.empty()) {
      frames->width_px_ = image->width_px;
      frames->height_px_ = image->height_px;
    } else if (image->width_px != frames->width_px_ || image->height_px != frames->height_px_) {
      return refuse(file, "has another size than the images before it");
    }
    frames->images_.push_back(std::move(image->pixels));
  }
  return frames;
}

void FolderFrames::begin(const DepthMode& mode, const Intrinsics& /*intrinsics*/, std::uint32_t /*unit_um*/) {
  stream_width_px_ = mode.width_px;
}

void FolderFrames::write(std::uint32_t number, std::span<std::uint16_t> frame) {
  const std::vector<std::uint16_t>& image = images_[number % images_.size()];
  if (stream_width_px_ == width_px_ && frame.size() == image.size()) {
    std::memcpy(frame.data(), image.data(), frame.size_bytes());
    return;
  }
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const std::size_t column = i % stream_width_px_, row = i / stream_width_px_;
    frame[i] = column < width_px_ && row < height_px_ ? image[row * width_px_ + column] : std::uint16_t{0};
  }
}

}  // namespace hapticd::test::uvc
