// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

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
  VendorLibrary library;

  VendorFunction<HdHandle(const char* name)> init_device{library, "hdInitDevice"};
  VendorFunction<void(HdHandle device)> disable_device{library, "hdDisableDevice"};
  VendorFunction<void(HdHandle device)> make_current{library, "hdMakeCurrentDevice"};
  VendorFunction<void(HdHandle device)> begin_frame{library, "hdBeginFrame"};
  VendorFunction<void(HdHandle device)> end_frame{library, "hdEndFrame"};
  VendorFunction<HdErrorInfo()> error{library, "hdGetError"};
  VendorFunction<const char*(unsigned int code)> error_text{library, "hdGetErrorString"};
  VendorFunction<void(unsigned int capability)> enable{library, "hdEnable"};
  VendorFunction<void(unsigned int capability)> disable{library, "hdDisable"};
  VendorFunction<unsigned char(unsigned int capability)> is_enabled{library, "hdIsEnabled"};
  VendorFunction<void(unsigned int parameter, int* values)> get_integers{library, "hdGetIntegerv"};
  VendorFunction<void(unsigned int parameter, double* values)> get_doubles{library, "hdGetDoublev"};
  VendorFunction<void(unsigned int parameter, const double* values)> set_doubles{library, "hdSetDoublev"};
  VendorFunction<const char*(unsigned int parameter)> get_string{library, "hdGetString"};
  VendorFunction<unsigned int()> check_calibration{library, "hdCheckCalibration"};
  VendorFunction<void(unsigned int style)> update_calibration{library, "hdUpdateCalibration"};
  VendorFunction<void()> start_scheduler{library, "hdStartScheduler"};
  VendorFunction<void()> stop_scheduler{library, "hdStopScheduler"};
  VendorFunction<unsigned long(HdCallback* callback, void* user, unsigned short priority)> schedule{
      library, "hdScheduleAsynchronous"};
  VendorFunction<void(unsigned long handle)> unschedule{library, "hdUnschedule"};

  /// Loads the library: `path`, or the one that the system's loader finds.
  /// Errors: it is not there, or lacks a function.
  static base::Result<Hd> load(const std::string& path) {
    const std::vector<std::string> candidates =
        path.empty() ? std::vector<std::string>{"libHD.so", "libhdPhantom.so"} : std::vector{path};
    auto library = VendorLibrary::load(
        candidates, "install OpenHaptics and the device's driver, or name its libHD.so by --library");
    if (!library) return std::unexpected(library.error());
    Hd hd{std::move(*library)};
    if (hd.library.missing()) return std::unexpected(*hd.library.missing());
    return hd;
  }

  std::string textOf(unsigned int code) const {
    const char* text = error_text(code);
    return fmt::format("{} (error 0x{:x})", text == nullptr ? "unknown" : text, code);
  }

  /// Empties the queue of errors; returns the first one.
  unsigned int takeErrors() const {
    constexpr int kMost = 64;  // that a queue may hold; a broken one must not hold up the loop
    const unsigned int first = error().code;
    for (int i = 0; i < kMost && first != kHdSuccess; ++i) {
      if (error().code == kHdSuccess) break;
    }
    return first;
  }
};

}  // namespace hapticd::tools
