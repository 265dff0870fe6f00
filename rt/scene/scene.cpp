// SPDX-License-Identifier: Apache-2.0
#include "rt/scene/scene.h"

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

SceneStorage::SceneStorage(const GridShape& shape, std::size_t point_capacity, const DepthModel& model)
    : shape_(shape),
      occupancy_(std::make_unique<std::uint64_t[]>(shape.words())),
      touched_words_(std::make_unique<std::uint64_t[]>(shape.summaryWords())),
      word_rank_(std::make_unique<std::uint32_t[]>(shape.words())),
      voxel_begin_(std::make_unique<std::uint32_t[]>(point_capacity + 2)),
      point_(std::make_unique<GridPoint[]>(point_capacity + kVectorPadding)),
      image_(std::make_unique<std::uint16_t[]>(model.pixels())),
      visible_(model),
      hidden_(model) {}

SceneStorage::Layer::Layer(const DepthModel& model)
    : image_(std::make_unique<std::uint16_t[]>(model.pixels() + kVectorPadding)),
      facet_(std::make_unique<Facet[]>(BlockLattice(model).blocks())),
      cell_(std::make_unique<Cell[]>(BlockLattice(model).blocks())) {}

void SceneStorage::Layer::attachTo(SurfaceLayer& layer) const noexcept {
  layer.image = image_.get();
  layer.facet = facet_.get();
  layer.cell = cell_.get();
}

void SceneStorage::attachTo(Scene& scene) const noexcept {
  scene.shape = shape_;
  scene.occupancy = occupancy_.get();
  scene.touched_words = touched_words_.get();
  scene.word_rank = word_rank_.get();
  scene.voxel_begin = voxel_begin_.get();
  scene.point = point_.get();
  scene.image = image_.get();
  visible_.attachTo(scene.surface.visible);
  hidden_.attachTo(scene.surface.hidden);
}

}  // namespace hapticd::rt
