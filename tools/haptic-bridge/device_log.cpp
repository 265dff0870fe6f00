// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/device_log.h"

#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "tools/lib/whole_file/whole_file.h"

namespace hapticd::tools {

config::Result<std::unique_ptr<DeviceLog>> DeviceLog::at(const std::string& path) {
  if (auto good = mayWrite(path, IfExists::replace); !good) return std::unexpected(good.error());
  std::FILE* const file = std::fopen(path.c_str(), "we");
  if (file == nullptr) return std::unexpected(config::Error{path, std::strerror(errno), "check --log"});
  std::unique_ptr<DeviceLog> log(new DeviceLog(path, file));
  log->thread_ = std::jthread([&self = *log](const std::stop_token& stop) { self.run(stop); });
  return log;
}

void DeviceLog::run(const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kPeriod{20};
  write(
      "t_ns,command_sequence,command_made_ns,command_age_ns,force_tick,force_tick_ns,mode,fx_n,fy_n,fz_n,"
      "exerted_x_n,exerted_y_n,exerted_z_n,x_m,y_m,z_m\n");
  for (bool ends = false; !ends;) {
    ends = stop.stop_requested();
    DeviceTick tick;
    while (ticks_.pop(tick)) write(tick);
    if (!ends) std::this_thread::sleep_for(kPeriod);
  }
}

void DeviceLog::write(const DeviceTick& tick) {
  const rt::Vec3& f = tick.commanded_n;
  const rt::Vec3& e = tick.exerted_n;
  const rt::Vec3& p = tick.position_m;
  write(fmt::format("{},{},{},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.9g},{:.9g},{:.9g}\n",
                    tick.time_ns, tick.command_sequence, tick.command_made_ns, tick.command_age_ns,
                    tick.force_tick, tick.force_tick_ns, tick.active ? "active" : "zero", f.x, f.y, f.z, e.x,
                    e.y, e.z, p.x, p.y, p.z));
}

void DeviceLog::write(const std::string& text) {
  if (error_ == 0 && std::fputs(text.c_str(), file_.get()) < 0) error_ = errno;
}

config::Result<void> DeviceLog::finish() {
  thread_.request_stop();
  thread_.join();
  if (std::fclose(file_.release()) != 0 && error_ == 0) error_ = errno;
  if (error_ == 0) return {};
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  return std::unexpected(config::Error{path_, fmt::format("cannot be written: {}", std::strerror(error_)),
                                       "free space or give another --log"});
}

}  // namespace hapticd::tools
