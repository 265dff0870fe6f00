// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/bridge/device_log.h"

#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <system_error>

#include "config/base/whole_file.h"
#include "drivers/base/start_thread.h"

namespace hapticd::tools {
namespace {

constexpr std::chrono::milliseconds kInterval{20};
constexpr std::size_t kWrittenAtOnce = 64 * 1024;  // bytes

void appendRow(fmt::memory_buffer& text, const DeviceTick& tick) {
  const rt::Vec3& f = tick.commanded_n;
  const rt::Vec3& e = tick.exerted_n;
  const rt::Vec3& p = tick.position_m;
  fmt::format_to(std::back_inserter(text),
                 "{},{},{},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.9g},{:.9g},{:.9g}\n",
                 tick.time_ns, tick.command_sequence, tick.command_made_ns, tick.command_age_ns,
                 tick.force_tick, tick.force_tick_ns, tick.active ? "active" : "zero", f.x, f.y, f.z, e.x,
                 e.y, e.z, p.x, p.y, p.z);
}

}  // namespace

base::Result<std::unique_ptr<DeviceLog>> DeviceLog::at(const std::string& path) {
  if (auto good = base::mayWrite(path, base::IfExists::replace); !good) return std::unexpected(good.error());
  std::FILE* const file = std::fopen(path.c_str(), "we");
  if (file == nullptr) return std::unexpected(base::Error{path, std::strerror(errno), "check --log"});
  return into(file, path);
}

base::Result<std::unique_ptr<DeviceLog>> DeviceLog::into(std::FILE* stream, const std::string& path) {
  std::unique_ptr<DeviceLog> log(new DeviceLog(stream, path));
  auto thread = drivers::startThread("device-log", [log = log.get()] { log->writeRows(); });
  if (!thread) return std::unexpected(thread.error());
  log->thread_ = std::move(*thread);
  return log;
}

DeviceLog::~DeviceLog() {
  endThread();
}

void DeviceLog::writeRows() {
  write(
      "t_ns,command_sequence,command_made_ns,command_age_ns,force_tick,force_tick_ns,mode,fx_n,fy_n,fz_n,"
      "exerted_x_n,exerted_y_n,exerted_z_n,x_m,y_m,z_m\n");
  while (!ends_.waitUntil(std::chrono::steady_clock::now() + kInterval)) writeWaiting();
  writeWaiting();
}

void DeviceLog::writeWaiting() {
  fmt::memory_buffer text;
  DeviceTick tick;
  while (waiting_.pop(tick)) {
    appendRow(text, tick);
    if (text.size() < kWrittenAtOnce) continue;
    write(fmt::to_string(text));
    text.clear();
  }
  write(fmt::to_string(text));
}

void DeviceLog::write(const std::string& text) {
  if (error_ != 0) return;
  if (std::fputs(text.c_str(), file_.get()) < 0 || std::fflush(file_.get()) != 0) error_ = errno;
}

void DeviceLog::endThread() {
  if (!thread_.joinable()) return;
  ends_.raise();
  thread_.join();
}

base::Result<void> DeviceLog::finish() {
  endThread();
  if (std::fclose(file_.release()) != 0 && error_ == 0) error_ = errno;
  if (error_ == 0) return {};
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  return std::unexpected(base::Error{path_, fmt::format("cannot be written: {}", std::strerror(error_)),
                                     "free space or give another --log"});
}

}  // namespace hapticd::tools
