// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "rt/depth/depth_model.h"
#include "rt/tissue/tissue_contact.h"

namespace hapticd::test {

/// A stiffness map under a flat surface, z = 0 with the free side above, touched without friction by a HIP
/// whose proxy is straight above it.
class FlatTissue {
 public:
  static constexpr double kPeriod_s = 0.001;

  rt::TissueRegion& add(const rt::TissueRegion& region) {
    map->generation += 1;
    rt::TissueRegion& added = map->regions[map->count++];
    added = region;
    added.identity = ++last_identity_;
    return added;
  }
  rt::TissueRegion& addSphere(const rt::Vec3& centre, double radius_m, double transition_m) {
    rt::TissueRegion region;
    region.shape.kind = rt::ShapeKind::sphere;
    region.shape.position_m_in_world = centre;
    region.shape.radius_m = radius_m;
    region.transition_m = transition_m;
    return add(region);
  }
  rt::TissueRegion& addBox(const rt::Vec3& centre, const rt::Vec3& half_size_m, double transition_m) {
    rt::TissueRegion region;
    region.shape.kind = rt::ShapeKind::box;
    region.shape.position_m_in_world = centre;
    region.shape.half_size_m = half_size_m;
    region.transition_m = transition_m;
    return add(region);
  }

  /// Returns the sample of the law with a HIP there, its force replaced.
  rt::ForceSample at(const rt::Vec3& hip_m, const rt::Vec3& velocity_m_per_s = {}) {
    rt::ForceSample sample;
    sample.proxy_m_in_world = hip_m;
    if (hip_m.z < 0) {
      sample.state = rt::ContactState::contact;
      sample.proxy_m_in_world.z = 0;
      sample.normal_in_world = {0, 0, 1};
      sample.depth_m = -hip_m.z;
      sample.force_n_in_world = {0, 0, -parameters.force.stiffness_n_per_m * hip_m.z};
    }
    contact = tissue.apply({.map = map.get(),
                            .model = model,
                            .parameters = parameters.contact,
                            .stiffness_n_per_m = parameters.force.stiffness_n_per_m,
                            .hip_m_in_world = hip_m,
                            .velocity_m_per_s_in_world = velocity_m_per_s,
                            .period_s = kPeriod_s},
                           sample);
    return sample;
  }
  /// Returns the force without the memory of an earlier contact.
  rt::Vec3 freshForce(const rt::Vec3& hip_m, const rt::Vec3& velocity_m_per_s = {}) {
    tissue.release();
    return at(hip_m, velocity_m_per_s).force_n_in_world;
  }

  std::unique_ptr<rt::TissueMap> map = std::make_unique<rt::TissueMap>();
  const rt::DepthModel* model = nullptr;
  rt::LiveParameters parameters;
  rt::TissueContact tissue;
  rt::LocalContact contact;  ///< of the last sample

 private:
  std::uint32_t last_identity_ = 0;
};

}  // namespace hapticd::test
