// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/base/vec3.h"

namespace hapticd::drivers {

/// Velocity of a sampled position: the slope of the least-squares line over an adaptive window, per axis
/// (first-order adaptive windowing, Janabi-Sharifi, Hayward, Chen, "Discrete-time adaptive windowing for
/// velocity estimation", IEEE Trans. Control Systems Technology 8(6), 2000). The window is the longest one,
/// of 2 to kMaxSamples samples and at most kMaxLineNs, whose line stays within the resolution of every
/// sample in it: long and quiet when the hand is slow, short and quick when it accelerates.
///
/// With n samples at the period T and independent noise of standard deviation s, the slope lags by (n-1) T /
/// 2 and has the standard deviation s / T * sqrt(12 / (n (n^2 - 1))): n = 2: 0.5 T and 1.41 s/T; n = 3: T and
/// 0.71 s/T. At constant velocity it has no bias.
///
/// Contact damping (rt/safety/stiffness_limit.h) acts on this velocity, so its lag adds to that of the loop:
/// in closed loop (hapticbench stability) a free device of 45 g with an encoder of 55 um and 5 ms of delay
/// comes to rest within two encoder steps with lines of up to 2 ms; with lines of 15 ms, which fit slow
/// oscillations, it oscillates by millimetres.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class VelocityEstimator {
 public:
  static constexpr std::size_t kMaxSamples = 16;
  /// Longest line of more than two samples: two periods of a device at 1 kHz whose clock may be off by a
  /// quarter of a period. rt::kVelocityLag_s is half of the two periods.
  static constexpr std::int64_t kMaxLineNs = 2'500'000;
  /// Samples older than this relative to the newest one are discarded: the device paused.
  static constexpr std::int64_t kMaxWindowNs = 100'000'000;

  /// `resolution_m`: largest error of a position by rounding and noise, above zero.
  explicit VelocityEstimator(double resolution_m) : resolution_m_(resolution_m) {}

  /// Adds a sample and returns the velocity in m/s; zero for the first sample. Earlier samples with the same
  /// or a later `time_ns` are discarded: the device's clock went back.
  rt::Vec3 add(const rt::Vec3& position_m, std::int64_t time_ns);

  /// Discards all samples.
  void reset() { count_ = 0; }

 private:
  struct Sample {
    rt::Vec3 position_m;
    std::int64_t time_ns = 0;
  };

  const Sample& newest(std::size_t age) const {
    return samples_[(next_ + kMaxSamples - 1 - age) % kMaxSamples];
  }
  double slope(double rt::Vec3::*axis) const;

  double resolution_m_;
  std::array<Sample, kMaxSamples> samples_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

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
