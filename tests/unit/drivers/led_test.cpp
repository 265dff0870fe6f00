// SPDX-License-Identifier: Apache-2.0
// The LEDs with the real libgpiod. These tests need no GPIO chip and run where there is none.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>

#include "drivers/led/gpiod/chip_path.h"
#include "drivers/led/gpiod/gpiod_leds.h"
#include "drivers/led/gpiod/line_error.h"
#include "drivers/make_led_panel.h"
#include "frame_collector.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
namespace {

using Step = LineFailure::Step;

constexpr const char* kNoSuchChip =
    "GPIO chip \"gpiochip-none\": no such chip (gpiodetect lists the chips; load the chip's driver, "
    "or "
    "correct leds.chip)";

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
  EXPECT_EQ(leds.status().detail, kNoSuchChip);
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

TEST(GpiodLeds, ADeviceThatIsNoChipIsNotOne) {
  GpiodLeds leds(settingsOf("/dev/null"));
  ASSERT_TRUE(leds.start());
  EXPECT_TRUE(test::eventually([&] { return reports(leds, "GPIO chip \"/dev/null\": not a GPIO chip"); }))
      << leds.status().detail;
  EXPECT_EQ(leds.status().state, LedState::absent);
}

TEST(GpiodLeds, ShowAndStopWithoutAChip) {
  GpiodLeds leds(settingsOf("gpiochip-none"));
  leds.show(LedSet("1111"));
  ASSERT_TRUE(leds.start());
  for (unsigned lit = 0; lit < 1000; ++lit) leds.show(LedSet(lit));
  leds.stop();
  leds.stop();
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
  const config::Result<void> started = leds.start();
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().what.find("\"99999\""), std::string::npos) << started.error().text();
}

TEST(ChipPath, OfAPathOrANameNeedsNoChip) {
  EXPECT_EQ(chipPath("/dev/gpiochip7"), "/dev/gpiochip7");
  EXPECT_EQ(chipPath("/some/link"), "/some/link");
  EXPECT_EQ(chipPath("gpiochip12"), "/dev/gpiochip12");
}

TEST(ChipPath, OfAnythingElseIsSearchedByLabel) {
  for (const char* label : {"gpiochip", "gpiochip-none", "gpiochip1x", "no chip has this label"}) {
    const auto path = chipPath(label);
    ASSERT_FALSE(path) << label;
    // a chip that may not be opened could have the label
    EXPECT_TRUE(path.error() == ENOENT || path.error() == EACCES) << path.error();
  }
}

TEST(LineError, NamesChipAndCauseAndRemedy) {
  const config::LineAddress line{"STATUS", 0, false};
  const auto textOf = [&](Step step, int error, const char* holder = "") {
    return lineError("box", line, {step, error, holder}).text();
  };
  EXPECT_EQ(
      textOf(Step::chip, EACCES),
      "GPIO chip \"box\": permission denied (let the daemon's user read and write /dev/gpiochip*: by its "
      "group, or by a udev rule)");
  EXPECT_EQ(textOf(Step::line, ENOENT),
            "GPIO chip \"box\", line \"STATUS\": no such line (gpioinfo lists the lines of each chip; "
            "correct leds.*_line)");
  EXPECT_EQ(textOf(Step::request, EBUSY, "backlight"),
            "GPIO chip \"box\", line \"STATUS\": the line is in use by \"backlight\" (stop the program that "
            "holds it, or "
            "choose another line (gpioinfo shows the holders))");
  EXPECT_EQ(textOf(Step::request, EBUSY),
            "GPIO chip \"box\", line \"STATUS\": the line is in use (stop the program that holds it, or "
            "choose another line "
            "(gpioinfo shows the holders))");
}

TEST(LineError, DistinguishesALostChipFromAFailingLine) {
  const config::LineAddress line{"", 5, false};
  EXPECT_EQ(setError("box", line, ENODEV).text(),
            "GPIO chip \"box\": the chip is gone (connect it again or load its driver; hapticd searches for "
            "it once a "
            "second)");
  EXPECT_EQ(setError("box", line, EIO).text(),
            "GPIO chip \"box\", line 5: cannot be switched: Input/output error (check the chip's connection; "
            "hapticd "
            "tries again once a second)");
}

TEST(LineError, ShowsNoControlCharactersOfALineNameOrAHolder) {
  const std::string text = lineError("box", {"a\x1b[2J", 0, false}, {Step::request, EBUSY, "b\x07"}).text();
  EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
  EXPECT_EQ(text.find('\x07'), std::string::npos) << text;
}

}  // namespace
}  // namespace hapticd::drivers
