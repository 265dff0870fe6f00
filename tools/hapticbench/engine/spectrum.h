// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace hapticd::tools {

/// Power over frequency of a series that is sampled at a fixed rate, by Welch's method: the mean over
/// segments of kSegment values that overlap by half, each without its mean and under a Hann window. Thread:
/// any.  RT: not safe.
class Spectrum {
 public:
  static constexpr std::size_t kSegment = 1024;

  /// `values`: at least kSegment; what is left at the end of less than half a segment is not used.
  Spectrum(std::span<const double> values, double rate_hz);

  /// Adds the power of another series of as many values at the same rate: that of a vector is the sum of
  /// those of its components.
  void add(const Spectrum& other);

  /// Root mean square of what the series holds between two frequencies, of which the upper one is at most
  /// half the rate.
  double rms(double low_hz, double high_hz) const;

  /// The sine of the largest amplitude between two frequencies that a single bin may be. One between two bins
  /// shows up to 15 % less.
  struct Line {
    double amplitude = 0;
    double frequency_hz = 0;
  };
  Line largestLine(double low_hz, double high_hz) const;

 private:
  std::size_t bin(double frequency_hz) const;

  double resolution_hz_;
  std::vector<double> power_;  ///< mean of |X|^2 from 0 to half the rate
};

}  // namespace hapticd::tools
