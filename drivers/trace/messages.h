#pragma once

#include <cstdint>
#include <string>
#include <string_view>

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

/// The schema of a record's messages (encoding ros2msg), made from fields.h: the time, then each field; the
/// values of enumerations as constants before their field.
template <typename Record>
std::string schemaOf();

/// Appends a record as a message. realtime_ns: CLOCK_REALTIME of it.
template <typename Record>
void encode(const Record& record, std::uint64_t realtime_ns, std::string& to);

/// Reads a message of schemaOf<Record>() back, bit by bit the same. False: it is none; `record` is then
/// undefined. A snapshot of another layout of the core's memory is none.
template <typename Record>
bool decode(std::string_view message, Record& record);

}  // namespace hapticd::drivers
