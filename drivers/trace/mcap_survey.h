// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/trace/mcap_scanner.h"

namespace hapticd::drivers::mcap {

/// A part of a file that holds messages: a chunk, or messages outside of chunks that follow each other.
struct Stretch {
  std::uint64_t offset = 0;  ///< in the file
  std::uint64_t bytes = 0;
  std::uint64_t start_ns = 0;  ///< of its earliest message, as the file says
  bool chunk = false;

  std::uint64_t end() const { return offset + bytes; }
};

/// Takes what a survey comes by. What is wrong with it, or "".
class SurveyVisitor {
 public:
  virtual ~SurveyVisitor() = default;
  virtual std::string definition(const Record& record) = 0;  ///< a schema or channel outside of chunks
  virtual std::string companion(const Record& record) = 0;   ///< metadata, an attachment
};

/// Where the messages of a file are.
struct Survey {
  std::vector<Stretch> stretches;  ///< in their order in the file
  std::optional<Fault> fault;      ///< why it does not go on to the end of the data

  bool inOrderOfTime() const;
};

/// Goes from record to record of the data section without reading what chunks and messages hold: other
/// programs write metadata behind the messages, and chunks in any order.
Survey survey(Scanner& scanner, SurveyVisitor& visitor);

}  // namespace hapticd::drivers::mcap
