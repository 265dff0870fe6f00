// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <span>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "tools/lib/parts/fields.h"

namespace hapticd::tools {

/// Root mean square and maximum of values, none of them negative.
class Spread {
 public:
  void add(double value) {
    ++count_;
    sum_of_squares_ += value * value;
    max_ = std::max(max_, value);
  }
  void add(const Spread& other) {
    count_ += other.count_;
    sum_of_squares_ += other.sum_of_squares_;
    max_ = std::max(max_, other.max_);
  }
  std::size_t count() const { return count_; }
  /// Returns the root mean square; 0 if nothing was added.
  double rms() const { return count_ == 0 ? 0 : std::sqrt(sum_of_squares_ / static_cast<double>(count_)); }
  double max() const { return max_; }

  friend auto fieldsOf(Is<Spread> auto& spread) {
    return std::tie(spread.count_, spread.sum_of_squares_, spread.max_);
  }

 private:
  std::size_t count_ = 0;
  double sum_of_squares_ = 0;
  double max_ = 0;
};

/// Statistics of a series of values, one per millisecond, above a limit.
struct Exceedance {
  std::size_t ticks = 0;    ///< of the series
  std::size_t above = 0;    ///< of these, above the limit
  std::size_t longest = 0;  ///< the longest run of ticks above the limit without a gap
  double largest = 0;

  double percent() const;
  /// Adds the statistics of another series, as if both were one series with a gap between them.
  void add(const Exceedance& other);
};
Exceedance exceedance(std::span<const double> values, double limit);

/// Returns `part` of `whole` in percent; 0 if `whole` is 0.
template <std::integral Count>
double percentOf(Count part, Count whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Returns the quantile `share` (0..1) of `values`, by the nearest rank; 0 without values.
double quantile(std::vector<double> values, double share);

/// Standard deviation of normally distributed residuals by the median of their magnitudes, which few outliers
/// do not change.
double robustDeviation(std::vector<double> residuals);

/// Returns the root mean square; 0 without values.
double rootMeanSquare(std::span<const double> values);

/// Returns the JND of a force in newtons: 7 % of it, but at least 0.1 N.
/// (Pang, Tan and Durlach: about 7 % between 2.5 and 10 N.)
double justNoticeableDifference_n(double force_n);

/// Angle between two vectors that are not zero.
double angleBetween_deg(const rt::Vec3& a, const rt::Vec3& b);

/// How far a force may point away from the normal of the surface that was touched and still be its force.
inline constexpr double kRightDirection_deg = 30;

/// True where a force is that of the surface that was touched: within kRightDirection_deg of its normal, and
/// as large as the spring to it, to within half a newton or one JND of it, whichever is larger. Below 0.1 N,
/// which nobody notices, a direction does not count. `true_n`: the spring to the surface, along its normal.
bool isRightForce(const rt::Vec3& force_n, const rt::Vec3& true_n);

/// Errors of forces relative to the true ones, in newtons, percent, JND and degrees.
struct ForceErrors {
  Spread error_n;
  Spread error_percent;  ///< of the true force; where that is zero it does not count
  Spread error_jnd;      ///< multiples of the just noticeable difference from the true force
  Spread direction_deg;  ///< between the two; where one is too small to have a direction it does not count

  void add(const rt::Vec3& force_n, const rt::Vec3& truth_n);
  void add(const ForceErrors& other);
};
auto fieldsOf(Is<ForceErrors> auto& errors) {
  auto& [error_n, percent, jnd, direction] = errors;
  return std::tie(error_n, percent, jnd, direction);
}

/// The outcome of a push into a surface.
struct PopThrough {
  bool popped = false;           ///< the HIP popped through
  double largest_n = 0;          ///< the pop-through force where it did: the largest one before that
  std::size_t largest_tick = 0;  ///< the first tick with that force
  bool dipped = false;  ///< the force fell as if the surface gave way, but then exceeded what it was before

  /// Popped through before a force of `limit_n` was reached.
  bool under(double limit_n) const { return popped && largest_n < limit_n; }
};

/// Judges the force of a law along a push: `outward_n` is its component out of the surface tick by tick while
/// the HIP goes inward (or the surface comes towards it), `ideal_n` that of a spring to an ideal constraint,
/// which rises. The surface gives way where the force
/// - falls below half of its largest value so far, once that was at least 0.25 N (half a millimetre at
///   500 N/m, more than noise does to a force near zero), or
/// - is not outward at all although an ideal constraint pushes with 0.5 N or more.
/// Where the force later in the push exceeds that largest value, noise made the surface step back for a
/// moment, but it has held. Both spans are of the same length.
PopThrough judgePush(std::span<const double> outward_n, std::span<const double> ideal_n);

/// The largest force of the paper's springs in front of a plane without noise that faces the camera
/// `depth_m` away, newtons: the force at which they let the HIP through. In closed form, the mean over the
/// disc that holds the nearest `max_points` pixels.
double popThroughForceOnPlane_n(const rt::SpringParameters& springs, const rt::DepthModelParameters& camera,
                                double depth_m);

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
