// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/trace/message_layout.h"
#include "drivers/trace/records.h"

namespace hapticd::drivers {

/// How a channel is called in the file. Its messages are CDR.
struct ChannelName {
  std::string_view topic;
  std::string_view schema;
};

template <typename Record>
inline constexpr ChannelName kChannelName{};
template <>
inline constexpr ChannelName kChannelName<rt::Tick>{"/hapticd/tick", "hapticd_msgs/msg/Tick"};
template <>
inline constexpr ChannelName kChannelName<ModelRecord>{"/hapticd/model", "hapticd_msgs/msg/Model"};
template <>
inline constexpr ChannelName kChannelName<DirectiveRecord>{"/hapticd/directive",
                                                           "hapticd_msgs/msg/Directive"};
template <>
inline constexpr ChannelName kChannelName<EventRecord>{"/hapticd/event", "hapticd_msgs/msg/Event"};
template <>
inline constexpr ChannelName kChannelName<SnapshotRecord>{"/hapticd/core_snapshot",
                                                          "hapticd_msgs/msg/CoreSnapshot"};
template <>
inline constexpr ChannelName kChannelName<DepthRecord>{"/hapticd/depth", "hapticd_msgs/msg/Depth"};

/// The schema of a record's messages (encoding ros2msg), made from fields.h: the time, then each field; the
/// values of enumerations as constants before their field.
template <typename Record>
std::string schemaOf();

/// Appends a record as a message. realtime_ns: CLOCK_REALTIME of it.
template <typename Record>
void encode(const Record& record, std::uint64_t realtime_ns, std::string& to);

/// Reads the messages of a channel back: with schemaOf<Record>() bit by bit the same, and what it can of the
/// messages of older and newer versions, whose fields are others.
/// Thread: one.
template <typename Record>
class MessageDecoder {
 public:
  /// For the schema of this version.
  MessageDecoder();
  /// Errors: why its messages cannot be read as such records.
  static std::expected<MessageDecoder, std::string> forSchema(std::string_view schema);

  /// False: it is no such message, or unknownValue() says why; `record` is then undefined. A field that the
  /// messages do not have is NaN, or zero where it cannot be. A snapshot of another layout of the core's
  /// memory is not usable.
  bool decode(std::string_view message, Record& record);

  /// The field of the last message whose value this version has no name for; empty: there is none.
  const std::string& unknownValue() const { return unknown_value_; }
  /// Fields of the record that the messages do not have.
  const std::vector<std::string>& missing() const { return missing_; }

 private:
  bool decodeOther(std::string_view message, Record& record);

  /// Where a field of the record comes from.
  struct Source {
    std::optional<std::size_t> field;  ///< of the message; nothing: it does not have it
    /// Of an enumeration: its enumerators by their values there.
    std::vector<std::optional<std::uint8_t>> values;
  };
  std::optional<MessageLayout> other_;  ///< nothing: this version's
  std::vector<Source> sources_;         ///< by the fields of the record
  std::vector<std::string> missing_;
  std::vector<std::size_t> places_;
  std::string unknown_value_;
};

}  // namespace hapticd::drivers
