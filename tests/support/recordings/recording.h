// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// Content of a synthetic recording, seen through the noise of the synthetic camera's sensor: quantised,
/// correlated, with flickering pixels and dead columns.
enum class MadeUpScene {
  room,     ///< a ball in front of a tilted wall; nothing moves
  gesture,  ///< the same, but the ball approaches to 0.75 m and recedes
  /// A block at rest fills the left half at 0.52 m; in front of it a ball approaches to 0.42 m and recedes.
  desk,
};

/// Parses "room", "gesture" or "desk".
std::optional<MadeUpScene> madeUpSceneFrom(std::string_view name);

/// Fills an existing folder with a recording in libfreenect's format of `frames` frames at 30 Hz, with the
/// same bytes each time. Throws if it cannot be written.
void makeRecording(MadeUpScene scene, std::uint32_t frames, const std::filesystem::path& folder);

/// A recording in libfreenect's format in a new folder: the real one of that name below $HAPTICD_RECORDINGS
/// (or, without that variable, below the folder next to the project where recordings are kept), or a similar
/// synthetic one. So every test has a recording wherever it runs.
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
