// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "config/base/error.h"
#include "tools/haptic-bridge/base/vendor_library.h"

namespace hapticd::tools {

/// The functions of Force Dimension's library that the driver calls, found at run time. Metres, radians,
/// newtons and newton metres. They return 0 or above for success and below 0 for failure, unless said
/// otherwise; `id` is that of the device, which dhdOpen and dhdOpenSerial return.  Thread: one.
struct Dhd {
  static constexpr int kNothingNew = 1;  ///< returned for values that were returned before
  static constexpr unsigned kWatchdogUnit_us = 125;

  VendorFunction<void(int* major, int* minor, int* release, int* revision)> version;
  VendorFunction<int()> device_count;
  VendorFunction<int()> open;
  VendorFunction<int(int serial)> open_serial;
  VendorFunction<int(char id)> close;
  VendorFunction<int(char id)> stop;  ///< forces off, brakes on
  VendorFunction<const char*(char id)> system_name;
  VendorFunction<int(char id)> system_type;
  VendorFunction<int(unsigned short* serial, char id)> serial_number;
  VendorFunction<int(int* status, char id)> status;  ///< an array of kStatusSize
  VendorFunction<bool(char id)> has_wrist;
  VendorFunction<bool(char id)> has_active_wrist;
  VendorFunction<bool(char id)> has_gripper;
  VendorFunction<bool(char id)> has_active_gripper;
  VendorFunction<int()> enable_expert_mode;
  VendorFunction<int(unsigned char units, char id)> set_watchdog;
  VendorFunction<int(unsigned char* units, char id)> watchdog;
  VendorFunction<int(double force_n, char id)> set_max_force;
  VendorFunction<int(int on, char id)> set_gravity_compensation;
  VendorFunction<int(int on, char id)> set_brakes;
  VendorFunction<int(unsigned char on, char id)> enable_force;
  VendorFunction<int(double* x, double* y, double* z, char id)> position;
  VendorFunction<int(double* x, double* y, double* z, double (*rotation)[3], char id)>
      pose;  ///< rotation: row by row
  VendorFunction<int(double* angle_rad, char id)> gripper_angle;
  VendorFunction<unsigned(char id)> buttons;  ///< bit n: button n
  VendorFunction<int(double x, double y, double z, char id)> set_force;
  VendorFunction<int(double x, double y, double z, double tx, double ty, double tz, char id)> set_wrench;
  VendorFunction<int(double x, double y, double z, double tx, double ty, double tz, double gripper, char id)>
      set_wrench_and_gripper;
  VendorFunction<int()> last_error;
  VendorFunction<const char*()> last_error_text;

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
