// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_handle.h"

namespace hapticd::drivers {
namespace {

constexpr std::uint16_t kGenericDesktopPage = 0x01;
constexpr std::uint16_t kMultiAxisController = 0x08;

config::Result<HidSelection> selectionFrom(const config::HandleSettings& settings) {
  const auto id = config::hidIdFrom(settings.hid.device);
  if (!id) return std::unexpected(config::Error{"hid_handle.device", id.error().what, id.error().remedy});
  if (settings.hid.kind == config::HidKind::spacemouse) {
    return HidSelection{*id, kGenericDesktopPage, kMultiAxisController, settings.serial};
  }
  return HidSelection{*id, kControllerUsagePage, kControllerUsage, settings.serial};
}

}  // namespace

config::Result<void> HidHandle::start(HandleChannels& channels) {
  if (thread_.joinable()) return std::unexpected(config::Error{"hid handle", "is already running", ""});
  const auto selection = selectionFrom(settings_);
  if (!selection) return std::unexpected(selection.error());
  const auto worker = std::make_shared<HidWorker>(settings_, scale_, *selection, open_, channels);
  auto started = startHandleThread(policy_, [worker] { worker->run(); });
  if (!started) return std::unexpected(started.error());
  const std::lock_guard lock(worker_mutex_);
  worker_ = worker;
  scheduling_ = started->scheduling;
  thread_ = std::move(started->thread);
  return {};
}

void HidHandle::stop() {
  if (!thread_.joinable()) return;
  if (worker_->stop(kStopLimit)) {
    thread_.join();
  } else {
    thread_.detach();
  }
}

HandleStatus HidHandle::status() const {
  const std::lock_guard lock(worker_mutex_);
  HandleStatus status;
  if (worker_) {
    status = worker_->status();
    status.scheduling = scheduling_;
    return status;
  }
  status.identity = "hid " + settings_.hid.device;
  status.detail = "not started";
  return status;
}

}  // namespace hapticd::drivers
