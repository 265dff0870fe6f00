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

}  // namespace hapticd::trace
