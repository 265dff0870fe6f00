// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/trace/mcap_format.h"

/// Structural checks of records, which replace checksums where records have none.
namespace hapticd::drivers::mcap {

/// A decoded MessageIndex record.
struct MessageIndex {
  std::uint16_t channel = 0;
  std::vector<MessagePlace> places;

  /// Decodes a record; returns false if it is invalid.
  static bool of(std::string_view content, MessageIndex& index);
};

/// Returns whether a record other than a chunk or message is well-formed; for attachments including the
/// checksum. Records of the summary are not checked.
bool hasForm(Opcode opcode, std::string_view content);

/// Returns a description of a malformed record.
std::string malformedText(Opcode opcode);

/// Decompresses and checks the records of a chunk, which are `chunk` and `inside` then. Returns a description
/// of the fault, or "".
std::string unpackChunk(std::string_view content, Allowance& allowance, std::string& unpacked,
                        ChunkRecord& chunk, ChunkContent& inside);

}  // namespace hapticd::drivers::mcap
