// SPDX-License-Identifier: Apache-2.0
#include "tests/support/raw_mcap.h"

#include <lz4frame.h>
#include <zstd.h>
#include <cstring>

namespace hapticd::test::raw_mcap {
std::string little(std::uint64_t value, std::size_t bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes; ++i, value >>= 8) text.push_back(static_cast<char>(value));
  return text;
}

std::string sizedText(const std::string& text) {
  return little(text.size(), 4) + text;
}

std::string recordOf(unsigned opcode, const std::string& content) {
  return little(opcode, 1) + little(content.size(), 8) + content;
}

std::string headerOf(const std::string& profile) {
  return recordOf(1, sizedText(profile) + sizedText("some other program 1.0"));
}

std::string schemaRecordOf(std::uint16_t id, const std::string& name, const std::string& text) {
  return recordOf(3, little(id, 2) + sizedText(name) + sizedText("ros2msg") + sizedText(text));
}

std::string channelRecordOf(std::uint16_t id, std::uint16_t schema, const std::string& topic) {
  return recordOf(4, little(id, 2) + little(schema, 2) + sizedText(topic) + sizedText("cdr") +
                         sizedText(sizedText("offered_qos_profiles") + sizedText("")));
}

std::string messageOf(std::uint16_t channel, std::uint64_t time_ns, const std::string& data) {
  return recordOf(5, little(channel, 2) + little(0, 4) + little(time_ns, 8) + little(time_ns, 8) + data);
}

std::string metadataOf(const std::string& name, const Pairs& pairs) {
  std::string map;
  for (const auto& [key, value] : pairs) map += sizedText(key) + sizedText(value);
  return recordOf(12, sizedText(name) + sizedText(map));
}

std::string traceMetadata(const std::string& offset_ns) {
  return metadataOf("hapticd_trace", {{"version", "1"}, {"realtime_offset_ns", offset_ns}});
}

std::string ownerMetadata(const std::string& run) {
  return metadataOf("hapticd", {{"hapticd_version", "1.0"}, {"run", run}});
}

std::string chunkOf(std::uint64_t start_ns, std::uint64_t end_ns, const std::string& records,
                    const std::string& compression) {
  std::string packed = records;
  if (compression == "lz4") {
    packed.resize(LZ4F_compressFrameBound(records.size(), nullptr));
    packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), records.data(), records.size(), nullptr));
  } else if (compression == "zstd") {
    packed.resize(ZSTD_compressBound(records.size()));
    packed.resize(ZSTD_compress(packed.data(), packed.size(), records.data(), records.size(), 3));
  }
  return recordOf(6, little(start_ns, 8) + little(end_ns, 8) + little(records.size(), 8) + little(0, 4) +
                         sizedText(compression) + little(packed.size(), 8) + packed);
}

std::string endOf() {
  return recordOf(15, little(0, 4)) + recordOf(2, little(0, 20)) + kMcapMagic;
}

std::vector<RawRecord> recordsOf(const std::string& file) {
  std::vector<RawRecord> records;
  for (std::size_t at = kMcapMagic.size(); at + kMcapMagic.size() < file.size();) {
    std::uint64_t length = 0;
    std::memcpy(&length, &file[at + 1], sizeof length);
    records.push_back({file[at], at, at + 1 + sizeof length + length});
    at = records.back().end;
  }
  return records;
}

}  // namespace hapticd::test::raw_mcap
