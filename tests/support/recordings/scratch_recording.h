// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/made_up_pixel.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

inline constexpr std::string_view kPgmHeader = "P5 640 480 65535\n";
inline constexpr std::size_t kImagePixels = 640 * 480;

/// Returns header and pixels in libfreenect's format.
std::string pgmBytes(std::span<const std::uint16_t> pixels, std::string_view header = kPgmHeader);
/// Returns the same for a synthetic frame.
std::string pgmBytes(std::uint32_t frame, std::string_view header = kPgmHeader);

void writeFile(const std::filesystem::path& file, std::string_view content);

/// A recording in libfreenect's format made by a test.
class ScratchRecording {
 public:
  const std::filesystem::path& path() const { return folder_.path(); }
  /// Adds a synthetic frame to the files and to the index (in memory until writeIndex()). Returns its file.
  std::filesystem::path add(std::uint32_t frame, const std::string& host_seconds, std::uint32_t ticks);
  /// Adds a frame with these bytes as its file.
  std::filesystem::path addBytes(std::string_view bytes, const std::string& host_seconds,
                                 std::uint32_t ticks);
  /// Adds a frame with an existing file, without copying it where the file system supports links.
  std::filesystem::path addLink(const std::filesystem::path& image, const std::string& host_seconds,
                                std::uint32_t ticks);
  void addIndexLine(std::string_view line);
  void writeIndex(std::string_view line_end = "\n") const;

 private:
  TemporaryFolder folder_;
  std::vector<std::string> lines_;
};

/// Adds `frames` (at most 900) synthetic frames, 1 ms apart, with ticks 1000, 1001, ...
void fillRecording(ScratchRecording& recording, std::uint32_t frames);

}  // namespace hapticd::test
