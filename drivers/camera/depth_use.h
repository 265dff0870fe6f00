// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"

namespace hapticd::drivers {

/// What the force laws can use of a frame.
struct DepthUse {
  std::uint64_t frame = 0;     ///< its number
  std::size_t measured = 0;    ///< pixels with a measurement
  std::size_t usable = 0;      ///< of them, with a depth between near and far
  bool looks_swapped = false;  ///< the two bytes of its raw values seem to be swapped
  std::size_t if_swapped = 0;  ///< usable pixels with the bytes swapped, if it looks so

  /// `model`: of the frame's camera.  Thread: any.
  static DepthUse of(const rt::DepthFrame& frame, const rt::DepthModel& model);
};

/// Notices a stream of depth that cannot give a force, although its frames are intact.
/// Thread: one.
class DepthUseWatch {
 public:
  void add(const DepthUse& use);

  /// What is wrong with the newest frames, in words with a remedy; empty: nothing, or there are too few.
  std::string newest() const;
  /// What is wrong with all frames; for a swapped one, it is enough that it is there.
  std::string all() const;

 private:
  /// Frames without a usable pixel before that is reported of a live stream, where a hand may pass by.
  static constexpr std::uint64_t kMin = 10;

  std::uint64_t frames_ = 0;
  std::uint64_t unusable_ = 0;         ///< frames without a usable pixel
  std::uint64_t unusable_in_row_ = 0;  ///< up to the newest
  bool measured_ = false;              ///< one of these has measurements
  DepthUse last_;
  DepthUse swapped_;  ///< the first frame that looks so
};

}  // namespace hapticd::drivers
