#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "made_up_pixel.h"
#include "temporary_folder.h"

namespace hapticd::drivers::test {

inline constexpr std::string_view kPgmHeader = "P5 640 480 65535\n";

/// Header and pixels of a made-up frame in libfreenect's format.
std::string pgmBytes(std::uint32_t frame, std::string_view header = kPgmHeader);

void writeFile(const std::filesystem::path& file, std::string_view content);

/// A recording in libfreenect's format, made by the test.
class ScratchRecording {
 public:
  const std::filesystem::path& path() const { return folder_.path(); }
  /// Adds a frame to the files and to the index (in memory until writeIndex()). Returns its file.
  std::filesystem::path add(std::uint32_t frame, const std::string& host_seconds, std::uint32_t ticks);
  void addIndexLine(std::string_view line);
  void writeIndex(std::string_view line_end = "\n") const;

 private:
  TemporaryFolder folder_;
  std::vector<std::string> lines_;
};

/// `frames` (at most 900) made-up frames, 1 ms apart, with ticks 1000, 1001, ...
void fillRecording(ScratchRecording& recording, std::uint32_t frames);

/// A real recording unpacked into a fresh folder: `archive` below $HAPTICD_RECORDINGS or its default. Nothing
/// when it is not there.
class UnpackedRecording {
 public:
  explicit UnpackedRecording(const std::string& archive);
  bool found() const { return !path_.empty(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  TemporaryFolder folder_;
  std::filesystem::path path_;
};

}  // namespace hapticd::drivers::test
