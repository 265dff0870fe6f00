// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/scene_builder.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "rt/base/realtime_thread.h"
#include "rt/laws/law_table.h"
#include "rt/modelling/deproject_kernel.h"
#include "rt/modelling/sort_kernel.h"

namespace hapticd::rt {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Shared by all builders, so that a number identifies one scene, whoever built it.
std::atomic<std::uint64_t> models_built{0};

/// Returns a window with a margin, within the image.
PixelWindow grownBy(PixelWindow window, int margin, const DepthModel& model) noexcept {
  window.column_first = std::max(0, window.column_first - margin);
  window.column_last = std::min(model.width_px() - 1, window.column_last + margin);
  window.row_first = std::max(0, window.row_first - margin);
  window.row_last = std::min(model.height_px() - 1, window.row_last + margin);
  return window;
}

void clearOccupancy(Scene& scene) noexcept {
  forEachTouchedWord(scene, [&scene](std::size_t word) { scene.occupancy[word] = 0; });
  std::fill_n(scene.touched_words, scene.shape.summaryWords(), 0);
}

}  // namespace

SceneNeeds SceneNeeds::of(const LiveParameters& parameters) noexcept {
  SceneNeeds needs;
  const ForceLawRow& law = rowOf(parameters.law);
  needs.visible_surface = law.reads_surface;
  needs.points = law.reads_points;
  needs.image = law.reads_image;
  needs.hidden = law.reads_image;
  needs.radius_m = law.reach_m(parameters);
  needs.surface = parameters.surface;
  needs.filter = parameters.filter;
  return needs;
}

bool SceneNeeds::metBy(const Scene& scene, const Vec3& focus_m_in_world, double margin_m) const noexcept {
  if (points && !scene.covers(focus_m_in_world, radius_m + margin_m)) return false;
  if (image && !scene.has_image) return false;
  return !visible_surface ||
         (scene.has_surface && scene.surface.covers(focus_m_in_world, radius_m + margin_m));
}

SceneBuilder::SceneBuilder(const DepthModel& model, const GridParameters& parameters)
    : model_(model),
      extent_(parameters.extent),
      shape_(GridShape::of(parameters, model)),
      point_capacity_(extent_ == ModelExtent::frame ? model.pixels()
                                                    : static_cast<std::size_t>(parameters.point_capacity)),
      in_image_order_(std::make_unique<GridPoint[]>(point_capacity_ + kVectorPadding)),
      voxel_of_row_(std::make_unique<std::uint32_t[]>(1 + kMaxFrameWidth + kVectorPadding)),
      pixel_of_row_(std::make_unique<std::uint32_t[]>(kMaxFrameWidth + kVectorPadding)),
      run_voxel_(std::make_unique<std::uint32_t[]>(point_capacity_ + kVectorPadding)),
      run_begin_(std::make_unique<std::uint32_t[]>(point_capacity_ + kVectorPadding)),
      disparity_(model),
      hidden_raw_(std::make_unique<std::uint16_t[]>(model.rawIsDisparity() ? 0 : model.pixels())),
      filter_(model),
      occlusions_(model),
      surface_builder_(model),
      noise_meter_(model) {}

void SceneBuilder::returnUnusedMemory() noexcept {
  returnPages(in_image_order_.get(), (point_capacity_ + kVectorPadding) * sizeof in_image_order_[0]);
  returnPages(run_voxel_.get(), (point_capacity_ + kVectorPadding) * sizeof run_voxel_[0]);
  returnPages(run_begin_.get(), (point_capacity_ + kVectorPadding) * sizeof run_begin_[0]);
  filter_.returnUnused();
  surface_builder_.returnUnusedMemory();
}

double SceneBuilder::largestBall_m() const noexcept {
  if (extent_ == ModelExtent::frame) return kInfinity;
  // The window's centre is the voxel corner nearest to the ball's centre, at most half a voxel away on each
  // axis.
  const double in_grid =
      shape_.voxel_edge_m * (std::min({shape_.cells_x, shape_.cells_y, shape_.cells_z}) / 2 - 0.5) -
      2 * model_.singlePrecisionError_m();
  if (!model_.isLinear()) return in_grid;
  return std::min(in_grid, largestReachOfUnit_m(model_.parameters().unit_m));
}

void SceneBuilder::place(const Vec3& centre_m_in_world, double radius_m, Scene& scene) const noexcept {
  const double edge = shape_.voxel_edge_m;
  if (extent_ == ModelExtent::frame) {
    scene.origin_m_in_world = model_.bounds().lowest_m_in_world - Vec3{edge, edge, edge};
    // Any finite centre will do, because the radius is infinite.
    scene.ball_centre_m_in_world = scene.origin_m_in_world;
    scene.ball_radius_m = kInfinity;
    return;
  }
  const auto lowestCorner = [edge](double centre, int cells) {
    return edge * (std::round(centre / edge) - cells / 2);
  };
  scene.origin_m_in_world = {lowestCorner(centre_m_in_world.x, shape_.cells_x),
                             lowestCorner(centre_m_in_world.y, shape_.cells_y),
                             lowestCorner(centre_m_in_world.z, shape_.cells_z)};
  scene.ball_centre_m_in_world = centre_m_in_world;
  scene.ball_radius_m = std::min(radius_m, largestBall_m());
}

PixelWindow SceneBuilder::windowOf(const Scene& scene) const noexcept {
  if (extent_ == ModelExtent::frame) return model_.wholeFrame();
  return model_.windowOfBall(scene.ball_centre_m_in_world, scene.ball_radius_m);
}

void SceneBuilder::build(const DepthFrame& frame, const Vec3& centre_m_in_world, double radius_m,
                         Scene& scene, const SceneNeeds& needs) noexcept {
  clearOccupancy(scene);
  place(centre_m_in_world, radius_m, scene);
  scene.model = models_built.fetch_add(1, std::memory_order_relaxed) + 1;
  scene.frame = frame.sequence;
  scene.frame_time_ns = frame.arrival_ns;
  scene.exposure_ns = frame.exposure_ns;
  scene.depth_model = &model_;
  scene.points = 0;
  scene.points_over_capacity = 0;
  scene.has_points = needs.points;
  scene.has_image = needs.points && needs.image;
  scene.has_surface = needs.visible_surface;
  scene.image_window = {};
  if (needs.points) buildPoints(frame, centre_m_in_world, needs, scene);
  if (needs.visible_surface) {
    const PixelWindow window = surface_builder_.windowOf(centre_m_in_world, radius_m);
    updateOcclusions(frame, window);
    const std::uint16_t* const hidden = occlusions_.hidesAnything(window) ? occlusions_.hidden() : nullptr;
    surface_builder_.build(disparity_.of(frame), hidden, centre_m_in_world, radius_m, needs.surface,
                           scene.surface);
    noise_meter_.measure(frame, scene.surface, centre_m_in_world, surface_builder_.moves());
  }
  scene.noise = noise_meter_.result();
}

void SceneBuilder::keepImage(const std::uint16_t* raw, const PixelWindow& window,
                             Scene& scene) const noexcept {
  const auto columns = static_cast<std::size_t>(window.column_last - window.column_first + 1);
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(row) * model_.stride_px() + window.column_first;
    std::copy_n(raw + first, columns, scene.image + first);
  }
  scene.image_window = window;
}

void SceneBuilder::updateOcclusions(const DepthFrame& frame, const PixelWindow& window) noexcept {
  disparity_.convert(frame, window);
  disparity_.convert(frame, occlusions_.stripOf(frame.sequence));
  occlusions_.update(disparity_.of(frame), window);
}

/// Returns the hidden surface as raw values of the camera.
const std::uint16_t* SceneBuilder::hiddenAsRaw(const PixelWindow& window) noexcept {
  const std::uint16_t* const hidden = occlusions_.hidden();
  if (model_.rawIsDisparity()) return hidden;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(row) * model_.stride_px();
    for (std::ptrdiff_t i = first; i < first + model_.stride_px(); ++i) {
      hidden_raw_[static_cast<std::size_t>(i)] = hidden[i] == kNoRawDisparity
                                                     ? model_.parameters().raw_no_measurement
                                                     : model_.rawOfDisparity(hidden[i]);
    }
  }
  return hidden_raw_.get();
}

void SceneBuilder::buildPoints(const DepthFrame& frame, const Vec3& focus_m_in_world, const SceneNeeds& needs,
                               Scene& scene) noexcept {
  PixelWindow window = windowOf(scene);
  if (needs.image && window.empty() && extent_ == ModelExtent::reach) {
    window = model_.pixelsOfBall(scene.ball_centre_m_in_world, scene.ball_radius_m);
  }
  if (window.empty()) return;
  const std::uint16_t* raw = frame.raw;
  if (!needs.filter.isOff()) {
    disparity_.convert(frame, grownBy(window, needs.filter.spatial_radius_px, model_));
    filter_.apply(disparity_.of(frame), window, needs.filter);
    raw = filter_.rounded(window);
  }
  if (!needs.visible_surface) noise_meter_.measure(frame, raw, window, focus_m_in_world);
  if (needs.image) keepImage(raw, window, scene);
  if (needs.hidden) updateOcclusions(frame, window);
  if (window.raw_first > window.raw_last) return;
  scene.raw_first = window.raw_last < PackedPixel::kRawRange ? 0 : window.raw_first;
  window.raw_last = static_cast<std::uint16_t>(
      std::min<std::uint32_t>(window.raw_last, scene.raw_first + PackedPixel::kRawRange - 1));
  DeprojectJob job = jobOf(scene, window);
  job.raw = raw;
  deproject(job);
  if (needs.hidden && occlusions_.hidesAnything(window)) {
    job.raw = hiddenAsRaw(window);
    deproject(job);
  }
  scene.points = job.points;
  scene.points_over_capacity = job.points_over_capacity;
  sortIntoVoxels(job, scene);
}

DeprojectJob SceneBuilder::jobOf(const Scene& scene, const PixelWindow& window) const noexcept {
  const Vec3 camera = model_.cameraPosition_m_in_world() - scene.origin_m_in_world;
  const Vec3 ball = scene.ball_centre_m_in_world - scene.origin_m_in_world;
  const double ball_radius = scene.ball_radius_m + model_.singlePrecisionError_m();
  DeprojectJob job{};
  job.window = window;
  job.stride_px = model_.stride_px();
  job.raw_first = scene.raw_first;
  job.tables = &model_.singlePrecision();
  job.camera_x_m = static_cast<float>(camera.x);
  job.camera_y_m = static_cast<float>(camera.y);
  job.camera_z_m = static_cast<float>(camera.z);
  job.ball_x_m = static_cast<float>(ball.x);
  job.ball_y_m = static_cast<float>(ball.y);
  job.ball_z_m = static_cast<float>(ball.z);
  job.ball_radius_squared_m2 = static_cast<float>(ball_radius * ball_radius);
  job.voxels_per_m = static_cast<float>(1 / shape_.voxel_edge_m);
  job.last_cell_x = shape_.cells_x - 1;
  job.last_cell_y = shape_.cells_y - 1;
  job.last_cell_z = shape_.cells_z - 1;
  job.cells_y = shape_.cells_y;
  job.bits_per_row = shape_.wordsPerRow() * GridShape::kCellsPerWord;
  job.point_capacity = static_cast<std::uint32_t>(point_capacity_);
  job.points_in_image_order = in_image_order_.get();
  job.voxel_of_row = voxel_of_row_.get();
  job.pixel_of_row = pixel_of_row_.get();
  job.run_voxel = run_voxel_.get();
  job.run_begin = run_begin_.get();
  return job;
}

}  // namespace hapticd::rt
