// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace hapticd::tools {

/// What is left of a value over an image when the plane that fits best is subtracted.
class PlaneResidual {
 public:
  /// x, y: from the centre of the part of the image.
  void add(double x, double y, double value) {
    if (count_ == 0) origin_ = value;
    const double v = value - origin_;
    ++count_;
    x_ += x, y_ += y, v_ += v;
    xx_ += x * x, xy_ += x * y, yy_ += y * y;
    xv_ += x * v, yv_ += y * v, vv_ += v * v;
  }
  std::size_t count() const { return count_; }
  double mean() const { return origin_ + v_ / static_cast<double>(count_); }
  /// Returns the variance around the plane; 0 with fewer than four points, or points on a line.
  double variance() const {
    const auto n = static_cast<double>(count_);
    if (count_ < 4) return 0;
    const double xx = xx_ - x_ * x_ / n, xy = xy_ - x_ * y_ / n, yy = yy_ - y_ * y_ / n;
    const double xv = xv_ - x_ * v_ / n, yv = yv_ - y_ * v_ / n, vv = vv_ - v_ * v_ / n;
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 0)) return 0;
    const double a = (xv * yy - yv * xy) / determinant;
    const double b = (yv * xx - xv * xy) / determinant;
    const double left = vv - a * xv - b * yv;
    return left > 0 ? left / (n - 3) : 0;
  }

 private:
  std::size_t count_ = 0;
  double origin_ = 0;  // the first value, which keeps the sums precise
  double x_ = 0, y_ = 0, v_ = 0, xx_ = 0, xy_ = 0, yy_ = 0, xv_ = 0, yv_ = 0, vv_ = 0;
};

}  // namespace hapticd::tools
