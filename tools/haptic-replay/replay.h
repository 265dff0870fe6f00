// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "drivers/camera/depth_use.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/handle/velocity_estimator.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "rt/loop/loop_state.h"
#include "tools/lib/offline/offline_box.h"

namespace hapticd::tools {

/// One row of a HIP file.
struct HipSample {
  double time_s;
  rt::Vec3 hip_m_in_world;
};

/// Reads a file with the header `t_s,x_m,y_m,z_m` and one sample per line, as PointTable does.
/// Errors: every bad line, with its number, value and allowed range.
std::expected<std::vector<HipSample>, std::vector<base::Error>> readHipCsv(const std::filesystem::path& file);

/// The depth frames of a recording, or a single depth frame that is used at all times.
class DepthSource {
 public:
  /// `path`: the folder of a recording, or a .pgm file as libfreenect's recorder writes it. `limits`:
  /// accepted depths of a camera that the recording describes.
  static base::Result<DepthSource> open(const std::filesystem::path& path,
                                        const drivers::DepthLimits& limits = {});

  /// Index (from 0) of the newest frame that had arrived at `time_ns` >= 0, since the first frame; 0 for a
  /// single image.
  std::size_t frameAt(std::int64_t time_ns) const;
  /// Whether it is a single image, which counts as just arrived at any time. The frames of a recording have
  /// their arrival since the first one.
  bool isImage() const { return !recording_; }
  /// Returns the camera that the recording describes; nothing for a Kinect v1.
  std::optional<rt::DepthModelParameters> camera() const {
    return recording_ ? recording_->camera() : std::nullopt;
  }
  base::Result<void> read(std::size_t index, rt::DepthFrame& frame) const;
  std::size_t frames() const { return recording_ ? recording_->frames().size() : 1; }
  /// Why the last line of the recording's index was left out; empty: it was not.
  std::string cutOff() const { return recording_ ? recording_->cutOff() : ""; }

 private:
  DepthSource() = default;

  std::optional<drivers::RecordingReader> recording_;
  std::filesystem::path image_;
};

/// The stage whose force is written to the output.
enum class Stage {
  law,      ///< the bare law
  command,  ///< what a device would get: engaged, after the safety chain
};

/// The force at one sample.
struct ReplayedForce {
  rt::Vec3 force_n_in_world;
  std::uint32_t points_used = 0;
  std::size_t frame = 0;  ///< index of the frame that the force is of, from 0
};

/// Why whole frames of this depth cannot be modelled: their raw values or their voxels are too many. Nothing
/// if they can.
std::optional<base::Error> wholeFrameProblem(const config::Settings& settings, const DepthSource& source);

/// The daemon's core without its clock: the same model, law and safety chain, at given times.
class Replay {
 public:
  /// `handle_delay_s`: that the driver of the handle would report (rt::HandleState::delay_s). `labels`: of
  /// the label image (config::loadLabelImage), for the tissue regions of the settings; empty: none.
  Replay(const config::Settings& settings, const DepthSource& source, Stage stage, double handle_delay_s = 0,
         const config::LabelImage& labels = {}, config::SolidTable solids = {});

  /// Where force.law is auto, the law follows from the distance of the first HIP.
  /// `sample.time_s` must not decrease from call to call at the stage `command`.
  /// A frame that cannot be read is skipped, as the daemon does: the one before stays, or the first readable
  /// one begins earlier. Errors: no frame can be read.
  base::Result<ReplayedForce> feel(const HipSample& sample);

  std::uint64_t models() const noexcept { return box_.models(); }
  /// What is wrong with the depth that was used, in words with a remedy; empty: nothing.
  std::vector<std::string> depthProblems() const;

 private:
  base::Result<void> takeFrame(std::int64_t time_ns);
  base::Result<std::size_t> readFrame(std::size_t index);
  bool readOne(std::size_t index);
  void showFrame(std::size_t index, std::int64_t time_ns);
  void decideLaw(const rt::Vec3& hip_m_in_world);
  rt::Tick command(const HipSample& sample, std::int64_t time_ns);

  config::Settings settings_;
  const DepthSource& source_;
  Stage stage_;
  OfflineBox box_;
  drivers::VelocityEstimator velocity_;  // of the HIP, as the drivers estimate the hand's
  double handle_delay_s_;
  std::unique_ptr<rt::DepthFrame> frame_;
  std::unique_ptr<rt::DepthFrame> spare_;  // for the next one
  drivers::DepthUseWatch depth_use_;
  std::map<std::size_t, base::Error> damaged_;  // why a frame could not be read, by its index
  std::size_t frame_index_ = 0;                 // of the frame that is shown
  std::size_t wanted_index_ = 0;                // of the newest one at that time
  bool frame_taken_ = false;
  std::optional<double> last_time_s_;  // of the sample before, at the stage `command`
  bool law_decided_ = false;
  config::SolidTable solids_;
  std::unique_ptr<rt::FixtureSet> fixtures_;
  std::unique_ptr<rt::TissueMap> tissue_;
};

}  // namespace hapticd::tools
