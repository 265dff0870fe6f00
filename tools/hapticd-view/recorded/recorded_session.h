// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/error.h"
#include "drivers/trace/records.h"
#include "drivers/trace/trace_reader.h"
#include "rt/loop_state.h"
#include "rt/vec3.h"
#include "tools/hapticd-view/live/depth_picture.h"
#include "tools/hapticd-view/recorded/spill_file.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

/// A trace that can be read at any time of it. Ticks and depth frames are in temporary files, the rest in
/// memory as the trace holds it. Times are CLOCK_MONOTONIC in nanoseconds, as in the trace.  Thread: one at a
/// time.
class RecordedSession {
 public:
  /// Reads the whole trace. Errors: those of readTrace(), a trace without ticks or with impossible times, a
  /// full disk.
  static config::Result<RecordedSession> load(const std::filesystem::path& trace);

  const std::string& name() const noexcept { return name_; }
  const drivers::TraceInfo& info() const noexcept { return info_; }
  std::int64_t begin_ns() const { return ticks().front().planned_ns; }
  std::int64_t end_ns() const { return ticks().back().planned_ns; }
  double duration_s() const { return seconds(end_ns()); }
  /// The time since the first tick.
  double seconds(std::int64_t time_ns) const;
  std::int64_t timeAt(double seconds) const;

  /// All ticks, in the order of time; at least one.
  std::span<const rt::Tick> ticks() const noexcept;
  /// The ticks after `after_ns` up to and including `until_ns`.
  std::span<const rt::Tick> ticksWithin(std::int64_t after_ns, std::int64_t until_ns) const;

  bool hasDepth() const noexcept { return !frames_.empty(); }
  /// The index of the newest depth frame at a time; nothing: none has arrived yet.
  std::optional<std::size_t> frameAt(std::int64_t time_ns) const;
  std::size_t frameCount() const noexcept { return frames_.size(); }
  std::int64_t frameTime_ns(std::size_t index) const { return frames_[index].record.header.arrival_ns; }
  /// Decodes a depth frame; null: its data do not fit its checksum.
  std::shared_ptr<const DepthPicture> picture(std::size_t index) const;

  /// The model that was in use at a time; null: none yet.
  const drivers::ModelRecord* modelAt(std::int64_t time_ns) const;
  /// The number of the parameter set in effect at a time; 0: that of the configuration.
  std::size_t parameterSetAt(std::int64_t time_ns) const;
  /// All its parameters by name as JSON numbers, truth values and texts.
  Json parameters(std::size_t set) const;
  /// The number of the fixtures and tissue regions in effect at a time; 0: none.
  std::size_t additionsAt(std::int64_t time_ns) const;
  /// These fixtures and regions as Viewer::onAdditions() takes them.
  Json additions(std::size_t number) const;
  std::span<const drivers::EventRecord> events() const noexcept { return events_; }

 private:
  struct Frame {
    drivers::DepthRecord record;  ///< without its image
    std::uint64_t offset = 0;     ///< of the encoded image in images_
    std::uint64_t bytes = 0;
  };
  struct Additions {
    std::int64_t time_ns = 0;
    std::string text;  ///< YAML
  };
  class Loading;

  RecordedSession(SpillFile ticks, SpillFile images) : ticks_(std::move(ticks)), images_(std::move(images)) {}

  std::string name_;
  drivers::TraceInfo info_;
  SpillFile ticks_;
  SpillFile images_;
  std::vector<Frame> frames_;
  std::vector<drivers::ModelRecord> models_;
  std::vector<drivers::EventRecord> events_;
  // in the order of their times; the numbers of the functions above count from 1 here
  std::vector<Additions> additions_;
  std::vector<drivers::DirectiveRecord> directives_;
  Json configured_ = Json::object();  // the parameters of the configuration
};

}  // namespace hapticd::tools::view
