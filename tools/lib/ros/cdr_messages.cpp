// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/ros/cdr_messages.h"

#include <array>

#include "daemon/trace/format/cdr.h"
#include "rt/base/clock.h"

namespace hapticd::tools::ros {
namespace {

using trace::CdrWriter;

/// Seconds since 1970 have 32 bits there, until 2038.
void put(CdrWriter& writer, std::int64_t time_ns) {
  std::int64_t seconds = time_ns / rt::kNsPerSecond;
  std::int64_t rest_ns = time_ns % rt::kNsPerSecond;
  if (rest_ns < 0) {
    rest_ns += rt::kNsPerSecond;
    --seconds;
  }
  writer.number(static_cast<std::int32_t>(seconds));
  writer.number(static_cast<std::uint32_t>(rest_ns));
}

void put(CdrWriter& writer, const Header& header) {
  put(writer, header.time_ns);
  writer.text(header.frame);
}

void put(CdrWriter& writer, const rt::Vec3& vector) {
  for (const double component : {vector.x, vector.y, vector.z}) writer.number(component);
}

void put(CdrWriter& writer, const rt::Quaternion& q) {
  for (const double component : {q.x, q.y, q.z, q.w}) writer.number(component);
}

template <typename Number>
void put(CdrWriter& writer, std::span<const Number> numbers) {
  writer.number(static_cast<std::uint32_t>(numbers.size()));
  for (const Number number : numbers) writer.number(number);
}

void putArray(CdrWriter& writer, std::span<const double> numbers) {
  for (const double number : numbers) writer.number(number);
}

}  // namespace

void encodePose(const Header& header, const rt::RigidPose& pose, std::string& to) {
  CdrWriter writer(to);
  put(writer, header);
  put(writer, pose.position_m_in_world);
  put(writer, pose.orientation);
}

void encodeVelocity(const Header& header, const rt::Vec3& linear_m_per_s, std::string& to) {
  CdrWriter writer(to);
  put(writer, header);
  put(writer, linear_m_per_s);
  put(writer, rt::Vec3{});
}

void encodeForce(const Header& header, const rt::Vec3& force_n, std::string& to) {
  CdrWriter writer(to);
  put(writer, header);
  put(writer, force_n);
  put(writer, rt::Vec3{});
}

void encodeState(const Header& header, const OperatingState& state, std::string& to) {
  CdrWriter writer(to);
  put(writer, header);
  writer.text(state.state);
  writer.number(state.is_homed);
  writer.number(state.is_busy);
}

void encodeButtons(const Header& header, const HeldButtons& buttons, std::string& to) {
  CdrWriter writer(to);
  put(writer, header);
  put(writer, std::span<const float>(buttons.axes));
  put(writer, std::span<const std::int32_t>(buttons.held));
}

void encodeFrames(std::int64_t time_ns, std::span<const FixedFrame> frames, std::string& to) {
  CdrWriter writer(to);
  writer.number(static_cast<std::uint32_t>(frames.size()));
  for (const FixedFrame& frame : frames) {
    put(writer, Header{time_ns, frame.parent});
    writer.text(frame.name);
    put(writer, frame.T_parent_frame.position_m_in_world);
    put(writer, frame.T_parent_frame.orientation);
  }
}

void encodeDepthImage(const Header& header, const DepthImage& image, std::string& to) {
  constexpr std::uint32_t kPixelBytes = sizeof image.depth_mm[0];
  const std::span<const std::uint16_t> pixels(image.depth_mm);
  CdrWriter writer(to);
  put(writer, header);
  writer.number(image.height_px);
  writer.number(image.width_px);
  writer.text("16UC1");
  writer.number(std::uint8_t{0});  // little-endian
  writer.number(kPixelBytes * image.width_px);
  writer.bytes({reinterpret_cast<const char*>(pixels.data()), pixels.size_bytes()});
}

void encodeCameraInfo(const Header& header, const PinholeCamera& camera, std::string& to) {
  constexpr std::array<double, 5> kNoDistortion{};
  const double fx = camera.fx_px, fy = camera.fy_px, cx = camera.cx_px, cy = camera.cy_px;
  CdrWriter writer(to);
  put(writer, header);
  writer.number(camera.height_px);
  writer.number(camera.width_px);
  writer.text("plumb_bob");
  put(writer, std::span<const double>(kNoDistortion));
  putArray(writer, std::array{fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0});                 // k
  putArray(writer, std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});             // r
  putArray(writer, std::array{fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0});  // p
  for (int binning = 0; binning < 2; ++binning) writer.number(std::uint32_t{0});         // none
  for (int side = 0; side < 4; ++side) writer.number(std::uint32_t{0});                  // the whole image
  writer.number(false);
}

void encodeLog(std::int64_t time_ns, LogLevel level, std::string_view name, std::string_view text,
               std::string& to) {
  CdrWriter writer(to);
  put(writer, time_ns);
  writer.number(static_cast<std::uint8_t>(level));
  writer.text(name);
  writer.text(text);
  writer.text("");                  // file
  writer.text("");                  // function
  writer.number(std::uint32_t{0});  // line
}

}  // namespace hapticd::tools::ros
