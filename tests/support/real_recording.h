#pragma once

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// A real recording unpacked into a fresh folder: `archive` below $HAPTICD_RECORDINGS or, without that
/// variable, below the folder beside the project where recordings are kept. Nothing when it is not there.
class UnpackedRecording {
 public:
  explicit UnpackedRecording(const std::string& archive);
  bool found() const { return !path_.empty(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  TemporaryFolder folder_;
  std::filesystem::path path_;
};

}  // namespace hapticd::test
