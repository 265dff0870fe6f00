// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

namespace hapticd::tools::crtk {

/// One message of measured_cp.
struct MeasuredPose {
  std::string frame;
  std::int64_t stamp_utc_ns = 0;
  rt::Vec3 position_m;         ///< in that frame
  rt::Quaternion orientation;  ///< maps vectors of the tool to that frame
  std::uint64_t publisher = 0;
};

/// What is wrong with a message of measured_cp.
enum class PoseFault : std::uint8_t {
  none,
  zero_stamp,       ///< by which CRTK marks invalid data
  not_finite,       ///< a position
  not_unit,         ///< an orientation whose quaternion has not the length 1
  not_newer,        ///< its stamp is not after that of the message before
  other_publisher,  ///< than that of the first message of this session
  other_frame,      ///< than that of the first message of all
};
inline constexpr std::size_t kPoseFaults = 7;

/// Accepts or rejects measurements of an arm, and counts what it rejects. Thread: one.
class PoseGate {
 public:
  /// `frame`: which all measurements must have; empty: that of the first one.
  explicit PoseGate(std::string frame) : frame_(std::move(frame)) {}

  /// From now on another publisher may measure. The frame stays: the handle's pose in hapticd's settings is
  /// that of this frame, and a force in another one points somewhere else.
  void beginSession();
  PoseFault judge(const MeasuredPose& pose);
  const std::string& frame() const { return frame_; }
  std::uint64_t rejected(PoseFault fault) const { return counts_[static_cast<std::size_t>(fault)]; }
  /// What was rejected last; none: nothing was in this session.
  PoseFault lastFault() const { return last_fault_; }

 private:
  PoseFault faultOf(const MeasuredPose& pose) const;

  std::string frame_;
  std::uint64_t publisher_ = 0;
  std::int64_t stamp_utc_ns_ = 0;
  PoseFault last_fault_ = PoseFault::none;
  std::array<std::uint64_t, kPoseFaults> counts_{};
};

/// In words, after "a measurement was rejected: ".
const char* textOf(PoseFault fault);

}  // namespace hapticd::tools::crtk
