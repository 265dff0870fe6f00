// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "config/error.h"
#include "rt/depth_frame.h"

namespace hapticd::tools {

/// Whether a camera is a Kinect v1 as in recordings in libfreenect's format.
inline bool isKinect(const rt::DepthModelParameters& camera) {
  return camera == rt::DepthModelParameters{};
}

/// Consecutive depth frames of one recording or scene, all of the same camera.
struct BenchSequence {
  std::string name;
  std::vector<std::unique_ptr<rt::DepthFrame>> frames;

  /// The camera of the frames, of which there is one at least.
  const rt::DepthModelParameters& camera() const { return frames.front()->camera; }
};

/// Returns one depth frame of a tilted table and a sphere, 0.8-1.5 m away, with sensor noise.
BenchSequence syntheticScene();

/// The first `most_frames` frames of each recording in `folder`, in the order of their names: subfolders with
/// INDEX.txt or camera.yaml, or with one .tar.xz that holds such a folder (unpacked to a temporary folder and
/// removed again). Depths count within the limits that camera.yaml states, else within those of a Kinect v1.
/// Empty if the folder does not exist. Errors: a recording that cannot be read.
config::Result<std::vector<BenchSequence>> recordedSequences(const std::filesystem::path& folder,
                                                             std::size_t most_frames);

}  // namespace hapticd::tools
