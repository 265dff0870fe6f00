// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/trace_volume.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "config/settings/driver_rows.h"
#include "drivers/trace/format/messages.h"
#include "drivers/trace/foxglove/foxglove_messages.h"
#include "drivers/trace/foxglove/foxglove_scene.h"
#include "drivers/trace/foxglove/foxglove_schemas.h"
#include "drivers/trace/mcap/mcap_format.h"
#include "drivers/trace/trace_writer.h"

namespace hapticd::drivers {
namespace {

constexpr double kSecondsPerHour = 3600;
// What the file format MCAP adds, in bytes (mcap_format.h).
/// To each message: the head of its record, its channel, its sequence number and two times, and an entry in
/// the index of the chunk.
constexpr std::size_t kAroundMessage = mcap::kRecordHeadBytes + 2 + 4 + 8 + 8 + 16;
/// To each chunk, which holds a second: the heads of its record and of its indexes, and an entry in the
/// summary.
constexpr double kAroundChunk = 600;
/// To each file: schemas, settings and summary.
constexpr double kAroundFile = 200'000;
/// A frame is modelled again where the HIP leaves the part that was modelled.
constexpr double kModelsPerFrame = 2;
constexpr double kBytesPerPixel = 2;
constexpr double kBytesPerPoint = 12;
constexpr double kBytesPerMb = 1e6;

template <typename Record>
double bytesOf(const Record& record) {
  std::string message;
  encode(record, 0, message);
  return static_cast<double>(message.size() + kAroundMessage);
}

/// A tick of which the picture shows everything: HIP, proxy and force.
rt::Tick drawnTick() {
  rt::Tick tick;
  tick.mode = rt::Mode::engaged;
  tick.law = rt::lawThat(&rt::ForceLawRow::has_proxy);
  tick.contact = rt::ContactState::contact;
  tick.command_force_n_in_world = {1, 2, 3};
  return tick;
}

double sceneBytes() {
  std::string message;
  foxglove::encodeScene(0, drawnTick(), {}, {{}, 0.1}, message);
  return static_cast<double>(message.size() + kAroundMessage);
}

double transformBytes() {
  std::string message;
  foxglove::encodeCameraTransforms(0, {}, message);
  return static_cast<double>(message.size() + kAroundMessage);
}

double cloudBytes(double points) {
  std::string message;
  foxglove::encodePointCloud(0, foxglove::kCameraFrame, {}, message);
  return static_cast<double>(message.size() + kAroundMessage) + points * kBytesPerPoint;
}

std::uint64_t hourOf(double bytes_per_second) {
  return static_cast<std::uint64_t>(std::ceil(bytes_per_second * kSecondsPerHour));
}

}  // namespace

TraceVolume mostPerHour(const config::Settings& settings, bool depth) {
  const rt::DepthModelParameters camera = settings.camera.effectiveDepthModel();
  const double pixels = double{1} * camera.width_px * camera.height_px;
  const double frames_hz = config::driverOf(settings.camera).rate_hz(settings.camera);
  const double snapshots_hz = 1e9 / static_cast<double>(depth ? kMinSnapshotPeriod_ns : kSnapshotPeriod_ns);
  const double ticks_per_s = settings.loop.rate_hz * bytesOf(rt::Tick{}) +
                             frames_hz * kModelsPerFrame * bytesOf(ModelRecord{}) +
                             snapshots_hz * bytesOf(SnapshotRecord{});
  TraceVolume volume;
  if (settings.trace.scene != config::TraceScene::off) {
    volume.scene = hourOf(static_cast<double>(kSceneRate_hz) * sceneBytes() + transformBytes());
  }
  if (depth) {
    volume.depth = hourOf(frames_hz * (bytesOf(DepthRecord{}) + pixels * kBytesPerPixel));
    if (settings.trace.scene == config::TraceScene::cloud)
      volume.clouds = hourOf(frames_hz * cloudBytes(pixels));
  }
  volume.ticks = hourOf(ticks_per_s);
  // a chunk ends after a second, or earlier with as many bytes as a message may have
  const double chunks =
      kSecondsPerHour + static_cast<double>(volume.total()) / double{mcap::kMaxMessageBytes};
  const config::TraceSettings& trace = settings.trace;
  const double file_mb =
      trace.max_folder_mb > 0 ? std::min(trace.max_file_mb, trace.max_folder_mb / 4) : trace.max_file_mb;
  const double files =
      2 + kSecondsPerHour / kMaxFile_s + static_cast<double>(volume.total()) / (file_mb * kBytesPerMb);
  volume.ticks += static_cast<std::uint64_t>(chunks * kAroundChunk + files * kAroundFile);
  return volume;
}

}  // namespace hapticd::drivers
