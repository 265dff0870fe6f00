// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// A recording in libfreenect's format in a new folder: the real one of that name below $HAPTICD_RECORDINGS
/// (or, without that variable, below the folder next to the project where recordings are kept), or a similar
/// synthetic one (made_up_recording.h). So every test has a recording wherever it runs.
class Recording {
 public:
  /// `archive`: path below that folder, e.g. "02_raw11_desk_near/desk_near.tar.xz".
  explicit Recording(const std::string& archive);
  const std::filesystem::path& path() const { return path_; }
  bool isReal() const { return is_real_; }

 private:
  TemporaryFolder folder_;
  std::filesystem::path path_;
  bool is_real_ = false;
};

}  // namespace hapticd::test
