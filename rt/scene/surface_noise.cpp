// SPDX-License-Identifier: Apache-2.0
#include "rt/scene/surface_noise.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// The focus may move this far across the view before measuring starts again next to it.
constexpr double kNear_m = 0.03;
/// Surfaces farther from the focus are not measured.
constexpr double kReach_m = 0.1;
/// A surface that changes by more between two frames counts as another one.
constexpr double kOther_m = 0.03;
/// Beyond this distance from where it was measured a result says nothing.
constexpr double kFar_m = 0.25;
/// Time for which the last result holds without any surface near the focus.
constexpr double kKept_s = 2;
/// Neighbouring windows share most of their frames, so their mean is taken over several seconds.
constexpr std::uint32_t kMaxWindows = 150;
/// Number of windows as which a result counts that was measured at another place.
constexpr std::uint32_t kWindowsElsewhere = 15;
constexpr std::uint32_t kMaxSteps = 15;
/// The fusion of frames takes this many frames to settle.
constexpr std::uint32_t kSettling = 30;
/// Noise alone looks like motion for a frame or two, which is noise that the law sees.
constexpr int kCertainlyMoving = 4;
constexpr std::uint64_t kFramesApart = 2;  // one frame may be lost
constexpr double kMaxPeriod_s = 0.2;
constexpr double kUsualPeriod_s = 1.0 / 30;

/// Laws on points are measured by the mean of a patch of this half width ...
constexpr double kPatch_m = 0.008;
constexpr int kMinPatch_px = 2;
constexpr int kMaxPatch_px = 12;
/// ... of the pixels within this distance along the ray; fewer pixels show no surface.
constexpr double kPatchDepth_m = 0.04;
constexpr int kMinPixels = 4;
/// A patch that changes by more between two frames moves, in raw units.
constexpr double kMoves_raw = 2;

}  // namespace

void SurfaceNoiseMeter::forget() noexcept {
  result_ = {};
  sequence_ = 0;
  windows_ = 0;
  steps_ = 0;
  restart();
}

void SurfaceNoiseMeter::restart() noexcept {
  placed_ = false;
  distances_ = 0;
  has_last_ = false;
}

/// Returns false for a frame that has been measured.
bool SurfaceNoiseMeter::beginFrame(const DepthFrame& frame, const Vec3& focus_m_in_world) noexcept {
  if (frame.sequence == sequence_) return false;
  const double since_s = static_cast<double>(frame.arrival_ns - arrival_ns_) * 1e-9;
  const std::uint64_t apart = frame.sequence - sequence_;
  const bool continues =
      sequence_ != 0 && frame.sequence > sequence_ && apart <= kFramesApart && since_s <= kMaxPeriod_s;
  result_.frame_period_s = continues && since_s > 0 ? since_s / static_cast<double>(apart) : kUsualPeriod_s;
  sequence_ = frame.sequence;
  arrival_ns_ = frame.arrival_ns;
  if (!continues) restart();
  successive_ = continues ? successive_ + 1 : 1;
  if (windows_ > 0 && norm(focus_m_in_world - variance_place_in_world_) > kFar_m) {
    windows_ = 0;
    steps_ = 0;
    restart();
  }
  return true;
}

bool SurfaceNoiseMeter::isNear(const Vec3& focus_in_camera) const noexcept {
  const double depth = SurfaceView::depthOf(focus_in_camera);
  if (!placed_ || !(depth > SurfaceView::kNearest_m)) return false;
  const Vec3 on_its_ray = depth / SurfaceView::depthOf(place_) * place_;
  return norm(focus_in_camera - on_its_ray) <= kNear_m;
}

void SurfaceNoiseMeter::placeAt(const Vec3& focus_in_camera) noexcept {
  restart();
  const double depth = SurfaceView::depthOf(focus_in_camera);
  if (!(depth > SurfaceView::kNearest_m)) return;
  const DepthModelParameters& camera = model_.parameters();
  image_ = {camera.cx_px + camera.fx_px * focus_in_camera.x / depth,
            camera.cy_px - camera.fy_px * focus_in_camera.y / depth};
  placed_ = image_.u > -0.5 && image_.u < camera.width_px - 0.5 && image_.v > -0.5 &&
            image_.v < camera.height_px - 0.5;
  place_ = focus_in_camera;
  depth_m_ = depth;
}

SurfaceNoiseMeter::Sample SurfaceNoiseMeter::sampleSurface(const SurfaceView& view,
                                                           const BlockWindow& blocks) const noexcept {
  const auto isWithin = [](double pixel, int first, int last) {
    return pixel >= first * BlockLattice::kBlock_px && pixel < (last + 1) * BlockLattice::kBlock_px;
  };
  if (!isWithin(image_.u, blocks.column_first, blocks.column_last) ||
      !isWithin(image_.v, blocks.row_first, blocks.row_last))
    return {};
  const Sheet sheet = view.sheetNear(image_, depth_m_);
  if (!sheet.exists) return {};
  return {.found = true, .distance_m = SurfaceView::distanceFrom(sheet, place_), .depth_m = sheet.depth_m()};
}

SurfaceNoiseMeter::Sample SurfaceNoiseMeter::samplePatch(const std::uint16_t* raw,
                                                         const PixelWindow& window) const noexcept {
  const DepthModelParameters& camera = model_.parameters();
  const double one = model_.rawOf(std::max(SurfaceView::kNearest_m, depth_m_ - kPatchDepth_m));
  const double other = model_.rawOf(depth_m_ + kPatchDepth_m);
  const int half =
      std::clamp(static_cast<int>(kPatch_m * camera.fx_px / depth_m_), kMinPatch_px, kMaxPatch_px);
  const int column = static_cast<int>(std::lround(image_.u));
  const int row = static_cast<int>(std::lround(image_.v));
  double sum = 0;
  int pixels = 0;
  for (int v = std::max(window.row_first, row - half); v <= std::min(window.row_last, row + half); ++v) {
    const std::uint16_t* const line = raw + static_cast<std::ptrdiff_t>(v) * model_.stride_px();
    for (int u = std::max(window.column_first, column - half);
         u <= std::min(window.column_last, column + half); ++u) {
      const double value = line[u];
      if (value < std::min(one, other) || value > std::max(one, other) || value < window.raw_first ||
          value > window.raw_last)
        continue;
      sum += value;
      ++pixels;
    }
  }
  if (pixels < kMinPixels) return {};
  const double depth = model_.depthOfReal_m(sum / pixels);
  if (!(depth > 0)) return {};
  // The distance along the ray, at least that along the normal.
  const double per_depth = norm(place_) / SurfaceView::depthOf(place_);
  const double unit_m = model_.noiseUnit_m(depth) * per_depth;
  const double distance = (depth - SurfaceView::depthOf(place_)) * per_depth;
  return {.found = true,
          .distance_m = distance,
          .depth_m = depth,
          .moves = has_last_ && std::abs(distance - last_m_) > kMoves_raw * unit_m};
}

/// Returns the noise of a pixel at the surface relative to that where the variance was measured.
double SurfaceNoiseMeter::noiseGrowth() const noexcept {
  return model_.noiseUnit_m(depth_m_) / model_.noiseUnit_m(variance_depth_m_);
}

void SurfaceNoiseMeter::addToVariance() noexcept {
  double mean = 0;
  for (const double distance : distance_m_) mean += distance;
  mean /= static_cast<double>(kWindow);
  double squares = 0;
  for (const double distance : distance_m_) squares += (distance - mean) * (distance - mean);
  const double variance = squares / static_cast<double>(kWindow - 1);
  if (distances_ == kWindow) windows_ = std::min(windows_, kWindowsElsewhere);
  windows_ = std::min(windows_ + 1, kMaxWindows);
  if (windows_ > 1) variance_m2_ *= noiseGrowth() * noiseGrowth();
  variance_m2_ += (variance - variance_m2_) / windows_;
  variance_depth_m_ = depth_m_;
  variance_place_in_world_ = model_.positionInWorld(place_);
}

void SurfaceNoiseMeter::take(const Sample& sample) noexcept {
  found_ns_ = arrival_ns_;
  depth_m_ = sample.depth_m;
  const double step = std::abs(sample.distance_m - last_m_);
  const bool same = has_last_ && step <= kOther_m;
  if (same) {
    steps_ = std::min(steps_ + 1, kMaxSteps);
    result_.step_m += (step - result_.step_m) / steps_;
  }
  if (sample.moves || (has_last_ && !same)) distances_ = 0;
  last_m_ = sample.distance_m;
  has_last_ = true;
  if (!sample.moves && successive_ > kSettling) {
    distance_m_[distances_ % kWindow] = sample.distance_m;
    ++distances_;
    if (distances_ >= kWindow) addToVariance();
  }
  result_.noise_m = windows_ > 0 ? std::sqrt(variance_m2_) * noiseGrowth() : 0;
  result_.frames = windows_ > 0 ? windows_ + static_cast<std::uint32_t>(kWindow) - 1 : 0;
  if (steps_ == 0) result_.step_m = 0;
}

void SurfaceNoiseMeter::miss() noexcept {
  restart();
  const double without_s = static_cast<double>(arrival_ns_ - found_ns_) * 1e-9;
  if (without_s <= kKept_s && windows_ > 0) return;
  windows_ = 0;
  steps_ = 0;
  result_.noise_m = 0;
  result_.step_m = 0;
  result_.frames = 0;
}

void SurfaceNoiseMeter::measure(const DepthFrame& frame, const VisibleSurface& surface,
                                const Vec3& focus_m_in_world, bool moves) noexcept {
  if (!beginFrame(frame, focus_m_in_world)) return;
  const Vec3 focus = model_.positionInCamera(focus_m_in_world);
  const SurfaceView view(surface, model_, 0, 0);
  const bool stays = isNear(focus);
  if (!stays) placeAt(focus);
  if (!placed_ || surface.blocks.empty()) return miss();
  Sample sample = sampleSurface(view, surface.blocks);
  if (!sample.found || (!stays && std::abs(sample.distance_m) > kReach_m)) return miss();
  moving_frames_ = moves ? moving_frames_ + 1 : 0;
  sample.moves = moving_frames_ >= kCertainlyMoving;
  take(sample);
}

void SurfaceNoiseMeter::measure(const DepthFrame& frame, const std::uint16_t* raw, const PixelWindow& window,
                                const Vec3& focus_m_in_world) noexcept {
  if (!beginFrame(frame, focus_m_in_world)) return;
  const Vec3 focus = model_.positionInCamera(focus_m_in_world);
  if (!isNear(focus)) placeAt(focus);
  if (!placed_) return miss();
  const Sample sample = samplePatch(raw, window);
  if (!sample.found) return miss();
  take(sample);
}

}  // namespace hapticd::rt
