#include "tools/haptic-bridge/device_log.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

namespace hapticd::tools {

config::Result<DeviceLog> DeviceLog::at(const std::string& path) {
  std::FILE* const file = std::fopen(path.c_str(), "we");
  if (file == nullptr) return std::unexpected(config::Error{path, std::strerror(errno), "check --log"});
  DeviceLog log(path, file);
  fmt::print(
      file,
      "t_ns,command_sequence,command_made_ns,command_age_ns,force_tick,force_tick_ns,mode,fx_n,fy_n,fz_n,"
      "exerted_x_n,exerted_y_n,exerted_z_n,x_m,y_m,z_m\n");
  return log;
}

void DeviceLog::add(const DeviceTick& tick) {
  const rt::Vec3& f = tick.commanded_n;
  const rt::Vec3& e = tick.exerted_n;
  const rt::Vec3& p = tick.position_m;
  fmt::print(
      file_.get(), "{},{},{},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.9g},{:.9g},{:.9g}\n",
      tick.time_ns, tick.command_sequence, tick.command_made_ns, tick.command_age_ns, tick.force_tick,
      tick.force_tick_ns, tick.active ? "active" : "zero", f.x, f.y, f.z, e.x, e.y, e.z, p.x, p.y, p.z);
}

config::Result<void> DeviceLog::finish() {
  const bool written = std::fflush(file_.get()) == 0 && std::ferror(file_.get()) == 0;
  if (!written) return std::unexpected(config::Error{path_, "cannot be written", "check the free space"});
  return {};
}

}  // namespace hapticd::tools
