// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/snapshot/point_cloud.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "rt/depth/depth_model.h"
#include "tools/hapticctl/snapshot/depth_picture.h"

namespace hapticd::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as the machine stores numbers");

class Vertices {
 public:
  void add(const rt::Vec3& p_m_in_world, const Rgb& colour) {
    for (const double coordinate : {p_m_in_world.x, p_m_in_world.y, p_m_in_world.z}) {
      const auto number = static_cast<float>(coordinate);
      char bytes[sizeof number];
      std::memcpy(bytes, &number, sizeof number);
      bytes_.append(bytes, sizeof bytes);
    }
    for (const std::uint8_t part : {colour.red, colour.green, colour.blue}) {
      bytes_.push_back(static_cast<char>(part));
    }
    ++count_;
  }
  std::size_t count() const { return count_; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::size_t count_ = 0;
};

void addPixels(Vertices& vertices, const Snapshot& snapshot, double radius_m) {
  const rt::DepthModel model(snapshot.depth_model, snapshot.T_world_camera);
  for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(model.height_px()); ++row) {
    for (std::uint32_t column = 0; column < static_cast<std::uint32_t>(model.width_px()); ++column) {
      const std::uint16_t raw = snapshot.raw[row * static_cast<std::uint32_t>(model.width_px()) + column];
      if (model.depth_m(raw) <= 0) continue;
      const rt::Vec3 point = model.pointInWorld(rt::PackedPixel::pack(column, row, raw), raw);
      const bool near_hip = rt::norm(point - snapshot.hip_m_in_world) <= radius_m;
      vertices.add(point, near_hip ? kNeighbourColour
                                   : colourOfDepth(model.depth_m(raw), snapshot.depth_model.near_m,
                                                   snapshot.depth_model.far_m));
    }
  }
}

}  // namespace

std::string plyOf(const Snapshot& snapshot, double radius_m) {
  Vertices vertices;
  addPixels(vertices, snapshot, radius_m);
  if (rt::isFinite(snapshot.proxy_m_in_world)) vertices.add(snapshot.proxy_m_in_world, kProxyColour);
  if (rt::isFinite(snapshot.hip_m_in_world)) vertices.add(snapshot.hip_m_in_world, kHipColour);
  return fmt::format(
             "ply\nformat binary_little_endian 1.0\ncomment hapticd depth frame {}, metres in the world "
             "frame\n"
             "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
             "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
             snapshot.frame, vertices.count()) +
         vertices.bytes();
}

}  // namespace hapticd::tools
