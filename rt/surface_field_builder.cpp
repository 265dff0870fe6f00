#include "rt/surface_field_builder.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "rt/scene.h"

namespace hapticd::rt {
namespace {

constexpr int kNodes = SurfaceField::kNodesPerAxis;

/// Blocks with their border, for any block size: one pixel a block at worst.
constexpr std::size_t kMaxBlocks =
    (std::size_t{kFrameWidth} + 2 + kVectorPadding) * (std::size_t{kFrameHeight} + 2) + kVectorPadding;

/// Surfaces steeper than that to the ray are taken for edges: there the sensor sees hardly anything either.
constexpr double kSteepestSlope = 3.7;  // tan 75 degrees
/// The sensor's noise between neighbours, raw units.
constexpr double kNoise_raw = 3;
/// Gaps in a surface up to that long are closed: patches that flicker are about 2 cm wide. The projector's
/// shadow beside an object is no gap in a surface: there the disparity changes by 7 raw units per pixel,
/// which is above what a surface of this slope does.
constexpr double kLongestGap_m = 0.04;
/// Pixels flicker most where the noise jumps, so the two ends of a gap differ by more than neighbours do.
constexpr double kGapNoise_raw = 6;
constexpr double kSteepestGap = 1.73;  // tan 60 degrees

constexpr double kBlocksPerVoxel = 4;
constexpr double kNearestDepth_m = 0.05;

struct LatticeIndex {
  int x, y, z;
};

LatticeIndex latticeOf(const SurfaceField& field) noexcept {
  const auto whole = [&field](double m) { return static_cast<int>(std::lround(m / field.voxel_edge_m)); };
  return {whole(field.origin_m_in_world.x), whole(field.origin_m_in_world.y),
          whole(field.origin_m_in_world.z)};
}

void store(const Vec3& v, float (&out)[3]) noexcept {
  out[0] = static_cast<float>(v.x);
  out[1] = static_cast<float>(v.y);
  out[2] = static_cast<float>(v.z);
}

/// Nodes that samples within the field's radius read, in units of nodes.
double stencilRadius_nodes(const SurfaceField& field) noexcept {
  return field.radius_m / field.voxel_edge_m + SurfaceField::kStencil_voxels;
}

}  // namespace

SurfaceFieldBuilder::SurfaceFieldBuilder(const DepthModel& model)
    : model_(model),
      column_sum_(std::make_unique<float[]>(kFrameWidth + kVectorPadding)),
      column_count_(std::make_unique<float[]>(kFrameWidth + kVectorPadding)),
      block_count_(std::make_unique<float[]>(kMaxBlocks)),
      block_mean_(std::make_unique<float[]>(kMaxBlocks)),
      patch_(std::make_unique<SurfacePatch[]>(kMaxBlocks)),
      fused_distance_m_(std::make_unique<float[]>(SurfaceField::kNodes)),
      fused_frames_(std::make_unique<std::uint16_t[]>(SurfaceField::kNodes)),
      next_distance_m_(std::make_unique<float[]>(SurfaceField::kNodes)),
      next_frames_(std::make_unique<std::uint16_t[]>(SurfaceField::kNodes)) {
  image_.column_sum = column_sum_.get();
  image_.column_count = column_count_.get();
  image_.count = block_count_.get();
  image_.mean = block_mean_.get();
}

PixelWindow SurfaceFieldBuilder::windowOf(const Vec3& centre_m_in_world, double radius_m,
                                          double voxel_edge_m) const noexcept {
  // a voxel more, for the planes of the outermost blocks
  const double margin = (SurfaceField::kStencil_voxels + 1) * voxel_edge_m;
  return model_.pixelsOfBall(centre_m_in_world, std::min(radius_m, largestRadius_m(voxel_edge_m)) + margin);
}

void SurfaceFieldBuilder::place(const Vec3& centre_m_in_world, double radius_m, double voxel_edge_m,
                                SurfaceField& field) const noexcept {
  const auto lowest = [voxel_edge_m](double centre) {
    return voxel_edge_m * (std::round(centre / voxel_edge_m) - kNodes / 2);
  };
  field.voxel_edge_m = voxel_edge_m;
  field.origin_m_in_world = {lowest(centre_m_in_world.x), lowest(centre_m_in_world.y),
                             lowest(centre_m_in_world.z)};
  field.centre_m_in_world = centre_m_in_world;
  field.radius_m = std::min(radius_m, largestRadius_m(voxel_edge_m));
}

void SurfaceFieldBuilder::joinPixels(const float* disparity, const PixelWindow& window,
                                     const SurfaceField& field) noexcept {
  const DepthModelParameters& camera = model_.parameters();
  const double depth = std::max(kNearestDepth_m, -model_.positionInCamera(field.centre_m_in_world).z);
  const double voxel_px = field.voxel_edge_m * camera.fx_px / depth;
  image_.disparity = disparity;
  image_.block_px = std::max(1, static_cast<int>(std::lround(voxel_px / kBlocksPerVoxel)));
  // Blocks begin at multiples of their size, wherever the window does, so that it does not change the planes.
  const auto blocks = [this](int first, int last, int& begin, int& pixels, int& count) {
    begin = (first + image_.block_px - 1) / image_.block_px * image_.block_px;
    pixels = std::max(0, last - begin + 1);
    count = (pixels + image_.block_px - 1) / image_.block_px;
  };
  blocks(window.column_first, window.column_last, image_.column_first, image_.columns, image_.block_columns);
  blocks(window.row_first, window.row_last, image_.row_first, image_.rows, image_.block_rows);
  image_.stride = image_.block_columns + 2 + static_cast<int>(kVectorPadding);
  meanOfBlocks(image_);

  // From pixel to pixel the disparity of a slope tan(t) changes by tan(t) / (f |a| Z).
  const double raw_per_px = 1 / (camera.fx_px * std::abs(camera.a_per_m) * depth);
  closeGaps(image_, static_cast<int>(kLongestGap_m * camera.fx_px / depth), static_cast<float>(kGapNoise_raw),
            static_cast<float>(kSteepestGap * raw_per_px));
  const double change_raw = kSteepestSlope * image_.block_px * raw_per_px;
  fitPatches(image_, {.edge_raw = static_cast<float>(kNoise_raw + change_raw),
                      .a_per_m = static_cast<float>(camera.a_per_m),
                      .b_per_m = static_cast<float>(camera.b_per_m),
                      .fx_px = static_cast<float>(camera.fx_px),
                      .fy_px = static_cast<float>(camera.fy_px),
                      .cx_px = static_cast<float>(camera.cx_px),
                      .cy_px = static_cast<float>(camera.cy_px),
                      .patch = patch_.get()});
}

void SurfaceFieldBuilder::fillFromPatches(SurfaceField& field) const noexcept {
  const DepthModelParameters& camera = model_.parameters();
  const double edge = field.voxel_edge_m;
  NodeJob job{};
  store(model_.positionInCamera(field.origin_m_in_world), job.origin_m);
  store(edge * model_.directionInCamera({1, 0, 0}), job.step_x_m);
  store(edge * model_.directionInCamera({0, 1, 0}), job.step_y_m);
  store(edge * model_.directionInCamera({0, 0, 1}), job.step_z_m);
  job.fx_px = static_cast<float>(camera.fx_px);
  job.fy_px = static_cast<float>(camera.fy_px);
  job.cx_px = static_cast<float>(camera.cx_px);
  job.cy_px = static_cast<float>(camera.cy_px);
  job.image = &image_;
  job.patch = patch_.get();
  job.truncation_m = static_cast<float>(field.truncation_m());
  const Vec3 centre = (1 / edge) * (field.centre_m_in_world - field.origin_m_in_world);
  job.ball_x = static_cast<float>(centre.x);
  job.ball_y = static_cast<float>(centre.y);
  job.ball_z = static_cast<float>(centre.z);
  job.ball_radius = static_cast<float>(stencilRadius_nodes(field));
  job.distance_m = field.distance_m;
  fillNodes(job);
}

void SurfaceFieldBuilder::fillFree(SurfaceField& field) const noexcept {
  std::fill_n(field.distance_m, SurfaceField::kNodes, static_cast<float>(field.truncation_m()));
}

void SurfaceFieldBuilder::build(const float* disparity, const Vec3& centre_m_in_world, double radius_m,
                                const SurfaceParameters& parameters, std::uint64_t frame,
                                SurfaceField& field) noexcept {
  place(centre_m_in_world, radius_m, parameters.voxel_edge_m, field);
  const PixelWindow window = windowOf(centre_m_in_world, radius_m, parameters.voxel_edge_m);
  if (window.empty()) {
    fillFree(field);
  } else {
    joinPixels(disparity, window, field);
    fillFromPatches(field);
  }
  if (parameters.fusion_frames > 1) {
    fuse(parameters, frame, field);
  } else {
    fused_frame_ = 0;
  }
}

/// Each node becomes the mean over its last frames as long as its new distance stays near; where the scene
/// moves it takes the new one. Nodes that the field before did not hold begin with the new distance.
void SurfaceFieldBuilder::fuse(const SurfaceParameters& parameters, std::uint64_t frame,
                               SurfaceField& field) noexcept {
  constexpr std::uint64_t kFramesApart = 2;  // one frame may be lost
  const SurfaceField& before = fused_field_;
  const bool goes_on = fused_frame_ != 0 && frame >= fused_frame_ && frame - fused_frame_ <= kFramesApart &&
                       before.voxel_edge_m == field.voxel_edge_m;
  const bool same_frame = goes_on && frame == fused_frame_;
  const LatticeIndex now = latticeOf(field);
  const LatticeIndex then = latticeOf(before);
  const double radius = stencilRadius_nodes(field);
  const double radius_before = goes_on ? stencilRadius_nodes(before) : 0;
  const Vec3 centre = (1 / field.voxel_edge_m) * (field.centre_m_in_world - field.origin_m_in_world);
  const Vec3 centre_before =
      goes_on ? (1 / field.voxel_edge_m) * (before.centre_m_in_world - before.origin_m_in_world) : Vec3{};
  const auto gate = static_cast<float>(0.5 * field.voxel_edge_m);
  const auto most = static_cast<std::uint16_t>(parameters.fusion_frames);
  for (int k = 0; k < kNodes; ++k) {
    for (int j = 0; j < kNodes; ++j) {
      for (int i = 0; i < kNodes; ++i) {
        const Vec3 node{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
        const Vec3 from_centre = node - centre;
        if (dot(from_centre, from_centre) > radius * radius) continue;
        const auto index = static_cast<std::size_t>((k * kNodes + j) * kNodes + i);
        float& distance = field.distance_m[index];
        std::uint16_t frames = 1;
        const int oi = i + now.x - then.x;
        const int oj = j + now.y - then.y;
        const int ok = k + now.z - then.z;
        const bool inside =
            goes_on && oi >= 0 && oi < kNodes && oj >= 0 && oj < kNodes && ok >= 0 && ok < kNodes;
        const Vec3 from_before =
            Vec3{static_cast<double>(oi), static_cast<double>(oj), static_cast<double>(ok)} - centre_before;
        if (inside && dot(from_before, from_before) <= radius_before * radius_before) {
          const auto old = static_cast<std::size_t>((ok * kNodes + oj) * kNodes + oi);
          const float difference = distance - fused_distance_m_[old];
          if (same_frame) {
            distance = fused_distance_m_[old];
            frames = fused_frames_[old];
          } else if (std::abs(difference) <= gate) {
            frames = std::min<std::uint16_t>(static_cast<std::uint16_t>(fused_frames_[old] + 1), most);
            distance = fused_distance_m_[old] + difference / static_cast<float>(frames);
          }
        }
        next_distance_m_[index] = distance;
        next_frames_[index] = frames;
      }
    }
  }
  std::swap(fused_distance_m_, next_distance_m_);
  std::swap(fused_frames_, next_frames_);
  fused_field_ = field;
  fused_frame_ = frame;
}

}  // namespace hapticd::rt
