// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/trace/format/cdr.h"
#include "daemon/trace/format/records.h"

namespace hapticd::trace {

/// The fields of a channel's messages according to its schema (encoding ros2msg).
/// Thread: one.  RT: not safe.
class MessageLayout {
 public:
  /// Encoding of a field.
  enum class Form { numbers, text, bytes, named_texts, time };
  /// One field of the messages.
  struct Field {
    std::string type;                                             ///< e.g. "float64[3]"
    std::string name;                                             ///< e.g. "hip_m_in_world"
    std::vector<std::pair<std::uint8_t, std::string>> constants;  ///< enumerators of the field: value, name
    Form form = Form::numbers;
    std::size_t bytes = 1;  ///< size of one number
    std::size_t count = 1;  ///< number of numbers
  };

  /// Parses a schema.  Errors: why it cannot be parsed: an invalid line, a type that traces do not use, more
  /// fields than any trace has.
  static std::expected<MessageLayout, std::string> of(std::string_view schema);

  const std::vector<Field>& fields() const { return fields_; }
  /// Returns the index of a field in fields().
  std::optional<std::size_t> find(std::string_view name) const;

  /// Determines the offset of each field of a message, for CdrReader::seek(). Returns false if the message is
  /// incomplete.
  bool locate(std::string_view message, std::vector<std::size_t>& places) const;

 private:
  std::vector<Field> fields_;
};

/// Topic and schema name of a channel. Its messages are encoded in CDR.
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
inline constexpr ChannelName kChannelName<AdditionsRecord>{"/hapticd/additions",
                                                           "hapticd_msgs/msg/Additions"};
template <>
inline constexpr ChannelName kChannelName<PoseRecord>{"/hapticd/frame_pose", "hapticd_msgs/msg/FramePose"};
template <>
inline constexpr ChannelName kChannelName<EventRecord>{"/hapticd/event", "hapticd_msgs/msg/Event"};
template <>
inline constexpr ChannelName kChannelName<SnapshotRecord>{"/hapticd/core_snapshot",
                                                          "hapticd_msgs/msg/CoreSnapshot"};
template <>
inline constexpr ChannelName kChannelName<DepthRecord>{"/hapticd/depth", "hapticd_msgs/msg/Depth"};

/// Returns the schema of a record's messages (encoding ros2msg), generated from fields.h: the time, then each
/// field; the values of enumerations precede their field as constants.
template <typename Record>
std::string schemaOf();

/// Appends a record as a message. `realtime_ns`: its CLOCK_REALTIME.
template <typename Record>
void encode(const Record& record, std::uint64_t realtime_ns, std::string& to);

/// Decodes the messages of a channel: those of schemaOf<Record>() exactly, and as far as possible those of
/// older and newer versions, which have other fields.
/// Thread: one.
template <typename Record>
class MessageDecoder {
 public:
  /// Decodes the schema of this version.
  MessageDecoder();
  /// Decodes another schema.  Errors: why its messages cannot be decoded as such records.
  static std::expected<MessageDecoder, std::string> forSchema(std::string_view schema);

  /// Decodes a message. Returns false if it is invalid or has a value described by unknownValue(); `record`
  /// is then undefined. A number of the type double that is missing in the messages becomes
  /// NaN, any other missing field keeps the default of the record. A snapshot with another layout of the
  /// core's memory is marked as not usable.
  bool decode(std::string_view message, Record& record);

  /// Returns the field of the last message with a value unknown to this version; empty: none.
  const std::string& unknownValue() const { return unknown_value_; }
  /// Returns the fields of the record that the messages do not have.
  const std::vector<std::string>& missing() const { return missing_; }

 private:
  bool decodeOther(std::string_view message, Record& record);

  /// Origin of a field of the record.
  struct Source {
    std::optional<std::size_t> field;  ///< index of the field in the message; nothing: missing
    /// For an enumeration: its enumerators by their values in the message.
    std::vector<std::optional<std::uint8_t>> values;
  };
  std::optional<MessageLayout> other_;  ///< nothing: the schema of this version
  std::vector<Source> sources_;         ///< by field of the record
  std::vector<std::string> missing_;
  std::vector<std::size_t> places_;
  std::string unknown_value_;
};

}  // namespace hapticd::trace
