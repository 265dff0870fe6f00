#include "rt/scene.h"

namespace hapticd::rt {

GridShape GridShape::of(const GridParameters& parameters, const DepthModel& model) noexcept {
  if (parameters.extent == ModelExtent::reach) {
    return {parameters.cells_per_axis, parameters.cells_per_axis, parameters.cells_per_axis,
            parameters.voxel_edge_m};
  }
  const Vec3 size = model.bounds().highest_m_in_world - model.bounds().lowest_m_in_world;
  const double edge = parameters.frame_voxel_edge_m;
  const auto cells = [edge](double length) { return static_cast<int>(std::ceil(length / edge)) + 2; };
  return {cells(size.x), cells(size.y), cells(size.z), edge};
}

SceneStorage::SceneStorage(const GridShape& shape, std::size_t point_capacity)
    : shape_(shape),
      occupancy_(std::make_unique<std::uint64_t[]>(shape.words())),
      touched_words_(std::make_unique<std::uint64_t[]>(shape.summaryWords())),
      word_rank_(std::make_unique<std::uint32_t[]>(shape.words())),
      voxel_begin_(std::make_unique<std::uint32_t[]>(point_capacity + 2)),
      point_(std::make_unique<GridPoint[]>(point_capacity + kVectorPadding)),
      image_(std::make_unique<std::uint16_t[]>(kFramePixels)),
      field_distance_m_(std::make_unique<float[]>(SurfaceField::kNodes)) {}

void SceneStorage::attachTo(Scene& scene) const noexcept {
  scene.shape = shape_;
  scene.occupancy = occupancy_.get();
  scene.touched_words = touched_words_.get();
  scene.word_rank = word_rank_.get();
  scene.voxel_begin = voxel_begin_.get();
  scene.point = point_.get();
  scene.image = image_.get();
  scene.field.distance_m = field_distance_m_.get();
}

}  // namespace hapticd::rt
