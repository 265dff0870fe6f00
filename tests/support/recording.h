// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// A recording in libfreenect's format, in a fresh folder: the real one of that name below
/// $HAPTICD_RECORDINGS (or, without that variable, below the folder beside the project where recordings are
/// kept), or one made by code that shows the like of it (made_up_recording.h). So every test has one wherever
/// it runs.
class Recording {
 public:
  /// `archive`: "02_raw11_desk_near/desk_near.tar.xz", the path below that folder.
  explicit Recording(const std::string& archive);
  const std::filesystem::path& path() const { return path_; }
  bool isReal() const { return is_real_; }

 private:
  TemporaryFolder folder_;
  std::filesystem::path path_;
  bool is_real_ = false;
};

}  // namespace hapticd::test
