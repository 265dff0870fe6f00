// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/writer/trace_writer.h"
#include "config/settings/driver_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "daemon/trace/format/additions.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/format/records.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/mcap/mcap_writer.h"
#include "daemon/trace/ros/message_definitions.h"
#include "daemon/trace/ros/message_set.h"
#include "daemon/trace/ros/scene_picture.h"
#include "rt/base/clock.h"

namespace hapticd::trace {
namespace {

struct OpenChannel {
  std::uint16_t id = 0;
  std::uint32_t messages = 0;
};

base::Result<void> checkAttachments(const TraceOptions& options) {
  constexpr std::size_t kMaxBytes = mcap::kMaxAttachmentBytes;
  for (const TraceAttachment& attachment : options.attachments) {
    if (attachment.data.size() <= kMaxBytes) continue;
    return base::failure(
        attachment.name,
        fmt::format("has {} bytes; a trace accepts at most {}", attachment.data.size(), kMaxBytes), "");
  }
  return {};
}

}  // namespace

class TraceWriter::Implementation {
 public:
  Implementation(TraceFile part, const std::filesystem::path& file, const TraceOptions& options)
      : file_(std::move(part), file, options.compress),
        chunk_ns_(static_cast<std::uint64_t>(std::max<std::int64_t>(options.chunk_ns, 0))),
        first_chunk_ns_(static_cast<std::uint64_t>(std::max<std::int64_t>(options.first_chunk_ns, 0))),
        offset_ns_(static_cast<std::uint64_t>(options.realtime_offset_ns)),
        draws_(options.scene),
        camera_(options.depth_header) {}

  base::Result<void> begin(const TraceOptions& options) {
    std::vector<std::pair<std::string, std::string>> trace{
        {std::string(kVersionKey), std::string(kTraceVersion)},
        {std::string(kOffsetKey), std::to_string(options.realtime_offset_ns)}};
    if (options.number > 0) trace.emplace_back(kNumberKey, std::to_string(options.number));
    if (options.clock_is_set)
      trace.emplace_back(kClockKey, *options.clock_is_set ? kClockIsSet : kClockIsNotSet);
    file_.addMetadata(kTraceMetadata, trace);
    file_.addMetadata(kOwnerMetadata, options.metadata);
    open<rt::Tick, ModelRecord, DirectiveRecord, AdditionsRecord, PoseRecord, EventRecord, SnapshotRecord>();
    if (options.depth) open<DepthRecord>();
    if (options.scene) {
      open(ros::kSceneChannel);
      open(ros::kTransformsChannel);
    }
    if (options.cloud) open(ros::kReachCloudChannel);
    for (const TraceAttachment& attachment : options.attachments) {
      file_.addAttachment({0, 0, attachment.name, attachment.media_type, attachment.data});
    }
    return file_.begin();
  }

  base::Result<void> write(const rt::Tick& tick) {
    auto written = add(tick);
    if (written) ++ticks_pending_;
    return written && draws_ ? writeScene(tick) : written;
  }
  base::Result<void> write(const ModelRecord& model) {
    ball_ = {model.centre_m_in_world, model.radius_m};
    return add(model);
  }
  base::Result<void> write(const DirectiveRecord& directive) {
    for (const auto& [name, value] : directive.parameters) radii_.set(name, value);
    return add(directive);
  }
  base::Result<void> write(const AdditionsRecord& additions) {
    for (const auto& solid : additions.solids) {
      if (!attached_.insert(solid->sha256()).second) continue;
      const std::string name = attachmentNameOf(*solid);
      const std::uint64_t time_ns = realtimeOf(additions.time_ns);
      auto written = file_.attach({time_ns, time_ns, name, "application/octet-stream", solid->file()});
      if (!written) return counted(std::move(written));
    }
    return add(additions);
  }
  base::Result<void> write(const auto& record) { return add(record); }
  base::Result<void> write(const CloudRecord& cloud) {
    const std::uint64_t time_ns = realtimeOf(cloud.time_ns);
    message_.clear();
    ros::encodePoints({static_cast<std::int64_t>(time_ns), ros::kOpticalFrame}, cloud.points_m_in_optical,
                      message_);
    return put(ros::kReachCloudChannel.topic, time_ns);
  }

  base::Result<void> flush() { return counted(file_.flush()); }
  base::Result<void> close() {
    const bool failed_before = file_.failure().has_value();
    auto closed = file_.finish();
    return file_.failure() && !failed_before ? counted(std::unexpected(*file_.failure())) : counted(closed);
  }

  const mcap::Writer& file() const { return file_; }
  std::uint64_t ticks() const { return ticks_; }
  std::uint64_t ticksPending() const { return ticks_pending_; }

 private:
  template <typename... Records>
  void open() {
    (open(kChannelName<Records>, schemaOf<Records>()), ...);
  }
  void open(const ChannelName& name, std::string_view schema) {
    channels_[name.topic].id = file_.addChannel(name.topic, name.schema, schema);
  }
  void open(const ros::Channel& name) {
    channels_[name.topic].id =
        file_.addChannel(name.topic, ros::fullTypeName(name.message), ros::completeDefinition(name.message));
  }

  /// Wraps instead of overflowing, whatever the record contains.
  std::uint64_t realtimeOf(std::int64_t time_ns) const {
    return static_cast<std::uint64_t>(time_ns) + offset_ns_;
  }

  template <typename Record>
  base::Result<void> add(const Record& record) {
    const std::uint64_t time_ns = realtimeOf(timeOf(record));
    message_.clear();
    encode(record, time_ns, message_);
    return put(kChannelName<Record>.topic, time_ns);
  }

  /// Adds the encoded message.
  base::Result<void> put(std::string_view topic, std::uint64_t time_ns) {
    const auto channel = channels_.find(topic);
    if (channel == channels_.end()) {
      return base::failure(file_.file().string(), fmt::format("was begun without the channel {}", topic), "");
    }
    if (message_.size() > mcap::kMaxMessageBytes) {
      return base::failure(std::string(topic),
                           fmt::format("a message of {} bytes; a trace accepts at most {}", message_.size(),
                                       mcap::kMaxMessageBytes),
                           "");
    }
    if (auto written = makeRoom(time_ns); !written) return written;
    file_.addMessage(channel->second.id, channel->second.messages++, time_ns, message_);
    return {};
  }

  /// Writes what the picture needs. Its messages have the time of the tick that caused them, although the
  /// scene is an earlier tick's, which may be in a chunk already.
  base::Result<void> writeScene(const rt::Tick& tick) {
    const std::uint64_t time_ns = realtimeOf(tick.planned_ns);
    if (tick.planned_ns >= next_transforms_ns_) {
      next_transforms_ns_ = tick.planned_ns + rt::kNsPerSecond;
      message_.clear();
      ros::encodeCameraTransforms(time_ns, camera_, message_);
      if (auto written = put(ros::kTransformsChannel.topic, time_ns); !written) {
        return written;
      }
    }
    const std::optional<rt::Tick> shown = decimator_.add(tick);
    if (!shown) return {};
    message_.clear();
    ros::encodeScene(realtimeOf(shown->planned_ns), *shown, radii_, ball_, message_);
    return put(ros::kSceneChannel.topic, time_ns);
  }

  /// Writes a chunk if a message of this time makes the pending ones long enough. Records of one channel lag
  /// behind those of another, so the newest ones are held back.
  base::Result<void> makeRoom(std::uint64_t time_ns) {
    constexpr std::uint64_t kHeldShare = 10;  // of a chunk
    if (file_.failure()) return std::unexpected(*file_.failure());
    if (file_.pendingBytes() == 0) return {};
    const std::uint64_t least_ns = ticks_ == 0 ? std::min(first_chunk_ns_, chunk_ns_) : chunk_ns_;
    const std::uint64_t held_ns = std::min(chunk_ns_ / kHeldShare, least_ns / 2);
    const bool long_enough =
        time_ns >= least_ns && time_ns - least_ns >= file_.earliestPending_ns();  // false for a late one
    const auto isFull = [this] { return file_.pendingBytes() >= mcap::kMaxMessageBytes; };
    if (!long_enough && !isFull()) return {};
    auto written = file_.flushUpTo(time_ns - std::min(time_ns, held_ns));
    if (written && isFull()) written = file_.flush();
    return counted(std::move(written));
  }

  base::Result<void> counted(base::Result<void> written) {
    const std::uint64_t left = file_.pendingMessages(channels_[kChannelName<rt::Tick>.topic].id);
    if (written) ticks_ += ticks_pending_ - left;
    ticks_pending_ = left;
    return written;
  }

  mcap::Writer file_;
  std::uint64_t chunk_ns_;
  std::uint64_t first_chunk_ns_;
  std::uint64_t offset_ns_;
  std::map<std::string_view, OpenChannel> channels_;  // by topic
  bool draws_;                                        // writes the 3D picture
  std::set<std::string> attached_;                    // SHA-256 of the solids in the file
  rt::DepthFrameHeader camera_;
  ros::SceneRadii radii_;
  ros::ModelledBall ball_;
  ros::TickDecimator decimator_{rt::kNsPerSecond / kSceneRate_hz};
  std::int64_t next_transforms_ns_ = std::numeric_limits<std::int64_t>::min();
  std::uint64_t ticks_ = 0;
  std::uint64_t ticks_pending_ = 0;
  std::string message_;
};

base::Result<std::unique_ptr<TraceWriter>> TraceWriter::create(const std::filesystem::path& file,
                                                               const TraceOptions& options) {
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    return base::failure(file.string(), "already exists", "choose another name");
  }
  if (auto checked = checkAttachments(options); !checked) return std::unexpected(checked.error());
  auto part = TraceFile::create(partOf(file));
  if (!part) return std::unexpected(part.error());
  auto implementation = std::make_unique<Implementation>(std::move(*part), file, options);
  if (auto begun = implementation->begin(options); !begun) {
    std::filesystem::remove(partOf(file), ignored);
    return std::unexpected(begun.error());
  }
  return std::unique_ptr<TraceWriter>(new TraceWriter(std::move(implementation)));
}

TraceWriter::TraceWriter(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
TraceWriter::~TraceWriter() = default;

template <typename Record>
base::Result<void> TraceWriter::write(const Record& record) {
  return implementation_->write(record);
}
template base::Result<void> TraceWriter::write(const rt::Tick&);
template base::Result<void> TraceWriter::write(const ModelRecord&);
template base::Result<void> TraceWriter::write(const DirectiveRecord&);
template base::Result<void> TraceWriter::write(const AdditionsRecord&);
template base::Result<void> TraceWriter::write(const PoseRecord&);
template base::Result<void> TraceWriter::write(const EventRecord&);
template base::Result<void> TraceWriter::write(const SnapshotRecord&);
template base::Result<void> TraceWriter::write(const DepthRecord&);
template base::Result<void> TraceWriter::write(const CloudRecord&);

base::Result<void> TraceWriter::flush() {
  return implementation_->flush();
}
base::Result<void> TraceWriter::close() {
  return implementation_->close();
}

const std::filesystem::path& TraceWriter::file() const noexcept {
  return implementation_->file().file();
}
std::uint64_t TraceWriter::bytes() const noexcept {
  return implementation_->file().bytes();
}
std::uint64_t TraceWriter::ticks() const noexcept {
  return implementation_->ticks();
}
std::uint64_t TraceWriter::ticksPending() const noexcept {
  return implementation_->ticksPending();
}

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
  ros::encodeScene(0, drawnTick(), {}, {{}, 0.1}, message);
  return static_cast<double>(message.size() + kAroundMessage);
}

double transformBytes() {
  std::string message;
  ros::encodeCameraTransforms(0, {}, message);
  return static_cast<double>(message.size() + kAroundMessage);
}

double cloudBytes(double points) {
  std::string message;
  ros::encodePoints({0, ros::kOpticalFrame}, {}, message);
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

}  // namespace hapticd::trace
