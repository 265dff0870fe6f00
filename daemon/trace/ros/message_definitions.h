// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// The messages of ROS 2 that hapticd's programs know: the one list of their fields, of which the schemas of
/// files and the type hashes are made.
namespace hapticd::trace::ros {

struct MessageDefinition {
  std::string_view name;    ///< "geometry_msgs/PoseStamped"
  std::string_view fields;  ///< in the syntax of .msg files: a type and a name a line, in their order
};

/// A field of a message.
struct MessageField {
  std::string_view type;  ///< "float64", "std_msgs/Header"; of a list or an array that of an element
  std::string_view name;
  bool is_list = false;            ///< of any length
  std::uint32_t elements = 0;      ///< of an array of fixed length; 0: it is none
  std::uint32_t longest_text = 0;  ///< of a string, in bytes; 0: any
};

/// Thread: any.  RT: not safe.
std::span<const MessageDefinition> messageDefinitions();

/// The definition with this name; it must be one of the list.
const MessageDefinition& messageDefinition(std::string_view name);

std::vector<MessageField> fieldsOf(const MessageDefinition& definition);

/// All messages that this one consists of, directly or not, sorted by name and each once.
std::vector<std::string_view> messagesInside(std::string_view name);

/// The definition with those of all messages inside it, each under a line of "=" and its name, as MCAP files
/// hold them and readers of .msg files take them.
std::string completeDefinition(std::string_view name);

/// The name of the type as ROS 2 shows it: "geometry_msgs/msg/PoseStamped".
std::string fullTypeName(std::string_view name);

/// The name of the type in DDS: "geometry_msgs::msg::dds_::PoseStamped_".
std::string ddsTypeName(std::string_view name);

/// The hash by which ROS 2 (from Iron on) tells whether both ends mean the same fields, RIHS01 of REP-2016:
/// "RIHS01_" and the SHA-256 of the description of the type in 64 hexadecimal digits. Names, types and order
/// of the fields enter, also of the messages inside; comments and constants do not.
std::string typeHash(std::string_view name);

}  // namespace hapticd::trace::ros
