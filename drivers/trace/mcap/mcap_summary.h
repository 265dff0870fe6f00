// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/trace/mcap/mcap_format.h"

namespace hapticd::drivers::mcap {

/// Collects the information for the summary at the end of a file.
class Summary {
 public:
  // `content`: of the record, each once
  void addSchema(std::string_view content) { schemas_.emplace_back(content); }
  void addChannel(std::string_view content) { channels_.emplace_back(content); }
  // `offset`, `bytes`: of the complete record in the file
  void addChunk(std::uint64_t offset, std::uint64_t bytes, const ChunkRecord& chunk,
                const ChunkContent& content);
  void addAttachment(std::uint64_t offset, std::uint64_t bytes, const AttachmentRecord& attachment);
  void addMetadata(std::uint64_t offset, std::uint64_t bytes, std::string_view content);

  std::uint64_t chunks() const { return chunks_; }

  /// Returns DataEnd, summary, footer and magic for a data section that ends at `offset`. `crc`: of
  /// everything before.
  std::string ending(std::uint64_t offset, std::uint32_t crc) const;

 private:
  std::string statistics() const;

  std::vector<std::string> schemas_;  ///< contents of the records
  std::vector<std::string> channels_;
  std::string chunk_indexes_;  ///< complete records
  std::string attachment_indexes_;
  std::string metadata_indexes_;
  std::map<std::uint16_t, std::uint64_t> messages_;  ///< number by channel
  std::uint64_t start_ns_ = 0;
  std::uint64_t end_ns_ = 0;
  std::uint32_t chunks_ = 0;
  std::uint32_t attachments_ = 0;
  std::uint32_t metadata_ = 0;
};

}  // namespace hapticd::drivers::mcap
