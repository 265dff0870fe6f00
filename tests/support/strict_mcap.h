// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <tuple>
#include <vector>

namespace hapticd::test {

/// Findings of a strict reader of an MCAP file. The reader implements the specification (mcap.dev/spec) only
/// and shares no code with daemon/trace.
struct StrictMcap {
  /// Channel, log time, data.
  using Message = std::tuple<std::uint16_t, std::uint64_t, std::string>;

  /// Every violation of the specification and every checksum mismatch, with its offset: records and their
  /// order, checksums (all must be present), chunks and their indexes, time order within chunks, definitions,
  /// summary, statistics, offsets, magic.
  std::vector<std::string> faults;
  /// What the specification allows and hapticd never writes, with its offset: chunks that overlap in time.
  std::vector<std::string> warnings;
  /// Messages of intact chunks, in file order
  std::vector<Message> messages;
  std::uint64_t chunks = 0;

  /// Returns the faults, one per line.
  std::string text() const;
  /// Returns the faults and the warnings, one per line.
  std::string allText() const;
};

StrictMcap readStrictly(const std::filesystem::path& file);

}  // namespace hapticd::test
