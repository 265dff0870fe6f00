// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "config/base/error.h"

namespace hapticd::tools {

/// The functions of Force Dimension's library that the driver calls, found at run time. Metres, radians,
/// newtons and newton metres. They return 0 or above for success and below 0 for failure, unless said
/// otherwise; `id` is that of the device, which dhdOpen and dhdOpenSerial return.  Thread: one.
struct Dhd {
  static constexpr int kNothingNew = 1;  ///< returned for values that were returned before
  static constexpr unsigned kWatchdogUnit_us = 125;

  using Triple = int(double* x, double* y, double* z, char id);

  void (*version)(int* major, int* minor, int* release, int* revision);
  int (*device_count)();
  int (*open)();
  int (*open_serial)(int serial);
  int (*close)(char id);
  int (*stop)(char id);  ///< forces off, brakes on
  const char* (*system_name)(char id);
  int (*system_type)(char id);
  int (*serial_number)(unsigned short* serial, char id);
  int (*status)(int* status, char id);  ///< an array of kStatusSize
  bool (*has_wrist)(char id);
  bool (*has_active_wrist)(char id);
  bool (*has_gripper)(char id);
  bool (*has_active_gripper)(char id);
  int (*enable_expert_mode)();
  int (*set_watchdog)(unsigned char units, char id);
  int (*watchdog)(unsigned char* units, char id);
  int (*set_max_force)(double force_n, char id);
  int (*set_gravity_compensation)(int on, char id);
  int (*set_brakes)(int on, char id);
  int (*enable_force)(unsigned char on, char id);
  Triple* position;
  int (*pose)(double* x, double* y, double* z, double (*rotation)[3], char id);  ///< rotation: row by row
  int (*gripper_angle)(double* angle_rad, char id);
  unsigned (*buttons)(char id);  ///< bit n: button n
  int (*set_force)(double x, double y, double z, char id);
  int (*set_wrench)(double x, double y, double z, double tx, double ty, double tz, char id);
  int (*set_wrench_and_gripper)(double x, double y, double z, double tx, double ty, double tz, double gripper,
                                char id);
  int (*last_error)();
  const char* (*last_error_text)();

  /// Loads the library: `library`, or the newest that the vendor's installation has left; checks its version.
  /// Errors: it is not there, lacks a function, or is older than version 3.
  static base::Result<Dhd> load(const std::string& library);
  /// What went wrong in the last call of this thread.
  std::string lastError() const;
};

/// What a device says of itself: places in the array of Dhd::status.
enum class DhdStatus : std::size_t {
  powered = 0,
  connected = 1,
  runs = 2,
  resetting = 3,  ///< waits for its calibration
  force_on = 5,
  brakes_on = 6,
  has_wrist = 8,
  error = 9,
  wrist_initialised = 12,
  force_off_cause = 14,
};

/// The status of a device; the library writes no more than the first 17 places now.
struct DhdStatusArray {
  std::array<int, 64> values{};
  int operator[](DhdStatus place) const { return values[static_cast<std::size_t>(place)]; }
};

}  // namespace hapticd::tools
