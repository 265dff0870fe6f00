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

/// Consecutive depth frames of one recording or scene.
struct BenchSequence {
  std::string name;
  std::vector<std::unique_ptr<rt::DepthFrame>> frames;
};

/// Returns one depth frame of a tilted table and a sphere, 0.8-1.5 m away, with sensor noise.
BenchSequence syntheticScene();

/// The first `most_frames` frames of each recording in `folder`, in the order of their names: subfolders with
/// INDEX.txt, or with one .tar.xz that holds such a folder (unpacked to a temporary folder and removed
/// again). Empty if the folder does not exist. Errors: a recording that cannot be read.
config::Result<std::vector<BenchSequence>> recordedSequences(const std::filesystem::path& folder,
                                                             std::size_t most_frames);

}  // namespace hapticd::tools
