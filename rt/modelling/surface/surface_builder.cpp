// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/surface/surface_builder.h"

#include <algorithm>
#include <cmath>

#include "rt/modelling/surface/block_sums.h"
#include "rt/scene/scene.h"

namespace hapticd::rt {
namespace {

constexpr int kBlock_px = BlockLattice::kBlock_px;
// Tolerances in raw units are those for the noise of a Kinect v1 and multiplied by Job::noise, those for
// means of blocks by Job::block_noise.

/// Adjacent pixels of a surface differ by noise and by its slope; anything steeper relative to the ray is
/// treated as an edge.
constexpr double kStep_raw = 3;
constexpr double kSteepestSlope = 3.7;  // tan 75 degrees
/// Gaps in a surface up to this width are closed: flickering patches are about 9 pixels or 2 cm wide. The
/// projector's shadow next to an object is not such a gap: across it the disparity changes by 7 raw units per
/// pixel, more than on a surface of the steepest slope below.
constexpr double kMaxGap_m = 0.04;
constexpr int kMaxGap_px = 16;
constexpr double kSteepestGap = 1.73;  // tan 60 degrees
/// Pixels flicker most where the noise jumps, so the two ends of a gap differ by more than adjacent pixels.
constexpr double kGapNoise_raw = 6;
/// Widest supports: beyond this few surfaces are flat, and below 0.08 mm of noise nothing is gained.
constexpr double kWidestPlane_m = 0.175;
/// Where the noise is that of a Kinect v1 at 1 m. The bias of a quadratic grows with the fourth power of its
/// width, so the width may grow with the fourth root of the noise.
constexpr double kWidestQuadratic_m = 0.065;
constexpr double kItsNoiseUnit_m = 0.003071102;
constexpr double kEnough_m = 8e-5;
/// Width over which the noise of a Kinect v1 is correlated. Used for every camera: with less correlation the
/// position has enough support earlier, but the slope, which turns the force, has not.
constexpr double kNoisePatch_px = 9;
constexpr double kNearestDepth_m = 0.05;

/// A block that differs from its mean by more shows another surface or has moved.
constexpr double kSame_raw = 2;
/// A surface that moves farther than this between two frames counts as another one.
constexpr double kFarthestMove_m = 0.03;
/// The surface at the focus is everything within this distance of it, along the ray and across.
constexpr double kRegionDepth_m = 0.04;
constexpr double kRegionHalf_m = 0.08;
/// A pixel belongs to a facet, and adjacent facets to one surface, up to differences explained by noise and
/// by the uncertainty of their slopes.
constexpr double kOfFacet_raw = 3;
constexpr double kOfFacet_px = 2;
constexpr double kNeighbours_raw = 2;
constexpr double kNeighbours_px = 1.5;
/// Adjacent facets differ by more than this at a crease and by less on a curved surface.
constexpr double kCrease_raw = 1.5;
constexpr double kCrease_px = 1;
constexpr int kMinInnovations = 8;
/// Slopes need blocks that spread over more than one column and one row: least determinant of the covariance
/// of their places, in blocks.
constexpr double kLeastSpread = 1;
constexpr float kFramesInMotion = 3;
/// Gains of the alpha-beta filter of the velocity, for innovations near the noise and far above it.
constexpr double kSlowGain = 0.3;
constexpr double kFastGain = 1;
constexpr double kFastFrom_sigma = 4;
constexpr double kForgetRest = 0.8;
/// How far a rate must exceed its noise per frame to count as motion, from not at all to entirely. Measured
/// on a box at rest, 0.8 to 1 m away, with the noise of a Kinect v1: tilts are up to 0.6 standard deviations
/// RMS and 1.15 at most, more than the mean. The wider step keeps the loop's gain where both are half open.
struct Gate {
  double from_sigma;
  double width_sigma;
};
constexpr Gate kMoves{0.7, 0.8};
constexpr Gate kTurns{1.0, 1.2};

constexpr double kUsualPeriod_s = 1.0 / 30;
constexpr double kMaxPeriod_s = 0.2;
constexpr std::uint32_t kFramesApart = 2;  // one frame may be lost

int blockOf(double pixel) noexcept {
  return static_cast<int>(std::floor((pixel - BlockLattice::kMiddle_px) / kBlock_px));
}

/// Returns a region in blocks counted from the first one of a window.
BlockRegion relativeTo(const BlockWindow& window, BlockRegion region) noexcept {
  region.blocks.column_first -= window.column_first;
  region.blocks.column_last -= window.column_first;
  region.blocks.row_first -= window.row_first;
  region.blocks.row_last -= window.row_first;
  return region;
}

double smoothStep(double x) noexcept {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

SurfaceBuilder::SurfaceBuilder(const DepthModel& model)
    : model_(model),
      lattice_(model),
      layout_(model),
      block_noise_(noiseOfMean(kBlock_px, model.parameters().noise.correlation_px) /
                   noiseOfMean(kBlock_px, DepthNoiseParameters{}.correlation_px)),
      column_shifts_(model),
      visible_(lattice_),
      hidden_(lattice_),
      observed_(std::make_unique<float[]>(lattice_.blocks() + kVectorPadding)),
      is_full_(std::make_unique<std::uint8_t[]>(lattice_.blocks() + kVectorPadding)),
      fit_blocks_(std::make_unique<float[]>(FacetBlocks::sizeFor(lattice_.rows))),
      fit_memory_(lattice_.rows),
      body_fit_(model, column_shifts_.offsets()) {
  const PixelWindow all = model.wholeDisparity();
  gaps_.raw_first = all.raw_first;
  gaps_.raw_last = all.raw_last;
  // What vanishes at the near limit came nearer, so it is no longer where it was last seen.
  const DisparityScale& scale = model.disparity();
  const double beyond_limit = scale.rawOf(model.parameters().near_m + kNearLimitMargin_m);
  const auto limit_raw =
      static_cast<std::uint16_t>(std::clamp<double>(beyond_limit, all.raw_first, all.raw_last));
  gaps_.remembered_first = scale.a_per_m < 0 ? limit_raw : all.raw_first;
  gaps_.remembered_last = scale.a_per_m < 0 ? all.raw_last : limit_raw;
}

BlockWindow SurfaceBuilder::clipped(const BlockWindow& window) const noexcept {
  return {std::max(0, window.column_first), std::min(lattice_.columns - 1, window.column_last),
          std::max(0, window.row_first), std::min(lattice_.rows - 1, window.row_last)};
}

SurfaceBuilder::Job SurfaceBuilder::jobFor(const Vec3& centre_m_in_world, double radius_m) const noexcept {
  Job job{};
  const DepthModelParameters& camera = model_.parameters();
  job.depth_m = std::max(kNearestDepth_m, -model_.positionInCamera(centre_m_in_world).z);
  job.noise = model_.noiseScale(job.depth_m);
  job.block_noise = job.noise * block_noise_;
  // Between adjacent pixels the disparity of a slope tan(t) changes by tan(t) / (f |a| Z).
  job.raw_per_px = 1 / (camera.fx_px * std::abs(model_.disparity().a_per_m) * job.depth_m);
  const double block_m = kBlock_px * job.depth_m / camera.fx_px;
  const double raw_m = model_.noiseUnit_m(job.depth_m);
  const double enough_blocks = kNoise_raw * raw_m / kEnough_m * kNoisePatch_px / kBlock_px;
  constexpr double kMin_blocks = 5;
  job.fit = {.noise_raw = static_cast<float>(job.block_noise * kNoise_raw),
             .raw_per_block = static_cast<float>(kBlock_px * job.raw_per_px),
             .largest_plane = static_cast<float>(std::clamp(std::min(kWidestPlane_m / block_m, enough_blocks),
                                                            kMin_blocks + 4, 2.0 * FacetBlocks::kBorder + 1)),
             .largest_quadratic = static_cast<float>(std::max(
                 kMin_blocks, kWidestQuadratic_m * std::pow(raw_m / kItsNoiseUnit_m, 0.25) / block_m))};
  const PixelWindow ball = model_.pixelsOfBall(centre_m_in_world, radius_m);
  if (ball.empty()) return job;
  job.sites = clipped({blockOf(ball.column_first), blockOf(ball.column_last) + 1, blockOf(ball.row_first),
                       blockOf(ball.row_last) + 1});
  const int border = static_cast<int>(job.fit.largest_plane) / 2;
  job.support = clipped({job.sites.column_first - border, job.sites.column_last + border,
                         job.sites.row_first - border, job.sites.row_last + border});
  job.pixels.column_first = job.support.column_first * kBlock_px;
  job.pixels.column_last = job.support.column_last * kBlock_px + kBlock_px - 1;
  job.pixels.row_first = job.support.row_first * kBlock_px;
  job.pixels.row_last = job.support.row_last * kBlock_px + kBlock_px - 1;
  return job;
}

PixelWindow SurfaceBuilder::windowOf(const Vec3& centre_m_in_world, double radius_m) const noexcept {
  return jobFor(centre_m_in_world, radius_m).pixels;
}

BlockRegion SurfaceBuilder::regionAround(const Vec3& centre_m_in_world) const noexcept {
  const DepthModelParameters& camera = model_.parameters();
  const Vec3 p = model_.positionInCamera(centre_m_in_world);
  const double depth = std::max(kNearestDepth_m, -p.z);
  const double u = camera.cx_px + camera.fx_px * p.x / depth;
  const double v = camera.cy_px - camera.fy_px * p.y / depth;
  const double half_px = kRegionHalf_m * camera.fx_px / depth;
  return {.blocks = {blockOf(u - half_px), blockOf(u + half_px) + 1, blockOf(v - half_px),
                     blockOf(v + half_px) + 1},
          .disparity_least =
              static_cast<float>(model_.disparity().rawOf(std::max(kNearestDepth_m, depth - kRegionDepth_m))),
          .disparity_greatest = static_cast<float>(model_.disparity().rawOf(depth + kRegionDepth_m))};
}

void SurfaceBuilder::beginFrame(const DisparityFrame& frame, const SurfaceParameters& parameters) noexcept {
  const auto sequence = static_cast<std::uint32_t>(frame.sequence);
  if (sequence == sequence_) return;
  const double since_s = static_cast<double>(frame.arrival_ns - arrival_ns_) * 1e-9;
  const bool continues = sequence_ != 0 && sequence > sequence_ && sequence - sequence_ <= kFramesApart &&
                         since_s <= kMaxPeriod_s;
  before_ = continues ? sequence_ : 0;
  period_s_ = since_s > 0 ? since_s : kUsualPeriod_s;
  if (!continues) {
    comeToRest();
    body_fit_.forget();
  }
  sequence_ = sequence;
  arrival_ns_ = frame.arrival_ns;
  const auto at_rest = static_cast<float>(std::max(1, parameters.fusion_frames));
  const float in_motion = std::min(at_rest, kFramesInMotion);
  max_frames_ = at_rest + static_cast<float>(moving_) * (in_motion - at_rest);
  innovations_ = {};
}

/// Updates the means with the blocks' new disparities.
void SurfaceBuilder::follow(BlockMeans& means, const Job& job, const BlockRegion& region) noexcept {
  const double focal_px = model_.parameters().fx_px;
  const MeansUpdate update{
      .sequence = sequence_,
      .before = before_,
      .max_frames = max_frames_,
      .most_raw = static_cast<float>(job.block_noise * kSame_raw),
      .region = region,
      .moved_raw = BlockMotion::of(period_s_ * used_rate_, 0, 0),
      .farthest_raw = static_cast<float>(kFarthestMove_m * job.raw_per_px * focal_px / job.depth_m)};
  followBlocks(lattice_, job.support, observed_.get(), column_shifts_.offsets(), update, means, innovations_);
}

void SurfaceBuilder::estimateMotion(double block_noise) noexcept {
  const Innovations seen = innovations_;
  if (seen.count < kMinInnovations) return comeToRest();
  innovations_ = {};
  // About the middle of the blocks the errors of the value and those of the slopes are independent.
  const double count = seen.count;
  const double mean = seen.raw / count;
  const double column = seen.column / count;
  const double row = seen.row / count;
  const double column_px = column * kBlock_px + BlockLattice::kMiddle_px;
  const double row_px = row * kBlock_px + BlockLattice::kMiddle_px;
  rate_.value += used_rate_.at(column_px, row_px) - used_rate_.value;
  rate_.column_px = used_rate_.column_px = column_px;
  rate_.row_px = used_rate_.row_px = row_px;
  const double patch_px = std::max<double>(kBlock_px, model_.parameters().noise.correlation_px);
  const double patches = std::max(1.0, count * kBlock_px * kBlock_px / (patch_px * patch_px));
  const double sigma = block_noise * kNoise_raw * std::sqrt(2 / patches);
  moving_ = 0;
  const auto update = [this](double& rate, double& used, double innovation, double noise, const Gate& gate) {
    const double gain = std::abs(innovation) > kFastFrom_sigma * noise ? kFastGain : kSlowGain;
    if (used == 0) rate *= kForgetRest;
    rate += gain * innovation / period_s_;
    const double moving =
        smoothStep((std::abs(rate) * period_s_ / noise - gate.from_sigma) / gate.width_sigma);
    used = moving * rate;
    moving_ = std::max(moving_, moving);
  };
  update(rate_.value, used_rate_.value, mean, sigma, kMoves);
  // Least squares of the slopes.
  const double cc = seen.column_column - count * column * column;
  const double cr = seen.column_row - count * column * row;
  const double rr = seen.row_row - count * row * row;
  const double determinant = cc * rr - cr * cr;
  if (determinant < kLeastSpread * count * count) {
    rate_.per_column = rate_.per_row = used_rate_.per_column = used_rate_.per_row = 0;
    return;
  }
  const double raw_c = seen.raw_column - seen.raw * column;
  const double raw_r = seen.raw_row - seen.raw * row;
  const double per_px = 1 / (determinant * kBlock_px);
  const double sigma_per_px = sigma * std::sqrt(count / determinant) / kBlock_px;
  update(rate_.per_column, used_rate_.per_column, per_px * (rr * raw_c - cr * raw_r),
         sigma_per_px * std::sqrt(rr), kTurns);
  update(rate_.per_row, used_rate_.per_row, per_px * (cc * raw_r - cr * raw_c), sigma_per_px * std::sqrt(cc),
         kTurns);
}

void SurfaceBuilder::fit(const BlockMeans& means, const Job& job, const BlockRegion& region,
                         SurfaceLayer& layer) noexcept {
  // The border lies outside the image; the support lies inside.
  const int border = FacetBlocks::kBorder;
  for (int row = -border; row < job.sites.rows() + border; ++row) {
    std::fill_n(fit_blocks_.get() + FacetBlocks::at(row, -border),
                job.sites.columns() + 2 * border + FacetBlocks::kPadding, -1.0F);
  }
  for (int row = job.support.row_first; row <= job.support.row_last; ++row) {
    std::copy_n(means.disparity.get() + lattice_.at(row, job.support.column_first), job.support.columns(),
                fit_blocks_.get() + FacetBlocks::at(row - job.sites.row_first,
                                                    job.support.column_first - job.sites.column_first));
  }
  const FacetBlocks blocks{fit_blocks_.get(), job.sites.columns(), job.sites.rows()};
  const std::size_t first = lattice_.at(job.sites.row_first, job.sites.column_first);
  const FacetMotion motion{
      .region = relativeTo(job.sites, region),
      .per_second = BlockMotion::of(used_rate_, job.sites.row_first, job.sites.column_first)};
  const CellLimits limits{
      .max_step = static_cast<float>(job.block_noise * kNeighbours_raw + kNeighbours_px * job.raw_per_px),
      .max_bend = static_cast<float>(job.block_noise * kCrease_raw + kCrease_px * job.raw_per_px)};
  fitFacets(blocks, job.fit, fit_memory_, motion, limits,
            {.facet = layer.facet + first,
             .cell = layer.cell + first,
             .is_full = is_full_.get() + first,
             .per_row = lattice_.columns});
}

void SurfaceBuilder::buildLayer(BlockMeans& means, const Job& job, const BlockRegion& region,
                                SurfaceLayer& layer) noexcept {
  const auto max_step = static_cast<int>(job.noise * kStep_raw + kSteepestSlope * job.raw_per_px);
  sumUpBlocks(layer.image, layout_, lattice_, job.support, max_step, {observed_.get(), is_full_.get()});
  follow(means, job, region);
}

/// Where something becomes hidden, continues its mean from when it was visible.
void SurfaceBuilder::startHidden(const Job& job) noexcept {
  if (before_ == 0) return;
  continueBlocks(lattice_, job.support, before_, sequence_, visible_, hidden_);
}

FocusBody SurfaceBuilder::bodyAt(const Vec3& focus_m_in_world, const Job& job, const BlockRegion& region,
                                 const DisparityMotion& moved, const VisibleSurface& surface) noexcept {
  const Vec3 focus = model_.positionInCamera(focus_m_in_world);
  if (!(-focus.z > kNearestDepth_m)) return {};
  const DepthModelParameters& camera = model_.parameters();
  const ImagePosition image{camera.cx_px - camera.fx_px * focus.x / focus.z,
                            camera.cy_px + camera.fy_px * focus.y / focus.z};
  const int column = static_cast<int>(std::lround((image.u - BlockLattice::kMiddle_px) / kBlock_px));
  const int row = static_cast<int>(std::lround((image.v - BlockLattice::kMiddle_px) / kBlock_px));
  if (column < job.sites.column_first || column > job.sites.column_last || row < job.sites.row_first ||
      row > job.sites.row_last)
    return {};
  Facet facet = surface.visible.facet[lattice_.at(row, column)];
  facet.disparity +=
      facet.per_column * static_cast<float>(image.u - (column * kBlock_px + BlockLattice::kMiddle_px)) +
      facet.per_row * static_cast<float>(image.v - (row * kBlock_px + BlockLattice::kMiddle_px));
  FocusBody body = body_fit_.fit({.image = surface.visible.image,
                                  .pixels = job.pixels,
                                  .focus = image,
                                  .facet = facet,
                                  .noise = job.noise,
                                  .moved = moved,
                                  .max_frames = static_cast<double>(max_frames_)});
  const bool moves =
      facet.disparity >= region.disparity_least && facet.disparity <= region.disparity_greatest;
  if (moves) body.per_second = used_rate_;
  corner_ = body_fit_.corner();
  corner_.per_second = body.per_second;
  return body;
}

void SurfaceBuilder::build(const DisparityFrame& frame, const std::uint16_t* hidden,
                           const Vec3& centre_m_in_world, double radius_m,
                           const SurfaceParameters& parameters, VisibleSurface& surface) noexcept {
  surface.centre_m_in_world = centre_m_in_world;
  surface.radius_m = radius_m;
  surface.lattice = lattice_;
  surface.blocks = {};
  surface.hides_anything = false;
  surface.body = {};
  surface.corner = {};
  const bool new_frame = static_cast<std::uint32_t>(frame.sequence) != sequence_;
  if (new_frame) {
    body_ = {};
    corner_ = {};
  }
  beginFrame(frame, parameters);
  column_shifts_.update(frame);
  const Job job = jobFor(centre_m_in_world, radius_m);
  if (job.sites.columns() < 2 || job.sites.rows() < 2) return;
  const BlockRegion region = regionAround(centre_m_in_world);
  surface.blocks = job.sites;
  surface.of_facet_raw = static_cast<float>(job.noise * kOfFacet_raw + kOfFacet_px * job.raw_per_px);
  gaps_.longest_px =
      std::max(kMaxGap_px, static_cast<int>(kMaxGap_m * model_.parameters().fx_px / job.depth_m));
  gaps_.max_raw = static_cast<float>(job.noise * kGapNoise_raw);
  gaps_.max_raw_per_px = static_cast<float>(kSteepestGap * job.raw_per_px);
  surface.hides_anything = fillLayerImages({.raw = frame.raw,
                                            .remembered = hidden,
                                            .visible = surface.visible.image,
                                            .hidden = surface.hidden.image},
                                           layout_, job.pixels, gaps_);
  if (surface.hides_anything) startHidden(job);
  buildLayer(visible_, job, region, surface.visible);
  const DisparityMotion moved = period_s_ * used_rate_;  // as the means of the blocks
  if (new_frame) estimateMotion(job.block_noise);
  fit(visible_, job, region, surface.visible);
  // The body stays where it is as long as the frame is the same, so that the surface does not change.
  if (new_frame) body_ = bodyAt(centre_m_in_world, job, region, moved, surface);
  surface.body = body_;
  surface.corner = corner_;
  if (!surface.hides_anything) return;
  buildLayer(hidden_, job, region, surface.hidden);
  fit(hidden_, job, region, surface.hidden);
}

}  // namespace hapticd::rt
