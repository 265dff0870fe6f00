#include "rt/scene_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace hapticd::rt {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Calls `visit(word)` for each word of the occupancy that is not 0, in ascending order.
template <typename Visit>
void forEachTouchedWord(const Scene& scene, Visit visit) {
  const std::size_t summary_words = scene.shape.summaryWords();
  for (std::size_t summary = 0; summary < summary_words; ++summary) {
    for (std::uint64_t bits = scene.touched_words[summary]; bits != 0; bits &= bits - 1) {
      visit(summary * 64 + static_cast<std::size_t>(std::countr_zero(bits)));
    }
  }
}

void clearOccupancy(Scene& scene) noexcept {
  forEachTouchedWord(scene, [&scene](std::size_t word) { scene.occupancy[word] = 0; });
  std::fill_n(scene.touched_words, scene.shape.summaryWords(), 0);
}

}  // namespace

SceneBuilder::SceneBuilder(const DepthModel& model, const GridParameters& parameters)
    : model_(model),
      extent_(parameters.extent),
      shape_(GridShape::of(parameters, model)),
      point_capacity_(extent_ == ModelExtent::frame ? kFramePixels
                                                    : static_cast<std::size_t>(parameters.point_capacity)),
      in_image_order_(std::make_unique<BuilderPoint[]>(point_capacity_ + kVectorPadding)),
      in_voxel_order_(std::make_unique<BuilderPoint[]>(point_capacity_ + kVectorPadding)),
      voxel_(std::make_unique<std::uint32_t[]>(1 + point_capacity_ + kVectorPadding)),
      runs_(std::make_unique<VoxelRun[]>(point_capacity_ + 1)) {}

double SceneBuilder::largestBall_m() const noexcept {
  if (extent_ == ModelExtent::frame) return kInfinity;
  // The window's centre is the voxel corner nearest to the ball's centre: half a voxel away at most.
  return shape_.voxel_edge_m * (std::min({shape_.cells_x, shape_.cells_y, shape_.cells_z}) / 2 - 0.5) -
         2 * model_.singlePrecisionError_m();
}

void SceneBuilder::place(const Vec3& centre_m_in_world, double radius_m, Scene& scene) const noexcept {
  const double edge = shape_.voxel_edge_m;
  if (extent_ == ModelExtent::frame) {
    scene.origin_m_in_world = model_.bounds().lowest_m_in_world - Vec3{edge, edge, edge};
    scene.ball_centre_m_in_world = centre_m_in_world;
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
                         Scene& scene) noexcept {
  clearOccupancy(scene);
  place(centre_m_in_world, radius_m, scene);
  scene.frame = frame.sequence;
  scene.frame_time_ns = frame.arrival_ns;
  scene.depth_model = &model_;
  scene.points = 0;
  scene.points_over_capacity = 0;
  const PixelWindow window = windowOf(scene);
  if (window.empty()) return;

  const Vec3 camera = model_.cameraPosition_m_in_world() - scene.origin_m_in_world;
  const Vec3 ball = scene.ball_centre_m_in_world - scene.origin_m_in_world;
  const double ball_radius = scene.ball_radius_m + model_.singlePrecisionError_m();
  DeprojectJob job{};
  job.raw = frame.raw;
  job.window = window;
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
  job.voxel = voxel_.get() + 1;
  job.runs = runs_.get();
  job.occupancy = scene.occupancy;
  job.touched_words = scene.touched_words;
  deproject(job);

  run_count_ = job.run_count;
  scene.points = job.points;
  scene.points_over_capacity = job.points_over_capacity;
  rankOccupiedVoxels(scene);
  scatter(scene);
}

/// Numbers the occupied voxels in the order of their bits and counts the points of each, so that
/// voxel_begin[rank + 1] is where its first point goes.
void SceneBuilder::rankOccupiedVoxels(Scene& scene) noexcept {
  std::uint32_t occupied = 0;
  forEachTouchedWord(scene, [&scene, &occupied](std::size_t word) {
    scene.word_rank[word] = occupied;
    occupied += static_cast<std::uint32_t>(std::popcount(scene.occupancy[word]));
  });
  std::fill_n(scene.voxel_begin, occupied + 2, 0U);
  for (std::size_t i = 0; i < run_count_; ++i) {
    VoxelRun& run = runs_[i];
    const std::uint64_t below = (1ULL << (run.voxel % 64)) - 1;
    const std::uint64_t word = scene.occupancy[run.voxel / 64];
    run.voxel = scene.word_rank[run.voxel / 64] + static_cast<std::uint32_t>(std::popcount(word & below));
    scene.voxel_begin[run.voxel + 2] += runs_[i + 1].begin - run.begin;
  }
  std::uint32_t sum = 0;
  for (std::uint32_t rank = 0; rank < occupied; ++rank) {
    sum += scene.voxel_begin[rank + 2];
    scene.voxel_begin[rank + 2] = sum;
  }
}

/// Moves the runs to their voxels; afterwards voxel_begin[rank] is a voxel's first point and
/// voxel_begin[rank + 1] its end.
void SceneBuilder::scatter(Scene& scene) noexcept {
  for (std::size_t i = 0; i < run_count_; ++i) {
    const VoxelRun& run = runs_[i];
    const std::uint32_t count = runs_[i + 1].begin - run.begin;
    std::uint32_t& to = scene.voxel_begin[run.voxel + 1];
    // a loop of whole points, not a call: most runs are a few points long
    const BuilderPoint* from = in_image_order_.get() + run.begin;
    BuilderPoint* const end = in_voxel_order_.get() + to + count;
    for (BuilderPoint* point = in_voxel_order_.get() + to; point != end; ++point) *point = *from++;
    to += count;
  }
  splitCoordinates(in_voxel_order_.get(), scene.points, scene.x_m, scene.y_m, scene.z_m, scene.pixel);
}

}  // namespace hapticd::rt
