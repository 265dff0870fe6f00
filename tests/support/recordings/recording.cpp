// SPDX-License-Identifier: Apache-2.0
#include "tests/support/recordings/recording.h"

#include <cstdlib>
#include <stdexcept>

#include "tests/support/recordings/made_up_recording.h"

namespace hapticd::test {
namespace {

constexpr std::uint32_t kMadeUpFrames = 30;

std::filesystem::path fileOf(const std::string& archive) {
  const char* const folder = std::getenv("HAPTICD_RECORDINGS");
  return std::filesystem::path(folder != nullptr ? folder : HAPTICD_DEFAULT_RECORDINGS) / archive;
}

/// Returns the synthetic scene most similar to a real recording, identified by the number at the beginning of
/// its name.
MadeUpScene likeThatOf(const std::string& archive) {
  if (archive.starts_with("01_")) return MadeUpScene::gesture;
  return archive.starts_with("02_") ? MadeUpScene::desk : MadeUpScene::room;
}

std::filesystem::path unpacked(const std::filesystem::path& file, const std::filesystem::path& folder) {
  const std::string command = "tar xJf '" + file.string() + "' -C '" + folder.string() + "'";
  if (std::system(command.c_str()) != 0) throw std::runtime_error("cannot unpack " + file.string());
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().filename() == "INDEX.txt") return entry.path().parent_path();
  }
  throw std::runtime_error("there is no INDEX.txt in " + file.string());
}

}  // namespace

Recording::Recording(const std::string& archive) {
  const std::filesystem::path file = fileOf(archive);
  is_real_ = std::filesystem::exists(file);
  if (is_real_) {
    path_ = unpacked(file, folder_.path());
  } else {
    path_ = folder_.path();
    makeRecording(likeThatOf(archive), kMadeUpFrames, path_);
  }
}

}  // namespace hapticd::test
