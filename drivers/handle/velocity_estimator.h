// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/vec3.h"

namespace hapticd::drivers {

/// Velocity of a sampled position: the slope of the least-squares line over an adaptive window, per axis
/// (first-order adaptive windowing, Janabi-Sharifi, Hayward, Chen, "Discrete-time adaptive windowing for
/// velocity estimation", IEEE Trans. Control Systems Technology 8(6), 2000). The window is the longest one,
/// of 2 to kMostSamples samples and no longer than kLongestLineNs, whose line passes no sample in it by more
/// than the resolution: long and quiet where the hand is slow, short and quick where it accelerates.
///
/// With n samples at the period T and independent noise of standard deviation s the slope lags by (n-1) T / 2
/// and has the standard deviation s / T * sqrt(12 / (n (n^2 - 1))): n = 2: 0.5 T and 1.41 s/T; n = 3: T and
/// 0.71 s/T. At constant velocity it has no bias.
///
/// The damping in contact (rt/stiffness_limit.h) acts on this velocity, so its lag counts with the loop's:
/// in closed loop (hapticbench stability) 45 g that nobody holds, with an encoder of 55 um and 5 ms of delay,
/// come to rest with lines of up to 2 ms, within two steps of the encoder; with lines of 15 ms, which slow
/// swings fit, they swing by millimetres.
/// Thread: one.  Progress: wait-free.  RT: safe.
class VelocityEstimator {
 public:
  static constexpr std::size_t kMostSamples = 16;
  /// A line of more than two samples is no longer than that: two periods of a device at 1 kHz whose clock may
  /// be off by a quarter of one.
  static constexpr std::int64_t kLongestLineNs = 2'500'000;
  /// Older samples than this before the newest are forgotten: the device paused.
  static constexpr std::int64_t kLongestWindowNs = 100'000'000;

  /// `resolution_m`: how far a position may be off by rounding and noise, above zero.
  explicit VelocityEstimator(double resolution_m) : resolution_m_(resolution_m) {}

  /// Takes a sample over and returns the velocity, m/s; zero at the first sample. Samples that `time_ns` does
  /// not come after are forgotten: the device's clock went back.
  rt::Vec3 add(const rt::Vec3& position_m, std::int64_t time_ns);

  /// Forgets all samples.
  void reset() { count_ = 0; }

 private:
  struct Sample {
    rt::Vec3 position_m;
    std::int64_t time_ns = 0;
  };

  const Sample& newest(std::size_t age) const {
    return samples_[(next_ + kMostSamples - 1 - age) % kMostSamples];
  }
  double slope(double rt::Vec3::*axis) const;

  double resolution_m_;
  std::array<Sample, kMostSamples> samples_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace hapticd::drivers
