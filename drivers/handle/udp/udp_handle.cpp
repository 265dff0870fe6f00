// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/udp/udp_handle.h"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "drivers/handle/udp/key_file.h"
#include "drivers/handle/udp/udp_settings.h"
#include "drivers/handle/udp/udp_worker.h"

namespace hapticd::drivers {
namespace {

base::Error at(const char* parameter, base::Error error) {
  error.where = parameter;
  return error;
}

base::Result<udp::WorkerSettings> workerSettingsFrom(const config::HandleSettings& settings) {
  udp::WorkerSettings worker;
  const auto local = ipv4EndpointFrom(settings.of<UdpHandleSettings>().address);
  if (!local) return std::unexpected(at("udp_handle.address", local.error()));
  worker.local = {local->address, static_cast<std::uint16_t>(settings.of<UdpHandleSettings>().port)};
  const auto peer = ipv4EndpointFrom(settings.of<UdpHandleSettings>().peer);
  if (!peer) return std::unexpected(at("udp_handle.peer", peer.error()));
  worker.peer = *peer;
  auto key = udp::keyFrom(settings.of<UdpHandleSettings>().key_file);
  if (!key) return std::unexpected(key.error());
  worker.key = std::move(*key);
  return worker;
}

}  // namespace

UdpHandle::UdpHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
                     const HandleThreadPolicy& policy)
    : settings_(settings), scale_(scale), policy_(policy) {}

base::Result<void> UdpHandle::check() const {
  const auto worker_settings = workerSettingsFrom(settings_);
  return worker_settings ? base::Result<void>() : std::unexpected(worker_settings.error());
}

base::Result<void> UdpHandle::start(HandleChannels& channels) {
  if (thread_.joinable()) return std::unexpected(base::Error{"udp handle", "is already running", ""});
  auto worker_settings = workerSettingsFrom(settings_);
  if (!worker_settings) return std::unexpected(worker_settings.error());
  stop_event_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (stop_event_ < 0) {
    return std::unexpected(base::Error{"udp handle", std::strerror(errno), "raise the limit of open files"});
  }
  board_.reset("udp " + settings_.of<UdpHandleSettings>().peer);
  auto worker = std::make_shared<udp::UdpWorker>(*worker_settings, HandleFrame(settings_, scale_), channels,
                                                 board_, gate_);
  worker->openSocket();  // if this fails, run() tries again
  auto started = startHandleThread(policy_, [worker, stop_event = stop_event_] { worker->run(stop_event); });
  if (!started) {
    ::close(stop_event_);
    return std::unexpected(started.error());
  }
  board_.update([&](HandleStatus& status) { status.scheduling = started->scheduling; });
  thread_ = std::move(started->thread);
  return {};
}

HandleStatus UdpHandle::status() const {
  HandleStatus status = board_.snapshot();
  status.last_hop = gate_.lastHop();
  return status;
}

void UdpHandle::stop() {
  if (!thread_.joinable()) return;
  ::eventfd_write(stop_event_, 1);
  thread_.join();
  ::close(stop_event_);
  board_.set(HandlePresence::absent, "not started");
}

std::unique_ptr<Handle> makeUdpHandle(const config::HandleSettings& settings,
                                      const rt::HandleScaleParameters& scale,
                                      const HandleThreadPolicy& policy) {
  return std::make_unique<UdpHandle>(settings, scale, policy);
}

}  // namespace hapticd::drivers
