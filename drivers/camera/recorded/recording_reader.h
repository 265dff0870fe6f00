// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "drivers/camera/recorded/frame_list.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// Depths that a configuration accepts, in metres; those of a Kinect v1 by default.
struct DepthLimits {
  double near_m = rt::DepthModelParameters{}.near_m;
  double far_m = rt::DepthModelParameters{}.far_m;
};

/// The depth frames of a recording, which is a folder of one of two forms; README.md describes them.
///
/// With INDEX.txt it has libfreenect's format and is of a Kinect v1: the index lists one file per line in
/// playback order, `d-<host seconds>-<device ticks>` and any ending for depth. Lines of colour (`r-`) and
/// tilt (`a-`) are ignored. With camera.yaml it is of any camera, and frames.csv lists the frames. Where the
/// host's clock was set back, the time stands still until it catches up; a gap of more than a day counts as a
/// frame period. A last line that was cut off is left out.
///
/// Thread: any; several threads may call read() with separate frames.  RT: not safe.
class RecordingReader {
 public:
  /// Checks the folder, the index, the camera and that each depth file exists; read() checks the images.
  /// `limits`: accepted depths of a camera from camera.yaml, besides its own.
  /// Errors: name the line of the index and the remedy.
  static base::Result<RecordingReader> open(const std::filesystem::path& folder,
                                            const DepthLimits& limits = {});

  /// Returns all frames; never empty.
  const std::vector<RecordedFrame>& frames() const { return frames_; }
  const std::filesystem::path& folder() const { return folder_; }
  /// Returns the camera from camera.yaml with the accepted depths; nothing for libfreenect's format.
  const std::optional<rt::DepthModelParameters>& camera() const { return camera_; }
  /// Why the last line of the index was left out: the recording ended while it was written. Empty: it was
  /// not.
  const std::string& cutOff() const { return cut_off_; }
  /// Serial number from camera.yaml; empty if it is not known.
  const std::string& serial() const { return serial_; }

  /// Reads frame `index` (below frames().size()). Sets raw, sequence = index + 1, arrival_ns = its host_ns,
  /// device_ticks, and camera if camera() is known. exposure_ns is relative to the first frame as arrival_ns
  /// is, and may be below 0.  Errors: see readKinectImage() and readDepthImage().
  base::Result<void> read(std::size_t index, rt::DepthFrame& frame) const;

 private:
  RecordingReader(std::filesystem::path folder, std::vector<RecordedFrame> frames)
      : folder_(std::move(folder)), frames_(std::move(frames)) {}

  static base::Result<RecordingReader> openKinect(const std::filesystem::path& folder);
  static base::Result<RecordingReader> openCamera(const std::filesystem::path& folder,
                                                  const DepthLimits& limits);

  std::filesystem::path folder_;
  std::vector<RecordedFrame> frames_;
  std::optional<rt::DepthModelParameters> camera_;
  std::string cut_off_;
  std::string serial_;
};

}  // namespace hapticd::drivers
