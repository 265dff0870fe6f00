// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/ros/ros_bag.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/trace/export/trace_summary.h"
#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/mcap/mcap_writer.h"
#include "daemon/trace/ros/depth_view.h"
#include "daemon/trace/ros/message_definitions.h"
#include "daemon/trace/ros/message_set.h"
#include "daemon/trace/ros/scene_picture.h"
#include "rt/base/clock.h"
#include "rt/base/pose.h"
#include "tools/lib/ros/ros_name.h"
#include "tools/lib/ros/tick_messages.h"

namespace hapticd::tools::ros {
namespace {

namespace fs = std::filesystem;
namespace mcap = trace::mcap;
using trace::ros::FixedFrame;
using trace::ros::Header;
using trace::ros::LogLevel;

using Pairs = std::vector<std::pair<std::string, std::string>>;

constexpr std::array kBagTopics{Topic::measured_cp,     Topic::measured_cv, Topic::setpoint_cf,
                                Topic::operating_state, Topic::buttons,     Topic::events,
                                Topic::depth_image,     Topic::camera_info, Topic::tf_static};

constexpr bool isOfDepth(Topic topic) {
  return topic == Topic::depth_image || topic == Topic::camera_info;
}

/// The settings of the publisher, by which rosbag2 publishes when it plays the bag. Policies are numbers, as
/// rosbag2 writes them up to version 8 of its metadata: every version reads those.
std::string offeredQos(const TopicRow& row) {
  constexpr int kTransientLocal = 1, kVolatile = 2;
  constexpr std::string_view kInfinite = "    sec: 9223372036\n    nsec: 854775807\n";
  return fmt::format(
      "- history: 1\n  depth: {}\n  reliability: 1\n  durability: {}\n  deadline:\n{}  lifespan:\n{}"
      "  liveliness: 1\n  liveliness_lease_duration:\n{}  avoid_ros_namespace_conventions: false",
      row.for_late ? 1 : 10, row.for_late ? kTransientLocal : kVolatile, kInfinite, kInfinite, kInfinite);
}

/// The metadata by which rosbag2 knows which form of the settings above to expect. It counts the messages of
/// each topic anew, from the index of the file.
std::string bagMetadata(std::uint64_t messages, std::int64_t first_ns, std::int64_t last_ns) {
  return fmt::format(
      "version: 8\n"
      "storage_identifier: mcap\n"
      "duration:\n  nanoseconds: {}\n"
      "starting_time:\n  nanoseconds_since_epoch: {}\n"
      "message_count: {}\n"
      "topics_with_message_count: []\n"
      "compression_format: \"\"\n"
      "compression_mode: \"\"\n"
      "relative_file_paths: []\n"
      "files: []\n"
      "custom_data: {{}}\n"
      "ros_distro: unknown",
      static_cast<std::uint64_t>(last_ns) - static_cast<std::uint64_t>(first_ns), first_ns, messages);
}

/// The bag while it is written.
class BagFile {
 public:
  static base::Result<BagFile> create(const fs::path& file, base::IfExists if_exists,
                                      const std::string& name_space, bool depth);

  /// `encode`: appends the message.
  template <typename Encode>
  void add(Topic topic, std::int64_t utc_ns, Encode encode) {
    message_.clear();
    encode(message_);
    addMessage(topic, utc_ns);
  }
  bool isGood() const { return !failure_; }
  std::uint64_t messages() const { return messages_; }
  /// Gives the file its name.
  base::Result<void> finish();

 private:
  BagFile(base::WholeFile whole, std::unique_ptr<mcap::Writer> writer, fs::path file)
      : whole_(std::move(whole)), writer_(std::move(writer)), file_(std::move(file)) {}

  void addMessage(Topic topic, std::int64_t utc_ns);
  base::Result<void> writeEnd();
  /// The error of the draft as one of the bag.
  base::Error ofBag(const base::Error& error) const {
    return {file_.string(), error.what, "free space, or name a file on another disk with --out"};
  }

  base::WholeFile whole_;
  std::unique_ptr<mcap::Writer> writer_;
  fs::path file_;
  std::array<std::uint16_t, kTopicCount> channels_{};
  std::array<std::uint32_t, kTopicCount> sequences_{};
  std::string message_;
  std::uint64_t messages_ = 0;
  std::int64_t first_ns_ = 0;
  std::int64_t last_ns_ = 0;
  std::size_t kept_bytes_ = 0;  // of messages that wait for earlier ones
  std::optional<base::Error> failure_;
};

base::Result<BagFile> BagFile::create(const fs::path& file, base::IfExists if_exists,
                                      const std::string& name_space, bool depth) {
  auto whole = base::WholeFile::create(file, if_exists);
  if (!whole) return std::unexpected(whole.error());
  auto part = trace::TraceFile::openToMend(whole->draft());
  if (!part) return std::unexpected(part.error());
  const fs::path draft = whole->draft();
  auto writer = std::make_unique<mcap::Writer>(std::move(*part), draft, /*compress=*/true, "ros2");
  BagFile bag(std::move(*whole), std::move(writer), file);
  for (const Topic topic : kBagTopics) {
    if (isOfDepth(topic) && !depth) continue;
    const TopicRow& row = rowOf(topic);
    const Pairs metadata{{"offered_qos_profiles", offeredQos(row)},
                         {"topic_type_hash", trace::ros::typeHash(row.message)}};
    bag.channels_[static_cast<std::size_t>(topic)] =
        bag.writer_->addChannel("/" + nameOf(topic, name_space), trace::ros::fullTypeName(row.message),
                                trace::ros::completeDefinition(row.message), metadata);
  }
  if (auto begun = bag.writer_->begin(); !begun) return std::unexpected(bag.ofBag(begun.error()));
  return bag;
}

void BagFile::addMessage(Topic topic, std::int64_t utc_ns) {
  if (failure_) return;
  // measurements and exposures are earlier than the ticks and frames that bring them
  constexpr std::int64_t kLatest_ns = 100'000'000;
  constexpr std::size_t kChunkBytes = 2 << 20;
  const auto place = static_cast<std::size_t>(topic);
  writer_->addMessage(channels_[place], ++sequences_[place], static_cast<std::uint64_t>(utc_ns), message_);
  ++messages_;
  first_ns_ = messages_ == 1 ? utc_ns : std::min(first_ns_, utc_ns);
  last_ns_ = messages_ == 1 ? utc_ns : std::max(last_ns_, utc_ns);
  if (writer_->pendingBytes() < kept_bytes_ + kChunkBytes) return;
  if (auto written =
          writer_->flushUpTo(static_cast<std::uint64_t>(std::max(last_ns_, kLatest_ns) - kLatest_ns));
      !written)
    failure_ = ofBag(written.error());
  kept_bytes_ = writer_->pendingBytes();
}

base::Result<void> BagFile::writeEnd() {
  if (auto flushed = writer_->flush(); !flushed) return flushed;
  const Pairs metadata{{"serialized_metadata", bagMetadata(messages_, first_ns_, last_ns_)},
                       {"ROS_DISTRO", "unknown"}};
  if (auto described = writer_->describe("rosbag2", metadata); !described) return described;
  return writer_->end();
}

base::Result<void> BagFile::finish() {
  if (failure_) return std::unexpected(*failure_);
  if (auto ended = writeEnd(); !ended) return std::unexpected(ofBag(ended.error()));
  return whole_.finish();
}

/// The frames of camera and handle in the world, as far as the trace knows them.
class BagFrames {
 public:
  BagFrames(const std::string& name_space, std::string_view settings) : prefix_(name_space + "/") {
    const std::vector<trace::TraceSetting> all = trace::settingsIn(settings);
    camera_ = poseIn(all, "camera");
    handle_ = poseIn(all, "handle");
  }

  /// Takes over the pose of the camera; returns whether it is another one.
  bool setCamera(const rt::DepthFrameHeader& camera) {
    const auto& [x_m, y_m, z_m] = camera.position_m_in_world;
    const rt::RigidPose pose{{x_m, y_m, z_m}, rt::quaternionOf(camera.rotation_world_camera)};
    if (camera_ == pose || !isFinite(pose.position_m_in_world)) return false;
    camera_ = pose;
    return true;
  }
  std::vector<FixedFrame> all() const {
    std::vector<FixedFrame> frames;
    if (camera_) frames = trace::ros::cameraFrames(prefix_, *camera_);
    if (handle_) frames.push_back({world(), prefix_ + "handle", *handle_});
    return frames;
  }
  std::string world() const { return prefix_ + "world"; }
  std::string optical() const { return prefix_ + "camera_optical"; }

 private:
  static std::optional<rt::RigidPose> poseIn(const std::vector<trace::TraceSetting>& settings,
                                             std::string_view group) {
    rt::PoseParameters pose;
    const std::array<std::pair<std::string_view, double*>, 6> numbers{{{"position_x_m", &pose.position_m.x},
                                                                       {"position_y_m", &pose.position_m.y},
                                                                       {"position_z_m", &pose.position_m.z},
                                                                       {"roll_rad", &pose.roll_rad},
                                                                       {"pitch_rad", &pose.pitch_rad},
                                                                       {"yaw_rad", &pose.yaw_rad}}};
    for (const auto& [name, number] : numbers) {
      const auto found =
          std::ranges::find(settings, fmt::format("{}.{}", group, name), &trace::TraceSetting::name);
      const auto value = found == settings.end() ? std::nullopt : trace::numberIn(found->value);
      if (!value || !std::isfinite(*value)) return std::nullopt;
      *number = *value;
    }
    return rt::RigidPose{pose.position_m, rt::quaternionOf(rt::rotationOf(pose))};
  }

  std::string prefix_;
  std::optional<rt::RigidPose> camera_;
  std::optional<rt::RigidPose> handle_;
};

/// Makes messages of the records of a trace.
class BagExport {
 public:
  BagExport(const trace::SelectedTrace& trace, BagFile bag, const std::string& name_space)
      : trace_(trace),
        bag_(std::move(bag)),
        name_space_(name_space),
        frames_(name_space, trace::settingsText(trace.info())),
        world_(frames_.world()),
        optical_(frames_.optical()) {}

  /// Reads the trace to its end.
  base::Result<BagContent> write(const trace::Progress& progress) {
    const trace::TraceVisitor visitor{.tick = [this](const rt::Tick& tick) { return add(tick); },
                                      .event = [this](const auto& event) { return add(event); },
                                      .depth = [this](const auto& depth) { return add(depth); }};
    const auto info = trace_.read(visitor, progress);
    if (!info) return std::unexpected(info.error());
    if (fault_) return std::unexpected(*fault_);
    if (auto finished = bag_.finish(); !finished) return std::unexpected(finished.error());
    return BagContent{bag_.messages(), depth_frames_};
  }

 private:
  bool add(const rt::Tick& tick) {
    const std::int64_t time_ns = utc_ns(tick.planned_ns);
    addFramesOnce(time_ns);
    if (const OperatingState state = operatingStateOf(tick); state != state_) {
      state_ = state;
      bag_.add(Topic::operating_state, time_ns, [&](std::string& to) {
        encodeState({time_ns, world_}, state, to);
      });
    }
    if (const auto buttons = messages_.newButtons(tick)) {
      const Header header{utc_ns(buttons->time_ns), world_};
      bag_.add(Topic::buttons, header.time_ns, [&](std::string& to) { encodeButtons(header, *buttons, to); });
    }
    if (const auto force_n = commandedForce(tick)) {
      bag_.add(Topic::setpoint_cf, time_ns, [&](std::string& to) {
        trace::ros::encodeWrench({time_ns, world_}, *force_n, {}, to);
      });
    }
    if (const auto measurement = messages_.newMeasurement(tick)) addMeasurement(*measurement);
    return bag_.isGood();
  }

  void addMeasurement(const Measurement& measurement) {
    const Header header{utc_ns(measurement.time_ns), world_};
    bag_.add(Topic::measured_cp, header.time_ns,
             [&](std::string& to) { encodePose(header, measurement.T_world_tool, to); });
    bag_.add(Topic::measured_cv, header.time_ns,
             [&](std::string& to) { encodeVelocity(header, measurement.velocity_m_per_s_in_world, to); });
  }

  bool add(const trace::EventRecord& event) {
    const std::int64_t time_ns = utc_ns(event.time_ns);
    const bool ends =
        std::ranges::count(event.fields, std::pair<std::string, std::string>("STATE", "end")) > 0;
    const LogLevel level = event.kind == "warning" && !ends ? LogLevel::warning : LogLevel::info;
    bag_.add(Topic::events, time_ns, [&](std::string& to) {
      encodeLog(time_ns, level, name_space_ + "." + event.kind, event.text, to);
    });
    return bag_.isGood();
  }

  bool add(const trace::DepthRecord& depth) {
    const rt::DepthFrameHeader& camera = depth.header;
    if (const std::string wrong = decoder_.decode(depth, image_); !wrong.empty()) {
      fault_ = base::Error{trace_.file().string(), wrong, ""};
      return false;
    }
    view_.set(camera, std::as_bytes(std::span(image_)));
    const Header header{utc_ns(view_.time_ns()), optical_};
    if (frames_.setCamera(camera)) addFrames(header.time_ns);
    addFramesOnce(header.time_ns);
    view_.millimetres(millimetres_);
    bag_.add(Topic::depth_image, header.time_ns,
             [&](std::string& to) { encodeDepthImage(header, millimetres_, to); });
    bag_.add(Topic::camera_info, header.time_ns,
             [&](std::string& to) { encodeCameraInfo(header, view_.camera(), to); });
    ++depth_frames_;
    return bag_.isGood();
  }

  void addFramesOnce(std::int64_t time_ns) {
    if (!frames_were_added_) addFrames(time_ns);
  }
  void addFrames(std::int64_t time_ns) {
    frames_were_added_ = true;
    const std::vector<FixedFrame> frames = frames_.all();
    if (frames.empty()) return;
    bag_.add(Topic::tf_static, time_ns, [&](std::string& to) { encodeFrames(time_ns, frames, to); });
  }

  /// Wraps instead of overflowing, whatever the file contains.
  std::int64_t utc_ns(std::int64_t monotonic_ns) const {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(monotonic_ns) +
                                     static_cast<std::uint64_t>(trace_.realtimeOffset_ns()));
  }

  const trace::SelectedTrace& trace_;
  BagFile bag_;
  std::string name_space_;
  BagFrames frames_;
  std::string world_;
  std::string optical_;
  TickMessages messages_;
  std::optional<OperatingState> state_;
  bool frames_were_added_ = false;
  trace::DepthDecoder decoder_;
  std::string image_;
  trace::ros::DepthView view_;
  trace::ros::DepthImage millimetres_;
  std::uint64_t depth_frames_ = 0;
  std::optional<base::Error> fault_;
};

}  // namespace

base::Result<BagContent> exportBag(const fs::path& trace, const fs::path& bag, const std::string& name_space,
                                   const trace::TraceSelection& selection, const trace::Progress& progress,
                                   base::IfExists if_exists) {
  const auto selected = trace::SelectedTrace::open(trace, selection);
  if (!selected) return std::unexpected(selected.error());
  if (auto there = selected->requireTicks(); !there) return std::unexpected(there.error());
  const bool depth = selected->info().topics.contains(trace::kChannelName<trace::DepthRecord>.topic);
  auto file = BagFile::create(bag, if_exists, name_space, depth);
  if (!file) return std::unexpected(file.error());
  return BagExport(*selected, std::move(*file), name_space).write(progress);
}

}  // namespace hapticd::tools::ros
