// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <string_view>

namespace hapticd::test::uvc {

enum class Fault : std::uint8_t {
  // stream: from the next frame on
  silent,
  header_long,
  header_short,
  error_bit,
  frame_short,
  frame_long,
  other_size,
  empty_payload,
  frame_id_stuck,
  frame_repeated,
  // requests: from the next one on
  mute,
  unit_stalls,
  unit_length,
  // RealSense's hardware monitor
  monitor_error,
  monitor_echo,
  monitor_length,
  no_mode_table,
  mode_not_listed,
  mode_not_finite,
  table_checksum,
  table_size,
  table_type,
  table_focal_zero,
  unit_zero,
  disparity,
  // Orbbec's protocol
  response_magic,
  response_number,
  response_error,
  list_size,
  // descriptors: when it is plugged in again
  lies_about_size,
  unknown_format,
  no_frames,
  frame_zero,
  interval_zero,
  no_endpoint,
  no_unit,
  descriptor_cut,
};
inline constexpr std::size_t kFaults = static_cast<std::size_t>(Fault::descriptor_cut) + 1;

/// In the order of the enumeration.
inline constexpr std::array<std::string_view, kFaults> kFaultNames{
    "silent",         "header-long",     "header-short",     "error-bit",       "frame-short",
    "frame-long",     "other-size",      "empty-payload",    "frame-id-stuck",  "frame-repeated",
    "mute",           "unit-stalls",     "unit-length",      "monitor-error",   "monitor-echo",
    "monitor-length", "no-mode-table",   "mode-not-listed",  "mode-not-finite", "table-checksum",
    "table-size",     "table-type",      "table-focal-zero", "unit-zero",       "disparity",
    "response-magic", "response-number", "response-error",   "list-size",       "lies-about-size",
    "unknown-format", "no-frames",       "frame-zero",       "interval-zero",   "no-endpoint",
    "no-unit",        "descriptor-cut"};
static_assert(!kFaultNames.back().empty());

/// The faults that a camera has at present.
class Faults {
 public:
  bool has(Fault fault) const { return set_[index(fault)]; }
  void set(Fault fault) { set_[index(fault)] = true; }
  void clear() { set_.reset(); }

 private:
  static std::size_t index(Fault fault) { return static_cast<std::size_t>(fault); }

  std::bitset<kFaults> set_;
};

constexpr std::optional<Fault> faultNamed(std::string_view name) {
  const auto found = std::ranges::find(kFaultNames, name);
  if (found == kFaultNames.end()) return std::nullopt;
  return static_cast<Fault>(found - kFaultNames.begin());
}

}  // namespace hapticd::test::uvc
