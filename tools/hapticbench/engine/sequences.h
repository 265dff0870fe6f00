// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "config/base/error.h"
#include "rt/depth/depth_frame.h"
#include "tools/hapticbench/engine/laws.h"

namespace hapticd::tools {

/// A folder below the system's temporary one that is removed with the object. Its path is empty where it
/// could not be made.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "hapticbench-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

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
base::Result<std::vector<BenchSequence>> recordedSequences(const std::filesystem::path& folder,
                                                           std::size_t most_frames);

/// The tick at which each frame arrives, 0 for the first: by a Kinect's own counter, else by the times of
/// arrival, so that frames that were lost while recording leave a gap; where neither counts, 30 frames per
/// second.
std::vector<long> arrivalTicks(const BenchSequence& session);

/// A session that is played forwards and backwards in turn, without end: what is at rest never
/// jumps, what moves turns round. Each frame gets a number of its own.
/// Thread: one.  RT: not safe.
class PlayedSession {
 public:
  /// `session`: two frames or more, outlives the object. `first`: of the frames, where playing begins.
  explicit PlayedSession(const BenchSequence& session, int first = 0);

  /// Returns the frame of the session that is played with this index.
  int frameOfSession(int index) const;
  const rt::DepthFrame& frame(int index);
  long arrivalTick(int index) const;

  /// This session for a FramePlayer, which the object outlives.
  FrameStream stream();

 private:
  static constexpr int kBuffers = 4;  // a box keeps the newest frame alone

  const BenchSequence& session_;
  int first_;
  std::vector<long> arrival_ticks_;
  std::array<std::unique_ptr<rt::DepthFrame>, kBuffers> shown_;
};

}  // namespace hapticd::tools
