// SPDX-License-Identifier: Apache-2.0
#include "tests/support/recordings/scratch_recording.h"

#include <fstream>
#include <stdexcept>

namespace hapticd::test {
namespace {

std::string nameOf(const std::string& host_seconds, std::uint32_t ticks) {
  return "d-" + host_seconds + "-" + std::to_string(ticks) + ".pgm";
}

}  // namespace

std::string pgmBytes(std::span<const std::uint16_t> pixels, std::string_view header) {
  std::string bytes(header);
  bytes.reserve(header.size() + 2 * pixels.size());
  for (const std::uint16_t value : pixels) {
    bytes.push_back(static_cast<char>(value & 0xff));
    bytes.push_back(static_cast<char>(value >> 8));
  }
  return bytes;
}

std::string pgmBytes(std::uint32_t frame, std::string_view header) {
  std::vector<std::uint16_t> pixels(kImagePixels);
  for (std::size_t pixel = 0; pixel < pixels.size(); ++pixel) pixels[pixel] = madeUpPixel(frame, pixel);
  return pgmBytes(pixels, header);
}

void writeFile(const std::filesystem::path& file, std::string_view content) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  stream.close();
  if (!stream) throw std::runtime_error("cannot write " + file.string());
}

std::filesystem::path ScratchRecording::add(std::uint32_t frame, const std::string& host_seconds,
                                            std::uint32_t ticks) {
  return addBytes(pgmBytes(frame), host_seconds, ticks);
}

std::filesystem::path ScratchRecording::addBytes(std::string_view bytes, const std::string& host_seconds,
                                                 std::uint32_t ticks) {
  const std::string name = nameOf(host_seconds, ticks);
  writeFile(path() / name, bytes);
  addIndexLine(name);
  return path() / name;
}

std::filesystem::path ScratchRecording::addLink(const std::filesystem::path& image,
                                                const std::string& host_seconds, std::uint32_t ticks) {
  const std::string name = nameOf(host_seconds, ticks);
  std::error_code no_link;
  std::filesystem::create_hard_link(image, path() / name, no_link);
  if (no_link) std::filesystem::copy_file(image, path() / name);
  addIndexLine(name);
  return path() / name;
}

void ScratchRecording::addIndexLine(std::string_view line) {
  lines_.emplace_back(line);
}

void ScratchRecording::writeIndex(std::string_view line_end) const {
  std::string index;
  for (const std::string& line : lines_) index.append(line).append(line_end);
  writeFile(path() / "INDEX.txt", index);
}

void fillRecording(ScratchRecording& recording, std::uint32_t frames) {
  for (std::uint32_t frame = 0; frame < frames; ++frame) {
    recording.add(frame, "1500000000." + std::to_string(100 + frame), 1000 + frame);
  }
  recording.writeIndex();
}

}  // namespace hapticd::test
