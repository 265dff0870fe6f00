#include "rt/surface_field.h"

#include <algorithm>
#include <cstring>

namespace hapticd::rt {
namespace {

/// A register of every machine; the compiler's own vector type, because four lanes are all that is needed.
using Four = float __attribute__((vector_size(16)));

/// Weights of the four nodes -1, 0, 1, 2 on one axis at the fraction t between nodes 0 and 1.
struct AxisWeights {
  Four linear;     ///< linear interpolation
  Four curvature;  ///< what interpolation by value and central difference adds to it
  Four slope;      ///< interpolated central difference, per voxel edge

  explicit AxisWeights(float t) noexcept {
    const float c = 0.25F * t * (1 - t);
    const float half = 0.5F * (1 - t);
    const float other_half = 0.5F * t;
    linear = Four{0, 1 - t, t, 0};
    curvature = Four{-c, c, c, -c};
    slope = Four{-half, -other_half, half, other_half};
  }
};

struct Cell {
  int index;
  float fraction;
};

/// The cell of a position on one axis; kept where its four nodes exist.
Cell cellAt(double nodes) noexcept {
  const double inside = std::clamp(nodes, 1.0, SurfaceField::kNodesPerAxis - 2.0 - 1e-9);
  const int index = static_cast<int>(inside);
  return {index, static_cast<float>(inside - index)};
}

double sumOf(Four v) noexcept {
  return double{(v[0] + v[1]) + (v[2] + v[3])};
}

Four load(const float* nodes) noexcept {
  Four v;
  std::memcpy(&v, nodes, sizeof v);
  return v;
}

}  // namespace

FieldSample sampleField(const SurfaceField& field, const Vec3& p_m_in_world) HAPTICD_RT {
  constexpr std::size_t kRow = SurfaceField::kNodesPerAxis;
  const double nodes_per_m = 1 / field.voxel_edge_m;
  const Vec3 local = nodes_per_m * (p_m_in_world - field.origin_m_in_world);
  const Cell x = cellAt(local.x);
  const Cell y = cellAt(local.y);
  const Cell z = cellAt(local.z);
  const AxisWeights wx(x.fraction);
  const AxisWeights wy(y.fraction);
  const AxisWeights wz(z.fraction);
  const float* const corner =
      field.distance_m +
      ((static_cast<std::size_t>(z.index) - 1) * kRow + static_cast<std::size_t>(y.index) - 1) * kRow +
      static_cast<std::size_t>(x.index) - 1;

  // Rows of four nodes along x, summed up with the weights of y and z.
  Four linear{};
  Four curved{};
  Four slope_y{};
  Four slope_z{};
  for (int k = 0; k < 4; ++k) {
    const bool middle_k = k == 1 || k == 2;
    for (int j = 0; j < 4; ++j) {
      const bool middle_j = j == 1 || j == 2;
      if (!middle_k && !middle_j) continue;
      const Four nodes =
          load(corner + (static_cast<std::size_t>(k) * kRow + static_cast<std::size_t>(j)) * kRow);
      if (middle_k && middle_j) linear += wy.linear[j] * wz.linear[k] * nodes;
      curved += (wy.curvature[j] * wz.linear[k] + wy.linear[j] * wz.curvature[k]) * nodes;
      if (middle_k) slope_y += wy.slope[j] * wz.linear[k] * nodes;
      if (middle_j) slope_z += wy.linear[j] * wz.slope[k] * nodes;
    }
  }
  const double value = sumOf(linear * (wx.linear + wx.curvature) + curved * wx.linear);
  const Vec3 slope{sumOf(linear * wx.slope), sumOf(slope_y * wx.linear), sumOf(slope_z * wx.linear)};
  return {value, nodes_per_m * slope};
}

}  // namespace hapticd::rt
