// SPDX-License-Identifier: Apache-2.0
// The LEDs with the real libgpiod. These tests need no GPIO chip and run where there is none.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>

#include "drivers/driver_table.h"
#include "drivers/led/gpiod/gpiod_leds.h"
#include "drivers/led/gpiod/output_line.h"
#include "frame_collector.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
namespace {

using Step = LineFailure::Step;

/// What is reported of the chip "gpiochip-none"; it depends on the chips of the machine that runs the tests.
std::string noSuchChip() {
  return lineError("gpiochip-none", {}, {Step::chip, ENOENT, ""}, chipsText(gpioChips())).text();
}

config::LedSettings settingsOf(const std::string& chip) {
  config::LedSettings settings;
  settings.driver = config::LedDriver::gpiod;
  settings.chip = chip;
  settings.power_line = "0";
  settings.fault_line = "STATUS active-low";
  return settings;
}

bool reports(const LedPanel& leds, const std::string& part) {
  return leds.status().detail.find(part) != std::string::npos;
}

TEST(NoLeds, AreNoneWhateverIsShown) {
  const std::unique_ptr<LedPanel> leds = makeLedPanel({});
  ASSERT_TRUE(leds->start());
  leds->show(LedSet("1111"));
  EXPECT_EQ(leds->status().state, LedState::none);
  EXPECT_EQ(leds->status().configured, LedSet());
  leds->stop();
}

TEST(GpiodLeds, KnowWhichLedsAreConfigured) {
  const std::unique_ptr<LedPanel> leds = makeLedPanel(settingsOf("box"));
  EXPECT_EQ(leds->status().identity, "gpiod box");
  EXPECT_EQ(leds->status().configured.to_string(), "1001") << "fault and power";
  EXPECT_EQ(leds->status().state, LedState::absent);
}

TEST(GpiodLeds, AnAbsentChipIsReportedOnceForAllLinesWithARemedy) {
  GpiodLeds leds(settingsOf("gpiochip-none"));
  ASSERT_TRUE(leds.start());
  EXPECT_TRUE(test::eventually([&] { return !leds.status().detail.empty(); }));
  EXPECT_EQ(leds.status().state, LedState::absent);
  EXPECT_EQ(leds.status().detail, noSuchChip());
  leds.stop();
}

TEST(GpiodLeds, AreSearchedForAgain) {
  const test::TemporaryFolder folder;
  const std::filesystem::path chip = folder.path() / "chip";
  GpiodLeds leds(settingsOf(chip));
  ASSERT_TRUE(leds.start());
  ASSERT_TRUE(test::eventually([&] { return reports(leds, "no such chip"); }));
  folder.write("chip", "");
  EXPECT_TRUE(test::eventually([&] { return reports(leds, "not a GPIO chip"); })) << leds.status().detail;
  std::filesystem::remove(chip);
  EXPECT_TRUE(test::eventually([&] { return reports(leds, "no such chip"); })) << leds.status().detail;
}

TEST(GpiodLeds, StartOnceAndAgainAfterStop) {
  GpiodLeds leds(settingsOf("gpiochip-none"));
  leds.stop();
  ASSERT_TRUE(leds.start());
  EXPECT_FALSE(leds.start()) << "they are running";
  leds.stop();
  EXPECT_TRUE(leds.start());
}

TEST(GpiodLeds, RefuseALineThatCannotBeRead) {
  config::LedSettings settings = settingsOf("gpiochip-none");
  settings.camera_line = "99999";
  GpiodLeds leds(settings);
  const base::Result<void> started = leds.start();
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().what.find("\"99999\""), std::string::npos) << started.error().text();
}

/// The chips of a Raspberry Pi 5 as its kernels number them: the lines of the header are on pinctrl-rp1.
std::vector<GpioChip> raspberryPi5(const std::string& header_chip) {
  return {{"/dev/gpiochip" + header_chip, "pinctrl-rp1"}, {"/dev/gpiochip10", "gpio-brcmstb@107d508500"}};
}

TEST(ChipPath, OfAPathOrANameNeedsNoChip) {
  EXPECT_EQ(chipPath("/dev/gpiochip7", {}), "/dev/gpiochip7");
  EXPECT_EQ(chipPath("/some/link", {}), "/some/link");
  EXPECT_EQ(chipPath("gpiochip12", {}), "/dev/gpiochip12");
}

TEST(ChipPath, OfALabelIsThatOfTheChipWhateverItsNumber) {
  EXPECT_EQ(chipPath("pinctrl-rp1", raspberryPi5("0")), "/dev/gpiochip0");
  EXPECT_EQ(chipPath("pinctrl-rp1", raspberryPi5("4")), "/dev/gpiochip4");
  EXPECT_EQ(chipPath("gpio-brcmstb@107d508500", raspberryPi5("4")), "/dev/gpiochip10");
}

TEST(ChipPath, OfALabelThatNoChipHasIsNone) {
  for (const char* label : {"gpiochip", "gpiochip-none", "gpiochip1x", "pinctrl"}) {
    EXPECT_EQ(chipPath(label, raspberryPi5("0")), std::unexpected(ENOENT)) << label;
  }
}

TEST(ChipPath, OfALabelIsNotKnownWhileAChipMayNotBeOpened) {
  const std::vector<GpioChip> chips{{"/dev/gpiochip0", std::unexpected(EACCES)}, {"/dev/gpiochip1", "other"}};
  EXPECT_EQ(chipPath("pinctrl-rp1", chips), std::unexpected(EACCES));
  EXPECT_EQ(chipPath("other", chips), "/dev/gpiochip1");
}

TEST(GpioChips, AreInTheOrderOfTheirNumbersAndWithoutLinks) {
  const test::TemporaryFolder folder;
  for (const char* name :
       {"gpiochip10", "gpiochip2", "gpiochip0", "gpiochip", "gpiochipx", "gpio", "gpiochip3.old"})
    folder.write(name, "");
  std::filesystem::create_symlink("gpiochip0", folder.path() / "gpiochip4");
  std::string names;
  for (const GpioChip& chip :
       chipsIn(folder.path(), [](const std::string& path) { return "label of " + path; })) {
    EXPECT_EQ(chip.label, "label of " + chip.path);
    names += std::filesystem::path(chip.path).filename().string() + " ";
  }
  EXPECT_EQ(names, "gpiochip0 gpiochip2 gpiochip10 ");
  EXPECT_TRUE(chipsIn(folder.path() / "none", chipLabel).empty());
}

TEST(GpioChips, AreNamedWithTheirLabels) {
  EXPECT_EQ(chipsText(raspberryPi5("0")), "gpiochip0 (pinctrl-rp1), gpiochip10 (gpio-brcmstb@107d508500)");
  EXPECT_EQ(chipsText({{"/dev/gpiochip0", std::unexpected(EACCES)}}),
            "gpiochip0 (label not readable: Permission denied)");
  EXPECT_EQ(chipsText({{"/dev/gpiochip0", "a\x1b[2J"}}), "gpiochip0 (a\\x1b[2J)");
  EXPECT_EQ(chipsText({}), "");
}

TEST(LineError, NamesChipAndCauseAndRemedy) {
  const config::LineAddress named{"STATUS", 0, false}, numbered{"", 5, false};
  const auto ofRequest = [&](Step step, int error, const char* holder = "",
                             const char* chips = "gpiochip0 (a)") {
    return lineError("box", named, {step, error, holder}, chips).text();
  };
  const std::pair<std::string, std::string> cases[] = {
      {ofRequest(Step::chip, EACCES), R"(GPIO chip "box": permission denied (restart hapticd.service)"},
      {ofRequest(Step::chip, ENOENT),
       R"(GPIO chip "box": no such chip; there are gpiochip0 (a) (set leds.chip)"},
      {ofRequest(Step::chip, ENOENT, "", ""), R"(GPIO chip "box": no such chip, as this machine has none)"},
      {ofRequest(Step::line, ENOENT), R"(GPIO chip "box", line "STATUS": no such line (gpioinfo)"},
      {ofRequest(Step::request, EBUSY, "backlight"),
       R"(line "STATUS": the line is in use by "backlight" (stop)"},
      {ofRequest(Step::request, EBUSY), R"(line "STATUS": the line is in use (stop the program)"},
      {setError("box", numbered, ENODEV).text(), R"(GPIO chip "box": the chip is gone (connect it again)"},
      {setError("box", numbered, EIO).text(),
       R"(GPIO chip "box", line 5: cannot be switched: Input/output error)"}};
  for (const auto& [text, expected] : cases) {
    EXPECT_NE(text.find(expected), std::string::npos) << expected << " is not in: " << text;
  }
}

TEST(LineError, ShowsNoControlCharactersOfALineNameOrAHolder) {
  const std::string text =
      lineError("box", {"a\x1b[2J", 0, false}, {Step::request, EBUSY, "b\x07"}, "").text();
  EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
  EXPECT_EQ(text.find('\x07'), std::string::npos) << text;
}

}  // namespace
}  // namespace hapticd::drivers
