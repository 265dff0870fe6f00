// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/open_haptics/hd.h"

#include <fmt/format.h>

#include <vector>

namespace hapticd::tools {

base::Result<Hd> Hd::load(const std::string& path) {
  const std::vector<std::string> candidates =
      path.empty() ? std::vector<std::string>{"libHD.so", "libhdPhantom.so"} : std::vector{path};
  auto library = VendorLibrary::load(
      candidates, "install OpenHaptics and the device's driver, or name its libHD.so by --library");
  if (!library) return std::unexpected(library.error());
  Hd hd{};
  base::Result<void> found;
  const auto next = [&](const char* name, auto& function) {
    if (found) found = library->find(name, function);
  };
  next("hdInitDevice", hd.init_device);
  next("hdDisableDevice", hd.disable_device);
  next("hdMakeCurrentDevice", hd.make_current);
  next("hdBeginFrame", hd.begin_frame);
  next("hdEndFrame", hd.end_frame);
  next("hdGetError", hd.error);
  next("hdGetErrorString", hd.error_text);
  next("hdEnable", hd.enable);
  next("hdDisable", hd.disable);
  next("hdIsEnabled", hd.is_enabled);
  next("hdGetIntegerv", hd.get_integers);
  next("hdGetDoublev", hd.get_doubles);
  next("hdSetDoublev", hd.set_doubles);
  next("hdGetString", hd.get_string);
  next("hdCheckCalibration", hd.check_calibration);
  next("hdUpdateCalibration", hd.update_calibration);
  next("hdStartScheduler", hd.start_scheduler);
  next("hdStopScheduler", hd.stop_scheduler);
  next("hdScheduleAsynchronous", hd.schedule);
  next("hdUnschedule", hd.unschedule);
  if (!found) return std::unexpected(found.error());
  return hd;
}

std::string Hd::textOf(unsigned int code) const {
  const char* text = error_text(code);
  return fmt::format("{} (error 0x{:x})", text == nullptr ? "unknown" : text, code);
}

unsigned int Hd::takeErrors() const {
  constexpr int kMost = 64;  // that a queue may hold; a broken one must not hold up the loop
  const unsigned int first = error().code;
  for (int i = 0; i < kMost && first != kHdSuccess; ++i) {
    if (error().code == kHdSuccess) break;
  }
  return first;
}

}  // namespace hapticd::tools
