// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/base/vec3.h"

namespace hapticd::drivers {

/// Interpolates a position that a device measures in steps, such as those of an encoder, per axis, while the
/// hand moves steadily. A hand feels the frequency of the steps: those of 50 um at 500 N/m are 25 mN.
///
/// The hand moves steadily if the line of least squares through the last kLineNs passes within a step of all
/// of them, and is so steep that a step takes at most kLongestStepNs; slower steps are not felt. The position
/// moves over to that line within a few samples, and back where the hand does otherwise. It is never farther
/// than half a step from the measured one, thus off the true one by at most a step.
///
/// Where the motion is not steady the measured position stays as it is, because an interpolation with a
/// hysteresis of a step, or one that expects an oscillating device to go on as it did, feeds oscillations: a
/// free device of 45 g, which comes to rest within two steps (hapticbench stability), would oscillate by 0.2
/// mm with lines of slower motion, and by millimetres with a hysteresis.
///
/// Positions of a device that measures more than kSamples times in kLineNs, 2.6 kHz, stay as they are.
///
/// Thread: one.  Progress: wait-free.  RT: safe.  Cost: proportional to the samples in kLineNs, at most
/// kSamples.
class PositionTracker {
 public:
  static constexpr std::size_t kSamples = 64;
  static constexpr std::int64_t kLineNs = 24'000'000;
  static constexpr std::int64_t kLongestStepNs = 8'000'000;
  /// Measurements farther apart are not connected: the device paused.
  static constexpr std::int64_t kMaxGapNs = 50'000'000;

  /// `step_m`: 0 or above; 0: the position is exact.
  explicit PositionTracker(double step_m) : step_m_(step_m) {}

  /// Adds a measurement and returns the position at `time_ns`. Where that is not after the last one, or more
  /// than kMaxGapNs later, earlier measurements are discarded;
  /// a position that is not finite is returned and discards all.
  rt::Vec3 add(const rt::Vec3& position_m, std::int64_t time_ns);

  /// Discards all measurements.
  void reset() { count_ = 0; }

 private:
  struct Sample {
    rt::Vec3 position_m;
    std::int64_t time_ns = 0;
  };

  const Sample& sample(std::size_t age) const { return samples_[(newest_ + kSamples - age) % kSamples]; }
  std::size_t samplesOfLine() const;
  double interpolated(double rt::Vec3::*axis, std::size_t samples);

  double step_m_;
  std::array<Sample, kSamples> samples_;
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
  rt::Vec3 share_;  ///< of the line in each axis, 0..1
};

}  // namespace hapticd::drivers
