// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "rt/depth/depth_model.h"
#include "tools/hapticbench/disparity.h"
#include "tools/hapticbench/sweep.h"
#include "tools/lib/offline/offline_box.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kAround_m = 0.05;  // of a site, that must be still and flat
constexpr int kSpacing_px = 24;     // of the positions that are tried
constexpr double kFarthest_m = 3.5;
constexpr double kMinCosine = 0.7;  // of incidence: noise along an oblique surface is another matter

/// Means over the frames and how steady they are.
class StillImage {
 public:
  explicit StillImage(const BenchSequence& sequence) : image_(cameraWithNoise(sequence)) {
    constexpr double kSteady_raw = 4;  // largest minus smallest: a Kinect's noise alone
    const std::size_t pixels = sequence.frames.front()->pixels();
    mean_raw_.resize(pixels);
    is_still_.resize(pixels);
    const std::size_t enough = sequence.frames.size() * 9 / 10;
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      float smallest = std::numeric_limits<float>::infinity(), largest = -smallest;
      double sum = 0;
      std::size_t count = 0;
      for (const auto& frame : sequence.frames) {
        const float disparity = image_.of(frame->raw[pixel]);
        if (std::isnan(disparity)) continue;
        smallest = std::min(smallest, disparity);
        largest = std::max(largest, disparity);
        sum += double{disparity};
        ++count;
      }
      if (count == 0) continue;
      mean_raw_[pixel] = sum / static_cast<double>(count);
      is_still_[pixel] =
          count >= enough && double{largest - smallest} <= kSteady_raw * image_.noiseScale(mean_raw_[pixel]);
    }
  }

  const rt::DepthModel& model() const { return image_.model(); }
  bool isStill(int column, int row) const { return is_still_[image_.pixelOf(column, row)]; }
  /// The point at the mean disparity.
  Vec3 point_m(int column, int row) const {
    return image_.pointOf(column, row, mean_raw_[image_.pixelOf(column, row)]);
  }

 private:
  CameraDisparity image_;
  std::vector<double> mean_raw_;
  std::vector<bool> is_still_;
};

/// Least squares z = a x + b y + c around the first point's x and y.
class PlaneFit {
 public:
  explicit PlaneFit(const Vec3& origin) : origin_(origin) {}

  void add(const Vec3& point) {
    const double x = point.x - origin_.x, y = point.y - origin_.y, z = point.z - origin_.z;
    n_ += 1;
    x_ += x, y_ += y, z_ += z;
    xx_ += x * x, xy_ += x * y, yy_ += y * y;
    xz_ += x * z, yz_ += y * z, zz_ += z * z;
  }
  struct Plane {
    double a, b, c;
    double rms_m;
  };
  std::optional<Plane> solve() const {
    const double cxx = xx_ - x_ * x_ / n_, cxy = xy_ - x_ * y_ / n_, cyy = yy_ - y_ * y_ / n_;
    const double cxz = xz_ - x_ * z_ / n_, cyz = yz_ - y_ * z_ / n_, czz = zz_ - z_ * z_ / n_;
    const double determinant = cxx * cyy - cxy * cxy;
    if (n_ < 10 || determinant <= 0) return std::nullopt;
    const double a = (cxz * cyy - cyz * cxy) / determinant;
    const double b = (cyz * cxx - cxz * cxy) / determinant;
    const double rest = std::max(0.0, czz - a * cxz - b * cyz);
    return Plane{a, b, (z_ - a * x_ - b * y_) / n_, std::sqrt(rest / n_)};
  }

 private:
  Vec3 origin_;
  double n_ = 0, x_ = 0, y_ = 0, z_ = 0, xx_ = 0, xy_ = 0, yy_ = 0, xz_ = 0, yz_ = 0, zz_ = 0;
};

std::optional<StillSite> siteAt(const StillImage& image, std::size_t sequence, int column, int row) {
  const rt::DepthModelParameters& model = image.model().parameters();
  if (!image.isStill(column, row)) return std::nullopt;
  const Vec3 middle = image.point_m(column, row);
  const double depth = -middle.z;
  if (depth < model.near_m + kAround_m || depth > kFarthest_m) return std::nullopt;
  const int half_px = static_cast<int>(std::ceil(kAround_m * model.fx_px / depth));
  if (column < half_px || row < half_px || column + half_px >= model.width_px ||
      row + half_px >= model.height_px) {
    return std::nullopt;
  }
  PlaneFit fit(middle);
  int still = 0, all = 0;
  for (int v = row - half_px; v <= row + half_px; v += 2) {
    for (int u = column - half_px; u <= column + half_px; u += 2) {
      ++all;
      if (!image.isStill(u, v)) continue;
      ++still;
      fit.add(image.point_m(u, v));
    }
  }
  const auto plane = fit.solve();
  if (still < all * 9 / 10 || !plane || plane->rms_m > image.model().noiseUnit_m(depth) + 0.002)
    return std::nullopt;
  const double length = std::sqrt(plane->a * plane->a + plane->b * plane->b + 1);
  const Vec3 normal{-plane->a / length, -plane->b / length, 1 / length};
  if (-dot(normal, middle) < kMinCosine * norm(middle)) return std::nullopt;
  return StillSite{sequence, middle + Vec3{0, 0, plane->c}, normal};
}

}  // namespace

std::vector<StillSite> stillSites(const std::vector<BenchSequence>& sequences, std::size_t sequence,
                                  std::size_t count) {
  const StillImage image(sequences[sequence]);
  std::vector<StillSite> sites;
  for (int row = kSpacing_px / 2; row < image.model().height_px(); row += kSpacing_px) {
    for (int column = kSpacing_px / 2; column < image.model().width_px(); column += kSpacing_px) {
      if (const auto site = siteAt(image, sequence, column, row)) sites.push_back(*site);
    }
  }
  std::stable_sort(sites.begin(), sites.end(), [](const StillSite& a, const StillSite& b) {
    return a.surface_m_in_world.z > b.surface_m_in_world.z;
  });
  if (sites.size() > count) sites.resize(count);
  return sites;
}

std::string digestOf(const std::vector<BenchSequence>& sequences) {
  std::uint64_t digest = 0xcbf29ce484222325;
  for (const BenchSequence& sequence : sequences) {
    for (const auto& frame : sequence.frames) {
      for (const std::uint16_t raw : frame->image()) digest = (digest ^ raw) * 0x100000001b3;
    }
  }
  return fmt::format("{:016x}", digest);
}

NoiseProbe::NoiseProbe(std::vector<BenchSequence> sequences, std::size_t sites_per_sequence)
    : sequences_(std::move(sequences)) {
  for (std::size_t i = 0; i < sequences_.size(); ++i) {
    const auto sites = stillSites(sequences_, i, sites_per_sequence);
    sites_.insert(sites_.end(), sites.begin(), sites.end());
  }
}

ForceNoise NoiseProbe::measure(const rt::LiveParameters& parameters, double h_m) const {
  ForceNoise noise;
  std::vector<double> deviations_n;
  for (const StillSite& site : sites_) {
    const double deviation = deviation_n(parameters, site, h_m);
    if (deviation < 0) continue;
    deviations_n.push_back(deviation);
  }
  if (deviations_n.empty()) return noise;
  std::sort(deviations_n.begin(), deviations_n.end());
  noise.median_n = deviations_n[deviations_n.size() / 2];
  noise.largest_n = deviations_n.back();
  noise.sites = deviations_n.size();
  return noise;
}

/// -1 where the law gives no force.
double NoiseProbe::deviation_n(const rt::LiveParameters& parameters, const StillSite& site,
                               double h_m) const {
  constexpr double kStep_m = 0.001;
  constexpr int kTicksPerFrame = 3;  // a proxy may take more than one to rest
  constexpr double kFelt_n = 0.1;
  OfflineBox box(sequences_[site.sequence].camera(), {}, {});
  box.parameters() = parameters;
  const auto at = [&site](double h) { return site.surface_m_in_world + h * site.normal_in_world; };
  const auto& frames = sequences_[site.sequence].frames;
  box.show(*frames.front());
  for (double h = parameters.force.radius_m + 0.03; h > h_m; h -= kStep_m) box.lawForce(at(h));
  Vec3 sum;
  double squares = 0;
  const std::size_t settled = frames.size() / 3;  // a filter's mean is complete
  for (std::size_t i = 0; i < frames.size(); ++i) {
    box.show(*frames[i]);
    Vec3 force;
    for (int tick = 0; tick < kTicksPerFrame; ++tick) force = box.lawForce(at(h_m)).force_n_in_world;
    if (i < settled) continue;
    sum += force;
    squares += dot(force, force);
  }
  const double count = static_cast<double>(frames.size() - settled);
  const Vec3 mean = (1 / count) * sum;
  if (norm(mean) < kFelt_n) return -1;
  return std::sqrt(std::max(0.0, squares / count - dot(mean, mean)));
}

}  // namespace hapticd::tools
