// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "config/base/error.h"
#include "tools/haptic-bridge/base/vendor_library.h"

namespace hapticd::tools {

using HdHandle = unsigned int;
inline constexpr HdHandle kNoHdHandle = 0xFFFFFFFF;

/// What went wrong, as the library returns it.
struct HdErrorInfo {
  unsigned int code = 0;
  int internal_code = 0;
  HdHandle device = 0;
};

enum HdError : unsigned int {
  kHdSuccess = 0,
  kHdWarmMotors = 0x200,
  kHdExceededForce = 0x201,
  kHdExceededImpulse = 0x202,
  kHdExceededVelocity = 0x203,
  kHdForceError = 0x204,
  kHdFirstFrameError = 0x400,
  kHdLastFrameError = 0x402,
};

enum HdParameter : unsigned int {
  kHdButtons = 0x2000,
  kHdPosition = 0x2050,   ///< 3, mm
  kHdTransform = 0x2052,  ///< 16, column by column, mm
  kHdModel = 0x2501,
  kHdSerial = 0x2504,
  kHdOutputDegrees = 0x2554,
  kHdCalibrationStyles = 0x2555,
  kHdNominalMaxForce = 0x2603,  ///< N
  kHdForce = 0x2700,            ///< 3, N
  kHdTorque = 0x2701,           ///< 3, mN m
};
inline constexpr unsigned int kHdForceOutput = 0x4000;

enum HdCalibration : unsigned int {
  kHdCalibrated = 0x5000,
  kHdNeedsUpdate = 0x5001,
  kHdNeedsPerson = 0x5002,
};
enum HdCalibrationStyle : unsigned int { kHdEncoderReset = 1, kHdAutomatic = 2, kHdInkwell = 4 };

enum HdCallbackCode : unsigned int { kHdDone = 0, kHdContinue = 1 };
using HdCallback = unsigned int(void* user);
inline constexpr unsigned short kHdTopPriority = 65535;

/// The functions of OpenHaptics' library that the driver calls, found at run time. Most return nothing: what
/// went wrong is in a queue that `error` reads.
struct Hd {
  VendorFunction<HdHandle(const char* name)> init_device;
  VendorFunction<void(HdHandle device)> disable_device;
  VendorFunction<void(HdHandle device)> make_current;
  VendorFunction<void(HdHandle device)> begin_frame;
  VendorFunction<void(HdHandle device)> end_frame;
  VendorFunction<HdErrorInfo()> error;
  VendorFunction<const char*(unsigned int code)> error_text;
  VendorFunction<void(unsigned int capability)> enable;
  VendorFunction<void(unsigned int capability)> disable;
  VendorFunction<unsigned char(unsigned int capability)> is_enabled;
  VendorFunction<void(unsigned int parameter, int* values)> get_integers;
  VendorFunction<void(unsigned int parameter, double* values)> get_doubles;
  VendorFunction<void(unsigned int parameter, const double* values)> set_doubles;
  VendorFunction<const char*(unsigned int parameter)> get_string;
  VendorFunction<unsigned int()> check_calibration;
  VendorFunction<void(unsigned int style)> update_calibration;
  VendorFunction<void()> start_scheduler;
  VendorFunction<void()> stop_scheduler;
  VendorFunction<unsigned long(HdCallback* callback, void* user, unsigned short priority)> schedule;
  VendorFunction<void(unsigned long handle)> unschedule;

  /// Loads the library: `library`, or the one that the system's loader finds.
  /// Errors: it is not there, or lacks a function.
  static base::Result<Hd> load(const std::string& library);
  std::string textOf(unsigned int code) const;
  /// Empties the queue of errors; returns the first one.
  unsigned int takeErrors() const;
};

}  // namespace hapticd::tools
