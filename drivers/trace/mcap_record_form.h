// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/trace/mcap_format.h"

/// Whether bytes have the form of a record: what can be said of records that have no checksum.
namespace hapticd::drivers::mcap {

/// A MessageIndex record taken apart.
struct MessageIndex {
  std::uint16_t channel = 0;
  std::vector<MessagePlace> places;

  /// False: it is none.
  static bool of(std::string_view content, MessageIndex& index);
};

/// Of all records but chunks and messages; of attachments with their checksum. Those of the summary may be
/// anything.
bool hasForm(Opcode opcode, std::string_view content);

/// What is wrong with a record that does not have its form.
std::string whatIsNotWhole(Opcode opcode);

/// The records of a chunk, checked. What is wrong with it, or "".
std::string unpackChunk(std::string_view content, std::string& unpacked);

}  // namespace hapticd::drivers::mcap
