// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

namespace hapticd::test {

/// What a made-up recording shows, through the noise of the synthetic camera's sensor: quantised, correlated,
/// with pixels that flicker and columns that are dead.
enum class MadeUpScene {
  room,     ///< a ball in front of a tilted wall; nothing moves
  gesture,  ///< the same, but that the ball comes to 0.75 m and goes
  desk,  ///< a block at rest fills the left half, 0.52 m away; in front of it a ball comes to 0.42 m and goes
};

/// "room", "gesture" or "desk".
std::optional<MadeUpScene> madeUpSceneFrom(std::string_view name);

/// Fills `folder`, which exists, with a recording in libfreenect's format of `frames` frames at 30 Hz. The
/// same bytes each time. Throws where it cannot be written.
void makeRecording(MadeUpScene scene, std::uint32_t frames, const std::filesystem::path& folder);

}  // namespace hapticd::test
