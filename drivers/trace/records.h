// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "rt/depth_frame_header.h"
#include "rt/force_loop.h"
#include "rt/loop_state.h"
#include "rt/vec3.h"
#include "rt/words.h"

/// What a trace holds, one structure per channel. Ticks are rt::Tick. Times are CLOCK_MONOTONIC in
/// nanoseconds; a trace carries the offset of its clock to CLOCK_REALTIME.
namespace hapticd::drivers {

/// A scene that the scene thread has built, and the frame that it is of.
struct ModelRecord {
  std::uint64_t model = 0;          ///< number of the scene: Tick::scene_model
  std::int64_t time_ns = 0;         ///< when it was built
  std::int64_t build_ns = 0;        ///< how long that took
  std::uint64_t frame = 0;          ///< sequence number of the depth frame
  std::int64_t frame_time_ns = 0;   ///< of its arrival
  std::uint32_t device_ticks = 0;   ///< of the camera's own clock
  rt::Vec3 centre_m_in_world = {};  ///< around which it was modelled
  double radius_m = 0;              ///< that was asked for
  std::uint64_t generation = 0;     ///< of the Directive whose needs it meets
  bool forgot = false;              ///< filter and fusion began anew with it
  bool depth_recorded = false;      ///< the raw frame was taken into the trace
  std::uint32_t points = 0;
  std::uint32_t points_over_capacity = 0;
  std::uint64_t frames = 0;          ///< taken over so far
  std::uint64_t skipped_frames = 0;  ///< replaced by a newer one before they were modelled, so far
  std::uint64_t damaged_frames = 0;  ///< not delivered by the camera, so far
};

/// What the force loop was told from a generation on.
struct DirectiveRecord {
  std::int64_t time_ns = 0;
  std::uint64_t generation = 0;
  bool engage = false;
  bool engage_inside = false;
  std::uint64_t engage_request = 0;
  /// All live parameters by name, in the form that reads back as the same value. They name the law in use,
  /// also where force.law is auto.
  std::vector<std::pair<std::string, std::string>> parameters = {};
};

/// Something that happened, as the journal has it.
struct EventRecord {
  std::int64_t time_ns = 0;
  std::string kind = {};  ///< mode, camera, handle, parameter, engage, warning, trace, ...
  std::string text = {};  ///< one line for people
  std::vector<std::pair<std::string, std::string>> fields = {};
};

/// What the core remembered before a tick; for the same version of hapticd only.
struct SnapshotRecord {
  std::int64_t time_ns = 0;
  rt::CoreSnapshot snapshot = {};
  bool usable =
      true;  ///< read from a trace: this version's core has the same layout; else its memory is empty
};

/// Bytes of a length that varies.
struct ByteString {
  std::string bytes = {};
};

/// How DepthRecord::image holds the raw values (depth_codec.h).
enum class DepthEncoding : std::uint8_t {
  plain,       ///< as they are
  above_zstd,  ///< differences to the value above, by zstd
};
constexpr auto wordsOf(DepthEncoding) {
  return rt::words<DepthEncoding>("plain", "above_zstd");
}

/// A raw depth frame.
struct DepthRecord {
  rt::DepthFrameHeader header = {};
  std::uint32_t raw_crc32 = 0;  ///< IEEE 802.3, of the stride_bytes * height_px bytes of raw values
  DepthEncoding encoding = DepthEncoding::plain;
  ByteString image = {};
};

}  // namespace hapticd::drivers
