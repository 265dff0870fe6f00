// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

/// Records of MCAP files (mcap.dev/spec), assembled without the code of daemon/trace.
namespace hapticd::test::raw_mcap {

inline const std::string kMcapMagic("\x89MCAP0\r\n", 8);

using Pairs = std::vector<std::pair<std::string, std::string>>;

std::string little(std::uint64_t value, std::size_t bytes);
std::string sizedText(const std::string& text);
std::string recordOf(unsigned opcode, const std::string& content);
std::string headerOf(const std::string& profile);
std::string schemaRecordOf(std::uint16_t id, const std::string& name, const std::string& text);
std::string channelRecordOf(std::uint16_t id, std::uint16_t schema, const std::string& topic);
std::string messageOf(std::uint16_t channel, std::uint64_t time_ns, const std::string& data);
std::string metadataOf(const std::string& name, const Pairs& pairs);
std::string traceMetadata(const std::string& offset_ns = "0");
std::string ownerMetadata(const std::string& run);
/// Returns a chunk without checksums; `compression`: "", "lz4" or "zstd".
std::string chunkOf(std::uint64_t start_ns, std::uint64_t end_ns, const std::string& records,
                    const std::string& compression = "");
/// Returns the end of a file without a summary.
std::string endOf();

/// A record of a file.
struct RawRecord {
  char opcode = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};
/// Returns the records of a whole file, by their lengths.
std::vector<RawRecord> recordsOf(const std::string& file);

}  // namespace hapticd::test::raw_mcap
