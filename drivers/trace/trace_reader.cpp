#include "drivers/trace/trace_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <tuple>

#include "config/value_text.h"
#include "drivers/trace/depth_codec.h"
#include "drivers/trace/fields.h"
#include "drivers/trace/mcap_reader.h"
#include "drivers/trace/messages.h"
#include "drivers/trace/trace_format.h"

namespace hapticd::drivers {
namespace {

constexpr const char* kOtherReaders =
    "take hapticctl of that version, or Foxglove, Lichtblick or PlotJuggler, which read every version";

const std::string* find(const TraceText& pairs, std::string_view key) {
  const auto found = std::ranges::find(pairs, key, &TraceText::value_type::first);
  return found == pairs.end() ? nullptr : &found->second;
}

class Reading final : public mcap::Visitor {
 public:
  explicit Reading(const TraceVisitor& visitor) : visitor_(visitor) {}

  TraceInfo info;

  void channel(const mcap::Channel& channel) override {
    if (format_ && *format_ != kTraceVersion) {
      return refuse(fmt::format("a trace of the format {}, of which this is {}", config::inQuotes(*format_),
                                kTraceVersion));
    }
    if (!header_seen_) {
      refusal_ = mcap::Refusal{"is no trace of hapticd", "give one"};
      return;
    }
    (void)(bind(channel, ticks_, &Reading::tick) || bind(channel, models_, &Reading::model) ||
           bind(channel, directives_, &Reading::directive) || bind(channel, events_, &Reading::event) ||
           bind(channel, snapshots_, &Reading::snapshot) || bind(channel, depth_, &Reading::depth));
  }

  std::string message(const mcap::Message& message) override {
    const auto time_ns = static_cast<std::int64_t>(message.time_ns);
    info.first_ns = messages_ == 0 ? time_ns : std::min(info.first_ns, time_ns);
    info.last_ns = messages_ == 0 ? time_ns : std::max(info.last_ns, time_ns);
    ++messages_;
    const auto taker = takers_.find(message.channel);
    return taker == takers_.end() ? "" : (this->*taker->second)(message.data);
  }

  void metadata(std::string_view name, mcap::Pairs pairs) override {
    if (name == kOwnerMetadata) info.metadata = std::move(pairs);
    if (name != kTraceMetadata) return;
    header_seen_ = readHeader(pairs);
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
  using Taker = std::string (Reading::*)(std::string_view);

  bool readHeader(const TraceText& pairs) {
    const std::string* const version = find(pairs, kVersionKey);
    const std::string* const offset = find(pairs, kOffsetKey);
    if (version != nullptr) format_ = *version;
    if (version == nullptr || offset == nullptr) return false;
    const char* const end = offset->data() + offset->size();
    return std::from_chars(offset->data(), end, info.realtime_offset_ns).ptr == end;
  }

  /// `what`: the trace is, so that this version does not read it.
  void refuse(const std::string& what) {
    const std::string* const version = find(info.metadata, kWriterVersionKey);
    const std::string writer = version != nullptr ? config::inQuotes(*version) : "of an unknown version";
    refusal_ = mcap::Refusal{fmt::format("is {}; written by hapticd {}", what, writer), kOtherReaders};
  }

  /// True if it is the channel of these records; its messages are taken then, unless it is refused.
  template <typename Record>
  bool bind(const mcap::Channel& channel, MessageDecoder<Record>& decoder, Taker taker) {
    if (channel.topic != kChannelName<Record>.topic) return false;
    if (channel.encoding != "cdr" || channel.schema_encoding != "ros2msg" ||
        channel.schema_name != kChannelName<Record>.schema) {
      refuse(fmt::format("a trace with {} in another encoding", channel.topic));
      return true;
    }
    auto found = MessageDecoder<Record>::forSchema(channel.schema);
    if (!found) {
      refuse(fmt::format("a trace whose {} this version does not read: {}", channel.topic, found.error()));
      return true;
    }
    decoder = std::move(*found);
    if (!decoder.missing().empty()) info.missing[std::string(channel.topic)] = decoder.missing();
    takers_[channel.id] = taker;
    return true;
  }

  template <typename Record>
  std::string take(std::string_view data, MessageDecoder<Record>& decoder, std::uint64_t& count,
                   const std::function<bool(const Record&)>& to) {
    Record record;
    constexpr std::string_view kTopic = kChannelName<Record>.topic;
    if (!decoder.decode(data, record)) {
      if (decoder.unknownValue().empty()) return fmt::format("a message of {} is not whole", kTopic);
      refuse(fmt::format("a trace with a {} in {} that this version does not know", decoder.unknownValue(),
                         kTopic));
      return "";
    }
    ++count;
    if constexpr (std::is_same_v<Record, rt::Tick>) countDropped(record);
    if (to && !to(record)) enough_ = true;
    return "";
  }

  void countDropped(const rt::Tick& tick) {
    if (info.ticks > 1 && tick.number > last_tick_) info.ticks_dropped += tick.number - last_tick_ - 1;
    last_tick_ = tick.number;
  }

  std::string tick(std::string_view data) { return take(data, ticks_, info.ticks, visitor_.tick); }
  std::string model(std::string_view data) { return take(data, models_, info.models, visitor_.model); }
  std::string directive(std::string_view data) {
    return take(data, directives_, info.directives, visitor_.directive);
  }
  std::string event(std::string_view data) { return take(data, events_, info.events, visitor_.event); }
  std::string snapshot(std::string_view data) {
    return take(data, snapshots_, info.snapshots, visitor_.snapshot);
  }
  /// A header of another version concerns only those who want the image.
  std::string depth(std::string_view data) {
    if (!visitor_.depth) {
      ++info.depth_frames;
      return "";
    }
    std::string fault;
    const std::string wrong =
        take<DepthRecord>(data, depth_, info.depth_frames, [&](const DepthRecord& record) {
          fault = depthHeaderFault(record.header);
          return !fault.empty() || visitor_.depth(record);
        });
    if (!fault.empty()) refuse(fmt::format("a trace with {}", fault));
    return wrong;
  }

  const TraceVisitor& visitor_;
  MessageDecoder<rt::Tick> ticks_;
  MessageDecoder<ModelRecord> models_;
  MessageDecoder<DirectiveRecord> directives_;
  MessageDecoder<EventRecord> events_;
  MessageDecoder<SnapshotRecord> snapshots_;
  MessageDecoder<DepthRecord> depth_;
  std::map<std::uint16_t, Taker> takers_;  ///< of the messages of a channel
  std::optional<std::string> format_;      ///< version of the format
  std::uint64_t messages_ = 0;
  std::uint64_t last_tick_ = 0;
  bool header_seen_ = false;
  bool enough_ = false;
  std::optional<mcap::Refusal> refusal_;
};

}  // namespace

bool TraceInfo::lacks(std::string_view topic, std::string_view field) const {
  const auto fields = missing.find(topic);
  return fields != missing.end() && std::ranges::find(fields->second, field) != fields->second.end();
}

config::Result<TraceInfo> readTrace(const std::filesystem::path& file, const TraceVisitor& visitor) {
  Reading reading(visitor);
  if (const auto read = mcap::read(file, reading); !read) return std::unexpected(read.error().error);
  std::error_code ignored;
  reading.info.bytes = std::filesystem::file_size(file, ignored);
  reading.info.complete = !reading.enough();
  if (visitor.progress) visitor.progress(1);
  return std::move(reading.info);
}

}  // namespace hapticd::drivers
