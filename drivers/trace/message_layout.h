// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/trace/cdr.h"

namespace hapticd::drivers {

/// The fields of a channel's messages, as its schema (encoding ros2msg) lists them.
/// Thread: one.  RT: not safe.
class MessageLayout {
 public:
  /// How a field is stepped over.
  enum class Form { numbers, text, bytes, named_texts, time };
  struct Field {
    std::string type;                    ///< "float64[3]"
    std::string name;                    ///< "hip_m_in_world"
    std::vector<std::string> constants;  ///< by their values, "" between: the enumerators of the field
    Form form = Form::numbers;
    std::size_t bytes = 1;  ///< of a number
    std::size_t count = 1;  ///< of the numbers
  };

  /// Errors: why it cannot be read: a line that is none, a type that traces do not have.
  static std::expected<MessageLayout, std::string> of(std::string_view schema);

  const std::vector<Field>& fields() const { return fields_; }
  /// Its place in fields().
  std::optional<std::size_t> find(std::string_view name) const;

  /// Where each field of a message begins, for CdrReader::seek(). False: the message is not whole.
  bool locate(std::string_view message, std::vector<std::size_t>& places) const;

 private:
  std::vector<Field> fields_;
};

}  // namespace hapticd::drivers
