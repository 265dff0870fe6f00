// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_handle.h"

#include <memory>
#include <thread>
#include <utility>

#include "drivers/handle/hid/hidapi_port.h"

namespace hapticd::drivers {
namespace {

constexpr std::uint16_t kGenericDesktopPage = 0x01;
constexpr std::uint16_t kMultiAxisController = 0x08;

base::Result<HidSelection> selectionFrom(const config::HandleSettings& settings) {
  const auto id = hidIdFrom(settings.of<HidHandleSettings>().device);
  if (!id) return std::unexpected(base::Error{"hid_handle.device", id.error().what, id.error().remedy});
  if (settings.of<HidHandleSettings>().kind == HidKind::spacemouse) {
    return HidSelection{*id, kGenericDesktopPage, kMultiAxisController, settings.serial};
  }
  return HidSelection{*id, kControllerUsagePage, kControllerUsage, settings.serial};
}

}  // namespace

base::Result<void> HidHandle::check() const {
  const auto selection = selectionFrom(settings_);
  return selection ? base::Result<void>() : std::unexpected(selection.error());
}

base::Result<void> HidHandle::start(HandleChannels& channels) {
  const auto selection = selectionFrom(settings_);
  if (!selection) return std::unexpected(selection.error());
  const auto startThread = [this](auto body) -> base::Result<std::thread> {
    auto started = startHandleThread(policy_, std::move(body));
    if (!started) return std::unexpected(started.error());
    scheduling_ = started->scheduling;
    return std::move(started->thread);
  };
  return thread_.start(std::make_shared<HidWorker>(settings_, scale_, *selection, open_, channels),
                       "hid handle", startThread);
}

HandleStatus HidHandle::status() const {
  HandleStatus status = thread_.status("hid " + settings_.of<HidHandleSettings>().device);
  status.scheduling = scheduling_;
  return status;
}

std::unique_ptr<Handle> makeHidHandle(const config::HandleSettings& settings,
                                      const rt::HandleScaleParameters& scale,
                                      const HandleThreadPolicy& policy) {
  return std::make_unique<HidHandle>(settings, scale, openThroughHidapi, policy);
}

}  // namespace hapticd::drivers
