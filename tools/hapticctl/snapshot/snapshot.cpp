// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/snapshot/snapshot.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "config/base/base64.h"
#include "rt/depth/depth_model.h"
#include "tools/hapticctl/snapshot/depth_picture.h"

namespace hapticd::tools {
namespace {

using base::Error;
using base::Result;

Error unfitting(const std::string& what) {
  return {"snapshot", what, "is hapticd of another version than hapticctl? See 'hapticctl version'"};
}

rt::Vec3 vectorAt(const Json& json, const std::string& path) {
  return {numberAt(json, path + ".x"), numberAt(json, path + ".y"), numberAt(json, path + ".z")};
}

/// Returns a whole number from 0 to 65536, or 0 if there is none.
double wholeAt(const Json& json, const std::string& path) {
  const double number = numberAt(json, path);
  return number >= 0 && number <= 65536 ? std::floor(number) : 0;
}

rt::DepthModelParameters depthModelAt(const Json& header) {
  const auto at = [&](const char* name) { return numberAt(header, std::string("depthModel.") + name); };
  rt::DepthModelParameters camera{.a_per_m = at("aPerM"),
                                  .b_per_m = at("bPerM"),
                                  .fx_px = at("fxPx"),
                                  .fy_px = at("fyPx"),
                                  .cx_px = at("cxPx"),
                                  .cy_px = at("cyPx"),
                                  .near_m = at("nearM"),
                                  .far_m = at("farM"),
                                  .width_px = static_cast<int>(wholeAt(header, "width")),
                                  .height_px = static_cast<int>(wholeAt(header, "height"))};
  if (textAt(header, "depthModel.law") != rt::wordOf(rt::DepthLawKind::linear)) return camera;
  camera.law = rt::DepthLawKind::linear;
  camera.unit_m = at("unitM");
  camera.raw_no_measurement = static_cast<std::uint16_t>(wholeAt(header, "depthModel.rawNoMeasurement"));
  camera.raw_values = static_cast<std::uint32_t>(wholeAt(header, "depthModel.rawValues"));
  return camera;
}

rt::PoseParameters poseAt(const Json& header) {
  const auto at = [&](const char* name) { return numberAt(header, std::string("cameraPose.") + name); };
  return {{at("xM"), at("yM"), at("zM")}, at("rollRad"), at("pitchRad"), at("yawRad")};
}

bool isFinite(const rt::PoseParameters& pose) {
  return rt::isFinite(pose.position_m) && std::isfinite(pose.roll_rad + pose.pitch_rad + pose.yaw_rad);
}

}  // namespace

Result<void> SnapshotAssembler::addHeader(const Json& header) {
  const double frame = numberAt(header, "frame");
  snapshot_.frame = std::isnan(frame) ? 0 : static_cast<std::int64_t>(frame);
  snapshot_.depth_model = depthModelAt(header);
  snapshot_.T_world_camera = poseAt(header);
  // null if the core knows none: the mark is not drawn then
  snapshot_.hip_m_in_world = vectorAt(header, "tick.hipMInWorld");
  snapshot_.proxy_m_in_world = vectorAt(header, "tick.proxyMInWorld");
  const rt::DepthModelParameters& camera = snapshot_.depth_model;
  if (const rt::CameraFault fault = rt::faultOf(camera); fault == rt::CameraFault::size) {
    return std::unexpected(
        unfitting(fmt::format("a frame of {}x{} pixels, at most {}x{} expected", countAt(header, "width"),
                              countAt(header, "height"), rt::kMaxFrameWidth, rt::kMaxFrameHeight)));
  } else if (fault != rt::CameraFault::none || !isFinite(snapshot_.T_world_camera)) {
    return std::unexpected(unfitting("the depth model or the camera's pose is missing or wrong"));
  }
  snapshot_.raw.assign(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px),
                       camera.raw_no_measurement);
  has_header_ = true;
  return {};
}

Result<void> SnapshotAssembler::add(const Json& reply) {
  const Json* header = fieldAt(reply, "header");
  if (header && header->is_object()) {
    if (auto good = addHeader(*header); !good) return good;
  }
  if (!has_header_) return std::unexpected(unfitting("the first reply has no header"));
  if (numberAt(reply, "firstRow") != rows_) {
    return std::unexpected(
        unfitting(fmt::format("row {} where {} is due", countAt(reply, "firstRow"), rows_)));
  }
  const Json* rows = fieldAt(reply, "rows");
  const auto bytes =
      rows && rows->is_string() ? base::base64Decoded(rows->get_ref<const std::string&>()) : std::nullopt;
  const auto width = static_cast<std::size_t>(snapshot_.depth_model.width_px);
  const std::size_t row_bytes = 2 * width;
  if (!bytes || bytes->size() % row_bytes != 0) return std::unexpected(unfitting("incomplete rows"));
  const int count = static_cast<int>(bytes->size() / row_bytes);
  if (rows_ + count > snapshot_.depth_model.height_px)
    return std::unexpected(unfitting("more rows than a frame has"));
  const std::size_t first = static_cast<std::size_t>(rows_) * width;
  for (std::size_t i = 0; 2 * i < bytes->size(); ++i) {
    const auto low = static_cast<unsigned char>((*bytes)[2 * i]);
    const auto high = static_cast<unsigned char>((*bytes)[2 * i + 1]);
    snapshot_.raw[first + i] = static_cast<std::uint16_t>(low | (high << 8));
  }
  rows_ += count;
  return {};
}

Result<Snapshot> SnapshotAssembler::finish() {
  if (const int height = snapshot_.depth_model.height_px; rows_ != height) {
    return std::unexpected(unfitting(fmt::format("{} rows where a frame has {}", rows_, height)));
  }
  return std::move(snapshot_);
}

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
