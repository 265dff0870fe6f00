// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/trace/mcap_scanner.h"

namespace hapticd::drivers::mcap {

/// A part of a file with messages: a chunk, or consecutive messages outside of chunks.
struct Stretch {
  std::uint64_t offset = 0;  ///< in the file
  std::uint64_t bytes = 0;
  std::uint64_t start_ns = 0;  ///< of its earliest message, according to the file
  bool chunk = false;

  std::uint64_t end() const { return offset + bytes; }
};

/// Receives the records found by a survey. Its functions return a description of the record's fault, or "".
class SurveyVisitor {
 public:
  virtual ~SurveyVisitor() = default;
  virtual std::string definition(const Record& record) = 0;  ///< a schema or channel outside of chunks
  virtual std::string companion(const Record& record) = 0;   ///< metadata or an attachment
};

/// Locations of the messages of a file.
struct Survey {
  std::vector<Stretch> stretches;  ///< in file order
  std::optional<Fault> fault;      ///< reason why the survey ended before the end of the data

  bool inOrderOfTime() const;
};

/// Visits the records of the data section without reading the content of chunks and messages. It is needed
/// because other programs write metadata after the messages, and chunks in any order.
Survey survey(Scanner& scanner, SurveyVisitor& visitor);

}  // namespace hapticd::drivers::mcap
