#include "scratch_recording.h"

#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "rt/depth_frame.h"

namespace hapticd::drivers::test {

std::string pgmBytes(std::uint32_t frame, std::string_view header) {
  std::string bytes(header);
  bytes.reserve(header.size() + 2 * rt::kFramePixels);
  for (std::size_t pixel = 0; pixel < rt::kFramePixels; ++pixel) {
    const std::uint16_t value = madeUpPixel(frame, pixel);
    bytes.push_back(static_cast<char>(value & 0xff));
    bytes.push_back(static_cast<char>(value >> 8));
  }
  return bytes;
}

void writeFile(const std::filesystem::path& file, std::string_view content) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  stream.close();
  if (!stream) throw std::runtime_error("cannot write " + file.string());
}

std::filesystem::path ScratchRecording::add(std::uint32_t frame, const std::string& host_seconds,
                                            std::uint32_t ticks) {
  const std::string name = "d-" + host_seconds + "-" + std::to_string(ticks) + ".pgm";
  writeFile(path() / name, pgmBytes(frame));
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

UnpackedRecording::UnpackedRecording(const std::string& archive) {
  const char* const folder = std::getenv("HAPTICD_RECORDINGS");
  const std::filesystem::path file =
      std::filesystem::path(folder != nullptr ? folder : HAPTICD_DEFAULT_RECORDINGS) / archive;
  if (!std::filesystem::exists(file)) return;
  const std::string command = "tar xJf '" + file.string() + "' -C '" + folder_.path().string() + "'";
  if (std::system(command.c_str()) != 0) throw std::runtime_error("cannot unpack " + file.string());
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
    if (entry.path().filename() == "INDEX.txt") path_ = entry.path().parent_path();
  }
}

}  // namespace hapticd::drivers::test
