// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {
namespace {

constexpr const char* kName = "gpio";
constexpr const char* kChipPrefix = "gpiochip";

struct Chip {
  std::string name;  ///< "gpiochip0"
  std::expected<std::string, int> label;
};

std::string textOf(const Chip& chip) {
  return chip.label ? fmt::format("{} ({})", chip.name, *chip.label) : chip.name;
}

std::vector<std::string> textsOf(const std::vector<Chip>& chips) {
  std::vector<std::string> texts;
  for (const Chip& chip : chips) texts.push_back(textOf(chip));
  return texts;
}

/// Links are left out: some kernels make one for a number that a chip had before.
Reading<std::vector<Chip>> chipsOf(const Examination& box) {
  const Reading<Names> names = box.machine.list("dev");
  if (!names) return std::unexpected(names.error());
  std::vector<Chip> chips;
  for (const std::string& name : *names) {
    if (!name.starts_with(kChipPrefix) || !box.machine.linkedName("dev/" + name).empty()) continue;
    const auto label = box.gpio_label ? box.gpio_label("/dev/" + name) : std::unexpected(ENOTSUP);
    chips.push_back({name, label});
  }
  return chips;
}

/// The chip that leds.chip names: by path, name or label, as the driver takes it.
Finding configuredChip(const Examination& box, const std::vector<Chip>& chips) {
  const std::string& wanted = box.configuration.settings.leds.chip;
  const std::string path = wanted.starts_with('/') ? wanted.substr(1) : "dev/" + wanted;
  const bool names_a_file = wanted.starts_with('/') || wanted.starts_with(kChipPrefix);
  if (names_a_file && box.machine.exists(path)) {
    const auto chip =
        std::ranges::find(chips, std::filesystem::path(wanted).filename().string(), &Chip::name);
    return good(kName, fmt::format("leds.chip is {}", chip == chips.end() ? wanted : textOf(*chip)));
  }
  for (const Chip& chip : chips) {
    if (chip.label && *chip.label == wanted) return good(kName, fmt::format("leds.chip is {}", textOf(chip)));
  }
  const auto unread = std::ranges::find_if(chips, [](const Chip& chip) { return !chip.label; });
  if (!names_a_file && unread != chips.end()) {
    return warning(
        kName,
        fmt::format("whether a chip has the label leds.chip = {} is not known: the label of {} cannot be "
                    "read ({})",
                    wanted, unread->name, std::generic_category().message(unread->label.error())),
        "run as root");
  }
  const std::string fact = fmt::format("there is no chip leds.chip = {}", wanted);
  if (chips.empty()) {
    return warning(kName, fact + ", nor another one",
                   "load the driver of the chip, or set leds.driver: none");
  }
  return warning(
      kName, fmt::format("{}; there are {}", fact, someOf(textsOf(chips), 12)),
      "below 'leds:' in /etc/hapticd/hapticd.yaml set 'chip:' to the label of one of them, which no kernel "
      "renumbers, then systemctl restart hapticd");
}

}  // namespace

/// Of other chips hapticd has no need, and the udev rules do not give them to it.
Findings checkGpio(const Examination& box) {
  if (box.configuration.settings.leds.driver != config::LedDriver::gpiod)
    return {good(kName, "no LEDs are configured, so no chip is needed")};
  const Reading<std::vector<Chip>> chips = chipsOf(box);
  if (!chips) return {unreadable(kName, "dev", chips.error())};
  Findings findings{configuredChip(box, *chips)};
  const auto used =
      std::ranges::find_if(*chips, [&](const Chip& chip) { return isChipOfLeds(box, chip.name); });
  if (used == chips->end()) return findings;
  for (Finding& finding : accessFindings(box, kName, textOf(*used), "dev/" + used->name)) {
    // a box works without LEDs
    if (finding.verdict == Verdict::fail) finding.verdict = Verdict::warn;
    findings.push_back(std::move(finding));
  }
  return findings;
}

}  // namespace hapticd::tools
