// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/inverse3/inverse3_driver.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "config/base/value_text.h"
#include "tools/haptic-bridge/inverse3/driven_device.h"

namespace hapticd::tools::inverse3 {
namespace {

constexpr const char* kUsualAddress = "127.0.0.1:10001";
/// From the port of the simulation channel, 10001, to that of the events, 10020.
constexpr int kEventPortStep = 19;
constexpr std::chrono::milliseconds kOpenPatience{2000};
constexpr std::chrono::milliseconds kEventPatience{500};

base::Error failure(const std::string& what, const std::string& remedy) {
  return {"Inverse3", what, remedy};
}

std::string numberOr(const std::optional<double>& number) {
  return number ? base::numberText(*number) : "not stated";
}

std::string textOr(const std::string& text) {
  return text.empty() ? "not stated" : base::printable(text);
}

/// What the person has to know about what the service does to forces and positions.
void sayFilters(DeviceSession& session, const ServiceFilters& filters) {
  const std::string gravity = !filters.gravity_compensation ? "not stated"
                              : *filters.gravity_compensation
                                  ? "on, scaled by " + numberOr(filters.gravity_scaling)
                                  : "off";
  session.say(fmt::format("filters of the service: force gate, gain {}; damping {}; gravity compensation {}",
                          numberOr(filters.force_gate_gain), numberOr(filters.damping_scalar), gravity));
  session.say(fmt::format("settings of the service: handedness {}, preset {}, basis {}{}",
                          textOr(filters.handedness), textOr(filters.preset), textOr(filters.basis),
                          filters.displaced ? "; a transform of the service moves or turns positions" : ""));
  if (const std::int64_t delay_ns = gateDelayEstimateNs(filters); delay_ns > 0) {
    session.say(
        fmt::format("the force gate counts as {:.1f} ms of delay: an estimate, nobody has measured it",
                    static_cast<double>(delay_ns) * 1e-6));
  }
}

base::Result<InventoryEntry> chosenFrom(const std::vector<InventoryEntry>& entries,
                                        const std::string& device_id) {
  if (entries.empty())
    return std::unexpected(failure("the service has no Inverse3", "connect it and switch it on"));
  if (device_id.empty()) return entries.front();
  const auto found = std::ranges::find(entries, device_id, &InventoryEntry::device_id);
  if (found != entries.end()) return *found;
  std::string others;
  for (const InventoryEntry& entry : entries)
    others += (others.empty() ? "" : ", ") + base::inQuotes(entry.device_id);
  return std::unexpected(
      failure(fmt::format("the service has no device {}, but {}", base::inQuotes(device_id), others),
              "--device names one of them"));
}

base::Result<InventoryEntry> inventoryOf(ServiceLink& link, const std::string& device_id,
                                         const GivesUp& gives_up) {
  const auto deadline = std::chrono::steady_clock::now() + kOpenPatience;
  while (!gives_up() && std::chrono::steady_clock::now() < deadline) {
    auto text = link.receive(std::chrono::milliseconds(20));
    if (!text) return std::unexpected(text.error());
    if (!*text) continue;
    auto entries = inventoryFrom(**text);
    if (!entries) return std::unexpected(entries.error());
    return chosenFrom(*entries, device_id);
  }
  return std::unexpected(failure("the service does not list its devices", ""));
}

std::optional<ServiceLink> eventChannelOf(const ServiceEndpoint& endpoint, DeviceSession& session,
                                          const GivesUp& gives_up) {
  const int port = endpoint.port + kEventPortStep;
  if (port > std::numeric_limits<std::uint16_t>::max()) return std::nullopt;
  auto events =
      ServiceLink::open({endpoint.address, static_cast<std::uint16_t>(port)}, kEventPatience, gives_up);
  if (events) return std::move(*events);
  session.say(fmt::format("no event channel at port {}: causes of faults are not named", port));
  return std::nullopt;
}

}  // namespace

base::Result<KeyForm> Inverse3Driver::formToUse(const ServiceVersion& version) const {
  if (both_ignored_) {
    return std::unexpected(
        failure(fmt::format("the service, version {}, ignores forces written as `vector` and as `values`",
                            base::inQuotes(version.text)),
                "report this version; hapticd exerts nothing that it cannot check"));
  }
  auto form = keyFormOf(version);
  if (!form || !ignored_) return form;
  return otherThan(*ignored_);
}

base::Result<void> Inverse3Driver::drive(DeviceSession& session) {
  auto driven = driveOnce(session);
  if (session.ends()) return {};  // what was given up for it is no fault
  return driven;
}

base::Result<void> Inverse3Driver::driveOnce(DeviceSession& session) {
  const GivesUp gives_up = [&session] { return session.ends(); };
  const auto endpoint = serviceEndpointFrom(options_.address.empty() ? kUsualAddress : options_.address);
  if (!endpoint) return std::unexpected(endpoint.error());
  const auto body = httpGet(*endpoint, "/version", kOpenPatience, gives_up);
  if (!body) return std::unexpected(body.error());
  const auto version = versionFrom(*body);
  if (!version) return std::unexpected(version.error());
  if (std::exchange(version_, version->text) != version->text) {
    ignored_.reset();
    both_ignored_ = false;
  }
  const auto form = formToUse(*version);
  if (!form) return std::unexpected(form.error());

  auto link = ServiceLink::open(*endpoint, kOpenPatience, gives_up);
  if (!link) return std::unexpected(link.error());
  const auto entry = inventoryOf(*link, options_.device, gives_up);
  if (!entry) return std::unexpected(entry.error());
  if (entry->filters.scaled) {
    return std::unexpected(failure("a transform of the service scales positions: forces would not fit them",
                                   "set the scale of transform and mount to 1"));
  }
  auto events = eventChannelOf(*endpoint, session, gives_up);

  session.say(fmt::format("Inverse Service {}, forces written as `{}`", base::inQuotes(version->text),
                          nameOf(*form)));
  sayFilters(session, entry->filters);
  DrivenDevice device(session, *link, events, *entry, *form);
  if (auto ok = device.begin(); !ok) return ok;
  if (session.ends()) return {};
  session.opened({.model = entry->type.empty() ? "inverse3" : base::printable(entry->type),
                  .serial = base::printable(entry->device_id),
                  .limits = {.force_n = forceLimitOf(entry->type)}});
  auto driven = device.run();
  if (device.ignoresForces()) {
    both_ignored_ = ignored_.has_value();
    ignored_ = *form;
  }
  return driven;
}

std::unique_ptr<DeviceDriver> makeInverse3Driver(const VendorOptions& options) {
  return std::make_unique<Inverse3Driver>(options);
}

}  // namespace hapticd::tools::inverse3
