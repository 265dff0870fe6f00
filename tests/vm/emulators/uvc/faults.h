// SPDX-License-Identifier: Apache-2.0
#pragma once

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

struct FaultName {
  Fault fault;
  std::string_view name;
};
/// In the order of the enumeration.
inline constexpr std::array<FaultName, kFaults> kFaultNames{{
    {Fault::silent, "silent"},
    {Fault::header_long, "header-long"},
    {Fault::header_short, "header-short"},
    {Fault::error_bit, "error-bit"},
    {Fault::frame_short, "frame-short"},
    {Fault::frame_long, "frame-long"},
    {Fault::other_size, "other-size"},
    {Fault::empty_payload, "empty-payload"},
    {Fault::frame_id_stuck, "frame-id-stuck"},
    {Fault::frame_repeated, "frame-repeated"},
    {Fault::mute, "mute"},
    {Fault::unit_stalls, "unit-stalls"},
    {Fault::unit_length, "unit-length"},
    {Fault::monitor_error, "monitor-error"},
    {Fault::monitor_echo, "monitor-echo"},
    {Fault::monitor_length, "monitor-length"},
    {Fault::no_mode_table, "no-mode-table"},
    {Fault::mode_not_listed, "mode-not-listed"},
    {Fault::mode_not_finite, "mode-not-finite"},
    {Fault::table_checksum, "table-checksum"},
    {Fault::table_size, "table-size"},
    {Fault::table_type, "table-type"},
    {Fault::table_focal_zero, "table-focal-zero"},
    {Fault::unit_zero, "unit-zero"},
    {Fault::disparity, "disparity"},
    {Fault::response_magic, "response-magic"},
    {Fault::response_number, "response-number"},
    {Fault::response_error, "response-error"},
    {Fault::list_size, "list-size"},
    {Fault::lies_about_size, "lies-about-size"},
    {Fault::unknown_format, "unknown-format"},
    {Fault::no_frames, "no-frames"},
    {Fault::frame_zero, "frame-zero"},
    {Fault::interval_zero, "interval-zero"},
    {Fault::no_endpoint, "no-endpoint"},
    {Fault::no_unit, "no-unit"},
    {Fault::descriptor_cut, "descriptor-cut"},
}};

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
  for (const FaultName& known : kFaultNames) {
    if (known.name == name) return known.fault;
  }
  return std::nullopt;
}

}  // namespace hapticd::test::uvc
