// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/force_dimension/dhd.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <cstdlib>
#include <vector>

namespace hapticd::tools {
namespace {

constexpr const char* kName = "libdrd.so";

void addVersions(std::vector<std::string>& candidates, const std::string& folder) {
  for (std::string& path : versionsOf(folder, kName)) candidates.push_back(std::move(path));
}

std::vector<std::string> candidates() {
  std::vector<std::string> found;
  utsname machine{};
  ::uname(&machine);
  for (const char* variable : {"FDSDK", "FORCEDIM_SDK"}) {
    const char* folder = std::getenv(variable);
    if (folder == nullptr) continue;
    addVersions(found, fmt::format("{}/lib/release/lin-{}-gcc", folder, machine.machine));
  }
  addVersions(found, "/usr/local/lib");
  found.insert(found.end(), {kName, "libdrd.so.3"});  // where the system's loader looks
  return found;
}

base::Result<void> find(const VendorLibrary& library, Dhd& dhd) {
  base::Result<void> found;
  const auto next = [&](const char* name, auto& function) {
    if (found) found = library.find(name, function);
  };
  next("dhdGetSDKVersion", dhd.version);
  next("dhdGetDeviceCount", dhd.device_count);
  next("dhdOpen", dhd.open);
  next("dhdOpenSerial", dhd.open_serial);
  next("dhdClose", dhd.close);
  next("dhdStop", dhd.stop);
  next("dhdGetSystemName", dhd.system_name);
  next("dhdGetSystemType", dhd.system_type);
  next("dhdGetSerialNumber", dhd.serial_number);
  next("dhdGetStatus", dhd.status);
  next("dhdHasWrist", dhd.has_wrist);
  next("dhdHasActiveWrist", dhd.has_active_wrist);
  next("dhdHasGripper", dhd.has_gripper);
  next("dhdHasActiveGripper", dhd.has_active_gripper);
  next("dhdEnableExpertMode", dhd.enable_expert_mode);
  next("dhdSetWatchdog", dhd.set_watchdog);
  next("dhdGetWatchdog", dhd.watchdog);
  next("dhdSetMaxForce", dhd.set_max_force);
  next("dhdSetGravityCompensation", dhd.set_gravity_compensation);
  next("dhdSetBrakes", dhd.set_brakes);
  next("dhdEnableForce", dhd.enable_force);
  next("dhdGetPosition", dhd.position);
  next("dhdGetPositionAndOrientationFrame", dhd.pose);
  next("dhdGetGripperAngleRad", dhd.gripper_angle);
  next("dhdGetButtonMask", dhd.buttons);
  next("dhdSetForce", dhd.set_force);
  next("dhdSetForceAndTorque", dhd.set_wrench);
  next("dhdSetForceAndTorqueAndGripperForce", dhd.set_wrench_and_gripper);
  next("dhdErrorGetLast", dhd.last_error);
  next("dhdErrorGetLastStr", dhd.last_error_text);
  return found;
}

}  // namespace

base::Result<Dhd> Dhd::load(const std::string& path) {
  auto library = VendorLibrary::load(path.empty() ? candidates() : std::vector{path},
                                     "install the vendor's SDK, or name its libdrd.so.* by --library");
  if (!library) return std::unexpected(library.error());
  Dhd dhd{};
  if (auto ok = find(*library, dhd); !ok) return std::unexpected(ok.error());
  int major = 0;
  int minor = 0;
  int release = 0;
  int revision = 0;
  dhd.version(&major, &minor, &release, &revision);
  constexpr int kOldestMajor = 3;
  if (major < kOldestMajor)
    return std::unexpected(base::Error{
        library->path(),
        fmt::format("is version {}.{}.{}; {} or newer is needed", major, minor, release, kOldestMajor),
        "install a newer SDK of the vendor"});
  return dhd;
}

std::string Dhd::lastError() const {
  const char* text = last_error_text();
  return fmt::format("{} (error {})", text == nullptr ? "unknown" : text, last_error());
}

}  // namespace hapticd::tools
