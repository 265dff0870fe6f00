// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "daemon/trace/format/records.h"
#include "daemon/trace/writer/trace_writer.h"

namespace hapticd::test {

/// Returns ticks with random bits in every member: all integers, all finite and infinite doubles and NaN.
/// Planned times increase by a millisecond.
rt::Tick madeUpTick(std::mt19937_64& random, std::uint64_t number);
trace::ModelRecord madeUpModel(std::mt19937_64& random);
trace::DirectiveRecord madeUpDirective(std::mt19937_64& random);
trace::AdditionsRecord madeUpAdditions(std::mt19937_64& random);
trace::EventRecord madeUpEvent(std::mt19937_64& random);
trace::PoseRecord madeUpPose(std::mt19937_64& random);
trace::SnapshotRecord madeUpSnapshot(std::mt19937_64& random);
/// Returns a depth frame of any small size with a header of any valid values.
trace::DepthRecord madeUpDepth(std::mt19937_64& random);

/// Records to be written to a trace.
struct MadeUpRecords {
  std::vector<rt::Tick> ticks = {};
  std::vector<trace::ModelRecord> models = {};
  std::vector<trace::DirectiveRecord> directives = {};
  std::vector<trace::AdditionsRecord> additions = {};
  std::vector<trace::PoseRecord> poses = {};
  std::vector<trace::EventRecord> events = {};
  std::vector<trace::SnapshotRecord> snapshots = {};
  std::vector<trace::DepthRecord> depth = {};  ///< left empty by madeUpRecords()

  /// All but the ticks.
  auto others() { return std::tie(models, directives, additions, poses, events, snapshots, depth); }
  auto others() const { return std::tie(models, directives, additions, poses, events, snapshots, depth); }
};

/// Returns `chunks` chunks of `ticks_per_chunk` ticks each; the other records, and their times, are in the
/// first chunk. Each kind is in the order of its times.
MadeUpRecords madeUpRecords(std::size_t chunks, std::size_t ticks_per_chunk, unsigned seed = 1);

/// Writes and closes a trace of these records.
void writeTrace(const std::filesystem::path& file, const MadeUpRecords& records, std::size_t ticks_per_chunk,
                const trace::TraceOptions& options = {});

/// Returns all that a trace holds. Throws std::runtime_error if it cannot be read to its end.
MadeUpRecords recordsIn(const std::filesystem::path& file);

/// Writes and closes a trace of ticks as an older version would whose ticks lack one of the forces; the
/// metadata name it 0.0.7.
void writeOlderTrace(const std::filesystem::path& file, const std::vector<rt::Tick>& ticks,
                     std::string_view without = "slewed_force_n_in_world");

/// Returns the names of a record's fields and their bits as text, for comparing records.
template <typename Record>
std::vector<std::pair<std::string, std::string>> bitsOf(const Record& record) {
  std::vector<std::pair<std::string, std::string>> bits;
  const auto bytesOf = [](const auto& value) {
    return std::string(reinterpret_cast<const char*>(&value), sizeof value);
  };
  trace::visitFields(record, [&]<typename Field>(std::string_view name, const Field& field) {
    std::string text;
    if constexpr (std::is_same_v<Field, std::string>) {
      text = field;
    } else if constexpr (std::is_same_v<Field, trace::ByteString>) {
      text = field.bytes;
    } else if constexpr (std::is_trivially_copyable_v<Field>) {
      text = bytesOf(field);
    } else {
      for (const auto& [key, value] : field) text += key + "\1" + value + "\2";
    }
    bits.emplace_back(name, text);
  });
  return bits;
}

/// Returns the kind, place and field of the first difference in any bit; "" if there is none.
std::string differenceOf(const MadeUpRecords& one, const MadeUpRecords& other);

}  // namespace hapticd::test
