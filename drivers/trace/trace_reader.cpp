#include "drivers/trace/trace_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <tuple>

#include "drivers/trace/fields.h"
#include "drivers/trace/mcap_reader.h"
#include "drivers/trace/messages.h"
#include "drivers/trace/trace_format.h"

namespace hapticd::drivers {
namespace {

constexpr const char* kOtherVersion =
    "it was written by another version of hapticd, whose traces this one does not read";

const std::string* find(const TraceText& pairs, std::string_view key) {
  const auto found = std::ranges::find(pairs, key, &TraceText::value_type::first);
  return found == pairs.end() ? nullptr : &found->second;
}

class Reading final : public mcap::Visitor {
 public:
  explicit Reading(const TraceVisitor& visitor) : visitor_(visitor) {}

  TraceInfo info;

  std::string channel(const mcap::Channel& channel) override {
    if (!header_seen_) return "it is no trace of hapticd";
    const bool known =
        bind<rt::Tick>(channel, &Reading::tick) || bind<ModelRecord>(channel, &Reading::model) ||
        bind<DirectiveRecord>(channel, &Reading::directive) || bind<EventRecord>(channel, &Reading::event) ||
        bind<SnapshotRecord>(channel, &Reading::snapshot);
    return known && takers_[channel.id] == nullptr ? kOtherVersion : "";
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

  bool enough() const override { return enough_; }

 private:
  using Taker = std::string (Reading::*)(std::string_view);

  bool readHeader(const TraceText& pairs) {
    const std::string* const version = find(pairs, kVersionKey);
    const std::string* const offset = find(pairs, kOffsetKey);
    if (version == nullptr || *version != kTraceVersion || offset == nullptr) return false;
    const char* const end = offset->data() + offset->size();
    return std::from_chars(offset->data(), end, info.realtime_offset_ns).ptr == end;
  }

  /// True if it is the channel of these records; its messages are taken if they have the same fields.
  template <typename Record>
  bool bind(const mcap::Channel& channel, Taker taker) {
    if (channel.topic != kChannelName<Record>.topic) return false;
    static const std::string schema = schemaOf<Record>();
    const bool same = channel.encoding == "cdr" && channel.schema_encoding == "ros2msg" &&
                      channel.schema_name == kChannelName<Record>.schema && channel.schema == schema;
    takers_[channel.id] = same ? taker : nullptr;
    return true;
  }

  template <typename Record>
  std::string take(std::string_view data, std::uint64_t& count,
                   const std::function<bool(const Record&)>& to) {
    Record record;
    if (!decode(data, record)) return fmt::format("a message of {} is not whole", kChannelName<Record>.topic);
    ++count;
    if constexpr (std::is_same_v<Record, rt::Tick>) countDropped(record);
    if (to && !to(record)) enough_ = true;
    return "";
  }

  void countDropped(const rt::Tick& tick) {
    if (info.ticks > 1 && tick.number > last_tick_) info.ticks_dropped += tick.number - last_tick_ - 1;
    last_tick_ = tick.number;
  }

  std::string tick(std::string_view data) { return take(data, info.ticks, visitor_.tick); }
  std::string model(std::string_view data) { return take(data, info.models, visitor_.model); }
  std::string directive(std::string_view data) { return take(data, info.directives, visitor_.directive); }
  std::string event(std::string_view data) { return take(data, info.events, visitor_.event); }
  std::string snapshot(std::string_view data) { return take(data, info.snapshots, visitor_.snapshot); }

  const TraceVisitor& visitor_;
  std::map<std::uint16_t, Taker> takers_;  ///< of the messages of a channel
  std::uint64_t messages_ = 0;
  std::uint64_t last_tick_ = 0;
  bool header_seen_ = false;
  bool enough_ = false;
};

}  // namespace

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
