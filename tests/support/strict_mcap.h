// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <tuple>
#include <vector>

namespace hapticd::test {

/// What a strict reader finds in an MCAP file. It is written after the specification (mcap.dev/spec) alone
/// and shares no code with drivers/trace.
struct StrictMcap {
  /// Channel, log time, data.
  using Message = std::tuple<std::uint16_t, std::uint64_t, std::string>;

  /// Everything that a rule of the specification forbids or a checksum does not confirm, each with its place:
  /// records and their order, checksums (all must be there), chunks and their indexes, the order of time in
  /// chunks, definitions, summary, statistics, offsets, magic.
  std::vector<std::string> faults;
  /// In the file's order, of chunks that are whole.
  std::vector<Message> messages;
  /// Of those, earlier than one before them in the file: the specification allows that.
  std::uint64_t late_messages = 0;
  std::uint64_t chunks = 0;

  /// One a line.
  std::string text() const;
};

StrictMcap readStrictly(const std::filesystem::path& file);

}  // namespace hapticd::test
