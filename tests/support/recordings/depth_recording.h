// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "drivers/camera/recorded/recording_writer.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::test {

/// Writes a recording with camera.yaml of a scene at rest, 30 frames per second, into the folder, which must
/// not exist yet. The noise is that of the camera. `near_m`: the limit that camera.yaml states, if any.
inline void writeDepthRecording(const std::filesystem::path& folder, const rt::DepthModelParameters& camera,
                                const tools::DepthAt& depth, int frames, std::optional<double> near_m = {}) {
  constexpr std::int64_t kPeriod_ns = 33'333'333;
  const auto writer = drivers::CameraRecordingWriter::create(
      folder, {.camera = camera, .near_m = near_m, .far_m = {}, .serial = {}}, 0);
  if (!writer) throw std::runtime_error(writer.error().text());
  tools::FrameSequence sequence(camera, depth, 1);
  for (int number = 1; number <= frames; ++number) {
    const auto frame = sequence.next();
    frame->arrival_ns = number * kPeriod_ns;
    if (const auto written = (*writer)->write(*frame); !written)
      throw std::runtime_error(written.error().text());
  }
}

}  // namespace hapticd::test
