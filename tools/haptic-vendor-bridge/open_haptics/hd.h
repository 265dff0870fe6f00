// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "config/base/error.h"

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
  HdHandle (*init_device)(const char* name);
  void (*disable_device)(HdHandle device);
  void (*make_current)(HdHandle device);
  void (*begin_frame)(HdHandle device);
  void (*end_frame)(HdHandle device);
  HdErrorInfo (*error)();
  const char* (*error_text)(unsigned int code);
  void (*enable)(unsigned int capability);
  void (*disable)(unsigned int capability);
  unsigned char (*is_enabled)(unsigned int capability);
  void (*get_integers)(unsigned int parameter, int* values);
  void (*get_doubles)(unsigned int parameter, double* values);
  void (*set_doubles)(unsigned int parameter, const double* values);
  const char* (*get_string)(unsigned int parameter);
  unsigned int (*check_calibration)();
  void (*update_calibration)(unsigned int style);
  void (*start_scheduler)();
  void (*stop_scheduler)();
  unsigned long (*schedule)(HdCallback* callback, void* user, unsigned short priority);
  void (*unschedule)(unsigned long handle);

  /// Loads the library: `library`, or the one that the system's loader finds.
  /// Errors: it is not there, or lacks a function.
  static base::Result<Hd> load(const std::string& library);
  std::string textOf(unsigned int code) const;
  /// Empties the queue of errors; returns the first one.
  unsigned int takeErrors() const;
};

}  // namespace hapticd::tools
