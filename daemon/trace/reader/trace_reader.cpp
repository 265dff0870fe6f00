// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/reader/trace_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <new>
#include <tuple>

#include "config/base/value_text.h"
#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/format/records.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/mcap/mcap_reader.h"
#include "rt/base/clock.h"

namespace hapticd::trace {
namespace {

constexpr const char* kOtherReaders =
    "use hapticctl of that version, or Foxglove, Lichtblick or PlotJuggler, which read every version";

/// Parts of one run follow each other; meanwhile the wall clock may be set.
constexpr std::int64_t kMaxClockStep_ns = 3600 * rt::kNsPerSecond;

const mcap::Refusal kNotATrace{"is not a trace of hapticd", "give the path of a trace"};
const mcap::Refusal kABag{"is a bag of ROS 2 and not a trace of hapticd",
                          "give the path of the trace that it was made from; ros2 bag info shows a bag"};
/// Of a file without metadata of hapticd, as many messages are looked at for a channel of hapticd.
constexpr std::uint64_t kMaxForeignMessages = 10'000;

const std::string* find(const TraceText& pairs, std::string_view key) {
  const auto found = std::ranges::find(pairs, key, &TraceText::value_type::first);
  return found == pairs.end() ? nullptr : &found->second;
}

class Reading final : public mcap::Visitor {
 public:
  /// `file_bytes`: size of the file.
  Reading(const TraceVisitor& visitor, std::uint64_t file_bytes)
      : visitor_(visitor), most_kept_bytes_(mcap::mostKept(file_bytes)) {
    if (visitor.depth) depth_ = [this](const DepthRecord& record) { return depth(record); };
  }

  TraceInfo info;

  void channel(const mcap::Channel& channel) override {
    is_ours_ = is_ours_ || isChannelOfTrace(channel.topic, channel.schema_name);
    (void)(bind<rt::Tick>(channel, info.ticks, visitor_.tick) ||
           bind<ModelRecord>(channel, info.models, visitor_.model) ||
           bind<DirectiveRecord>(channel, info.directives, visitor_.directive) ||
           bind<AdditionsRecord>(channel, info.additions, visitor_.additions) ||
           bind<PoseRecord>(channel, info.poses, visitor_.pose) ||
           bind<EventRecord>(channel, info.events, visitor_.event) ||
           bind<SnapshotRecord>(channel, info.snapshots, visitor_.snapshot) ||
           bind<DepthRecord>(channel, info.depth_frames, depth_));
  }

  void messages() override {
    if (other_format_) {
      refuse(fmt::format("a trace of the format {}, of which this is {}", base::inQuotes(*other_format_),
                         kTraceVersion));
    }
  }

  /// Whether it is a trace, as far as it has been read: other programs may have removed its metadata.
  bool isTrace() const { return header_seen_ || is_ours_; }
  /// Why it is none.
  const mcap::Refusal& whyNot() const { return is_bag_ ? kABag : kNotATrace; }

  std::string message(const mcap::Message& message) override {
    if (message.time_ns < latest_ns_ && isTrace()) refuseUnsorted(message);
    if (refusal_) return "";
    latest_ns_ = message.time_ns;
    const auto time_ns = static_cast<std::int64_t>(message.time_ns);
    info.first_ns = messages_ == 0 ? time_ns : std::min(info.first_ns, time_ns);
    info.last_ns = messages_ == 0 ? time_ns : std::max(info.last_ns, time_ns);
    ++messages_;
    if (!isTrace() && messages_ > kMaxForeignMessages) refusal_ = whyNot();
    const auto taker = takers_.find(message.channel);
    return taker == takers_.end() ? "" : taker->second(message);
  }

  void metadata(std::string_view name, mcap::Pairs pairs) override {
    is_bag_ = is_bag_ || name == kBagMetadata;
    if (name == kOwnerMetadata) takeOwner(std::move(pairs));
    if (name == kTraceMetadata) takeHeader(pairs);
  }

  void attachment(const mcap::AttachmentRecord& attachment) override {
    info.attachments.push_back(
        {std::string(attachment.name), std::string(attachment.media_type), std::string(attachment.data)});
  }

  void chunk(std::uint64_t offset, std::uint64_t size) override {
    ++info.chunks;
    if (visitor_.progress) visitor_.progress(static_cast<double>(offset) / static_cast<double>(size));
  }

  bool enough() const override { return enough_ || refusal_; }
  std::optional<mcap::Refusal> refusal() const override { return refusal_; }

 private:
  using Taker = std::function<std::string(const mcap::Message&)>;

  /// A merged file contains the information about its writer several times; any of them will do as long as
  /// they are parts of one run of hapticd.
  void takeOwner(TraceText pairs) {
    const std::string* const run = find(pairs, kRunKey);
    const std::string* const before = find(info.metadata, kRunKey);
    if (run != nullptr && before != nullptr && *run != *before) refuseMerged();
    if (info.metadata.empty()) info.metadata = std::move(pairs);
  }

  void takeHeader(const TraceText& pairs) {
    const std::string* const version = find(pairs, kVersionKey);
    const std::string* const offset = find(pairs, kOffsetKey);
    if (version != nullptr && *version != kTraceVersion) other_format_ = *version;
    if (version == nullptr || offset == nullptr) return;
    std::int64_t offset_ns = 0;
    const char* const end = offset->data() + offset->size();
    if (std::from_chars(offset->data(), end, offset_ns).ptr != end) return;
    if (!header_seen_) {
      TraceHead head;
      head.take(pairs);
      info.realtime_offset_ns = offset_ns;
      info.clock_is_set = head.clock_is_set;
    }
    // wraps instead of overflowing, whatever the file contains
    const auto apart_ns = static_cast<std::int64_t>(static_cast<std::uint64_t>(offset_ns) -
                                                    static_cast<std::uint64_t>(info.realtime_offset_ns));
    if (apart_ns < -kMaxClockStep_ns || apart_ns > kMaxClockStep_ns) refuseMerged();
    header_seen_ = true;
  }

  void refuseMerged() {
    refusal_ = mcap::Refusal{
        "is a merge of traces of several runs of hapticd, whose times and numbers are "
        "unrelated",
        "read the original traces one by one"};
  }

  void refuseUnsorted(const mcap::Message& message) {
    constexpr double kNs = 1e-9;
    refusal_ = mcap::Refusal{
        fmt::format(
            "is not in the order of time: at byte {} there is a message {:.9f} s earlier than the one "
            "before it",
            message.offset, static_cast<double>(latest_ns_ - message.time_ns) * kNs),
        "another program has reordered it; sort it with the tool of mcap.dev: mcap sort FILE -o SORTED.mcap"};
  }

  /// Rejects a trace; `what` describes why this version cannot read it.
  void refuse(const std::string& what) {
    const std::string* const version = find(info.metadata, kWriterVersionKey);
    const std::string writer = version != nullptr ? base::inQuotes(*version) : "of an unknown version";
    refusal_ = mcap::Refusal{fmt::format("is {}; written by hapticd {}", what, writer), kOtherReaders};
  }

  /// Returns true if the channel has these records; its messages are then decoded, unless the trace is
  /// rejected.
  template <typename Record>
  bool bind(const mcap::Channel& channel, std::uint64_t& count,
            const std::function<bool(const Record&)>& to) {
    if (channel.topic != kChannelName<Record>.topic) return false;
    if (channel.encoding != "cdr" || channel.schema_encoding != "ros2msg" ||
        channel.schema_name != kChannelName<Record>.schema) {
      refuse(fmt::format("a trace with {} in another encoding", channel.topic));
      return true;
    }
    // a file may define any number of channels with one schema
    std::shared_ptr<void>& known = decoders_[{kChannelName<Record>.topic, channel.schema.data()}];
    if (!known) {
      auto found = MessageDecoder<Record>::forSchema(channel.schema);
      if (!found) {
        refuse(fmt::format("a trace whose {} this version does not read: {}", channel.topic, found.error()));
        return true;
      }
      info.topics.emplace(channel.topic);
      if (!found->missing().empty()) info.missing[std::string(channel.topic)] = found->missing();
      known = std::make_shared<MessageDecoder<Record>>(std::move(*found));
    }
    auto decoder = std::static_pointer_cast<MessageDecoder<Record>>(known);
    takers_[channel.id] = [this, &count, &to, decoder = std::move(decoder)](const mcap::Message& message) {
      return take(message, *decoder, count, to);
    };
    return true;
  }

  template <typename Record>
  std::string take(const mcap::Message& message, MessageDecoder<Record>& decoder, std::uint64_t& count,
                   const std::function<bool(const Record&)>& to) {
    if constexpr (std::is_same_v<Record, DepthRecord>) {
      if (!to) {  // content and version matter only if images are requested
        ++count;
        return "";
      }
    }
    Record record;
    constexpr std::string_view kTopic = kChannelName<Record>.topic;
    if (!decoder.decode(message.data, record)) {
      if (decoder.unknownValue().empty()) return fmt::format("a message of {} is incomplete", kTopic);
      refuse(fmt::format("a trace with a {} in {} that this version does not know", decoder.unknownValue(),
                         kTopic));
      return "";
    }
    ++count;
    if constexpr (std::is_same_v<Record, rt::Tick>) countDropped(record);
    if (!header_seen_ && !info.metadata_lost) restoreClock(message, timeOf(record));
    if (to && !mayBeKept(record, message.data)) {
      return fmt::format(
          "the records up to here hold more than {} bytes for each byte of the file, which no trace does",
          mcap::kMaxHeldRatio);
    }
    if (to && !to(record)) enough_ = true;
    return "";
  }

  /// Without metadata, the difference of the clocks is that of the first record.
  void restoreClock(const mcap::Message& message, std::int64_t time_ns) {
    info.metadata_lost = true;
    info.realtime_offset_ns =
        static_cast<std::int64_t>(message.publish_time_ns - static_cast<std::uint64_t>(time_ns));
  }

  /// Counts what a visitor may keep of a record. Equal label images that follow each other are kept once.
  template <typename Record>
  bool mayBeKept(const Record& record, std::string_view message) {
    constexpr std::size_t kPerByte = 4;  // two empty texts are 16 bytes there and 64 in memory
    std::size_t bytes = message.size();
    if constexpr (std::is_same_v<Record, AdditionsRecord>) {
      if (record.labels.bytes == labels_) bytes -= labels_.size();
      labels_ = record.labels.bytes;
    }
    kept_bytes_ += sizeof(Record) + kPerByte * bytes;
    return kept_bytes_ <= most_kept_bytes_;
  }

  void countDropped(const rt::Tick& tick) {
    if (info.ticks > 1 && tick.number > last_tick_) info.ticks_dropped += tick.number - last_tick_ - 1;
    last_tick_ = tick.number;
  }

  bool depth(const DepthRecord& record) {
    const std::string fault = depthHeaderFault(record.header);
    if (!fault.empty()) refuse(fmt::format("a trace with {}", fault));
    return !fault.empty() || visitor_.depth(record);
  }

  const TraceVisitor& visitor_;
  std::function<bool(const DepthRecord&)> depth_;  ///< empty: images are not requested
  std::map<std::uint16_t, Taker> takers_;          ///< handlers by channel
  /// A MessageDecoder for each topic and schema, which the reader keeps in one place.
  std::map<std::pair<std::string_view, const char*>, std::shared_ptr<void>> decoders_;
  std::optional<std::string> other_format_;
  std::uint64_t most_kept_bytes_;
  std::uint64_t kept_bytes_ = 0;
  std::string labels_;  ///< of the last additions
  std::uint64_t messages_ = 0;
  std::uint64_t latest_ns_ = 0;  ///< log time of the last message
  std::uint64_t last_tick_ = 0;
  bool header_seen_ = false;
  bool is_ours_ = false;  ///< has a channel of hapticd
  bool is_bag_ = false;
  bool enough_ = false;
  std::optional<mcap::Refusal> refusal_;
};

}  // namespace

bool TraceInfo::lacks(std::string_view topic, std::string_view field) const {
  const auto fields = missing.find(topic);
  return fields != missing.end() && std::ranges::find(fields->second, field) != fields->second.end();
}

base::Result<void> TraceInfo::require(const std::filesystem::path& file, std::string_view topic) const {
  if (topics.contains(topic)) return {};
  return base::failure(file.string(), fmt::format("has no channel {}", topic),
                       "use the trace that it was filtered from");
}

base::Result<TraceInfo> readTrace(const std::filesystem::path& file, const TraceVisitor& visitor) try {
  std::error_code no_file;
  const std::uintmax_t bytes = std::filesystem::file_size(file, no_file);
  Reading reading(visitor, no_file ? 0 : bytes);
  if (const auto read = mcap::read(file, reading); !read) return std::unexpected(read.error().error);
  if (!reading.isTrace()) {
    return base::failure(file.string(), reading.whyNot().what, reading.whyNot().remedy);
  }
  reading.info.bytes = no_file ? 0 : bytes;
  reading.info.complete = !reading.enough();
  if (visitor.progress) visitor.progress(1);
  return std::move(reading.info);
} catch (const std::bad_alloc&) {
  return std::unexpected(mcap::outOfMemory(file));
}

}  // namespace hapticd::trace
