// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/snapshot/snapshot.h"

#include <fmt/format.h>

#include <cmath>

#include "config/base64.h"

namespace hapticd::tools {
namespace {

using config::Error;
using config::Result;

Error unfitting(const std::string& what) {
  return {"snapshot", what, "is hapticd of another version than hapticctl? See 'hapticctl version'"};
}

rt::Vec3 vectorAt(const Json& json, const std::string& path) {
  return {numberAt(json, path + ".x"), numberAt(json, path + ".y"), numberAt(json, path + ".z")};
}

rt::DepthModelParameters depthModelAt(const Json& header) {
  const auto at = [&](const char* name) { return numberAt(header, std::string("depthModel.") + name); };
  return {at("aPerM"), at("bPerM"), at("fxPx"), at("fyPx"), at("cxPx"), at("cyPx"), at("nearM"), at("farM")};
}

rt::PoseParameters poseAt(const Json& header) {
  const auto at = [&](const char* name) { return numberAt(header, std::string("cameraPose.") + name); };
  return {{at("xM"), at("yM"), at("zM")}, at("rollRad"), at("pitchRad"), at("yawRad")};
}

bool isFinite(const rt::DepthModelParameters& m) {
  // one NaN makes the sum NaN
  return std::isfinite(m.a_per_m + m.b_per_m + m.fx_px + m.fy_px + m.cx_px + m.cy_px + m.near_m + m.far_m);
}

bool isFinite(const rt::PoseParameters& pose) {
  return rt::isFinite(pose.position_m) && std::isfinite(pose.roll_rad + pose.pitch_rad + pose.yaw_rad);
}

}  // namespace

Result<void> SnapshotAssembler::addHeader(const Json& header) {
  if (numberAt(header, "width") != rt::kFrameWidth || numberAt(header, "height") != rt::kFrameHeight) {
    return std::unexpected(
        unfitting(fmt::format("a frame of {}x{} pixels, {}x{} expected", countAt(header, "width"),
                              countAt(header, "height"), rt::kFrameWidth, rt::kFrameHeight)));
  }
  const double frame = numberAt(header, "frame");
  snapshot_.frame = std::isnan(frame) ? 0 : static_cast<std::int64_t>(frame);
  snapshot_.depth_model = depthModelAt(header);
  snapshot_.T_world_camera = poseAt(header);
  // null if the core knows none: the mark is not drawn then
  snapshot_.hip_m_in_world = vectorAt(header, "tick.hipMInWorld");
  snapshot_.proxy_m_in_world = vectorAt(header, "tick.proxyMInWorld");
  if (!isFinite(snapshot_.depth_model) || !isFinite(snapshot_.T_world_camera)) {
    return std::unexpected(unfitting("the depth model or the camera's pose is missing"));
  }
  snapshot_.raw.assign(rt::kFramePixels, rt::kRawNoMeasurement);
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
      rows && rows->is_string() ? config::base64Decoded(rows->get_ref<const std::string&>()) : std::nullopt;
  constexpr std::size_t kRowBytes = 2 * rt::kFrameWidth;
  if (!bytes || bytes->size() % kRowBytes != 0)
    return std::unexpected(unfitting("rows that are no whole rows"));
  const int count = static_cast<int>(bytes->size() / kRowBytes);
  if (rows_ + count > rt::kFrameHeight) return std::unexpected(unfitting("more rows than a frame has"));
  const std::size_t first = static_cast<std::size_t>(rows_) * rt::kFrameWidth;
  for (std::size_t i = 0; 2 * i < bytes->size(); ++i) {
    const auto low = static_cast<unsigned char>((*bytes)[2 * i]);
    const auto high = static_cast<unsigned char>((*bytes)[2 * i + 1]);
    snapshot_.raw[first + i] = static_cast<std::uint16_t>(low | (high << 8));
  }
  rows_ += count;
  return {};
}

Result<Snapshot> SnapshotAssembler::finish() {
  if (rows_ != rt::kFrameHeight) {
    return std::unexpected(unfitting(fmt::format("{} rows where a frame has {}", rows_, rt::kFrameHeight)));
  }
  return std::move(snapshot_);
}

}  // namespace hapticd::tools
