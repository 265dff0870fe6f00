#include "tests/support/real_recording.h"

#include <cstdlib>
#include <stdexcept>

namespace hapticd::test {

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

}  // namespace hapticd::test
